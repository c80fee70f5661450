"""Weights learnt from demonstrations: the objective, what is drawn, and truths that are found again."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import approx_fprime, minimize
from two_arms import arm_track

from hri_prediction.errors import ConfigError, DataError
from hri_prediction.ontology.costs import COSTS, NUMBER, path_costs
from hri_prediction.ontology.features import pair_features
from hri_prediction.ontology.movements import Movement, movements_of
from hri_prediction.ontology.piirl import (
    cosine,
    learn,
    likelihood_curvature,
    negative_log_likelihood,
)
from hri_prediction.ontology.sampling import BEYOND, WAVES, draw_around, third_differences
from hri_prediction.ontology.synthetic import optimal_movement, total_cost
from hri_prediction.ontology.upper_body import NEUTRAL, UpperBody

BODY = UpperBody(np.array((0.0, 0.19, 0.4)), 0.0, np.array((0.19, 0.29, 0.26, 0.09)))
SPREAD = np.full(14, 0.05)


def path(count: int = 40) -> np.ndarray:
    share = np.linspace(0.0, 1.0, count)
    gone = (10 * share**3 - 15 * share**4 + 6 * share**5)[:, None]
    return NEUTRAL + gone * np.array([0, 0, 0, 0, 0, 0, 0, 0.5, 0.2, 0.1, -0.4, 0, 0, 0])


def partner(count: int = 40) -> np.ndarray:
    arm = np.array([[0.9, 0.0, 0.4], [0.8, 0.0, 0.15], [0.6, 0.0, 0.1], [0.5, 0.0, 0.1]])
    return np.tile(arm, (count, 1, 1))


@given(st.integers(0, 10**6))
@settings(max_examples=20)
def test_the_gradient_is_that_of_finite_differences(seed: int) -> None:
    rng = np.random.default_rng(seed)
    differences = [rng.normal(size=(int(rng.integers(1, 8)), 5)) for _ in range(4)]
    weights = rng.uniform(0.0, 2.0, 5)
    _, gradient = negative_log_likelihood(weights, differences)
    wanted = approx_fprime(weights, lambda w: negative_log_likelihood(w, differences)[0], 1e-7)
    np.testing.assert_allclose(gradient, wanted, atol=1e-5)


@given(st.integers(0, 10**6))
@settings(max_examples=20)
def test_the_curvature_is_that_of_finite_differences(seed: int) -> None:
    rng = np.random.default_rng(seed)
    differences = [rng.normal(size=(int(rng.integers(1, 8)), 5)) for _ in range(4)]
    weights = rng.uniform(0.0, 2.0, 5)
    wanted = approx_fprime(weights, lambda w: negative_log_likelihood(w, differences)[1], 1e-7)
    np.testing.assert_allclose(likelihood_curvature(weights, differences), wanted, atol=1e-5)


@given(st.integers(0, 10**6), st.floats(0.01, 10.0))
@settings(max_examples=15)
def test_the_minimum_is_as_low_as_another_solver_finds_it(seed: int, penalty: float) -> None:
    """Where some costs go together, too, or are the same twice."""
    rng = np.random.default_rng(seed)
    mixed = np.column_stack((np.eye(4), rng.normal(size=(4, 2)), np.eye(4)[:, 0]))
    demonstrations = [(rng.normal(size=4) - 0.3) @ mixed for _ in range(20)]
    samples = [rng.normal(size=(15, 4)) @ mixed for _ in range(20)]
    found = learn(demonstrations, samples, penalty)
    scaled = [
        (drawn - own) / found.scale for own, drawn in zip(demonstrations, samples, strict=True)
    ]

    def objective(weights: np.ndarray) -> float:
        return negative_log_likelihood(weights, scaled)[0] + penalty * float(weights.sum())

    other = minimize(objective, np.full(7, 0.1), method="L-BFGS-B", bounds=[(0.0, None)] * 7)
    assert found.objective == pytest.approx(objective(found.scaled), rel=1e-9)
    assert found.objective <= other.fun + 1e-9
    assert (found.weights >= 0.0).all()


@pytest.mark.parametrize("seed", [109, 110, 123, 136, 154])
def test_a_minimum_is_found_where_the_value_no_longer_tells_steps_apart(seed: int) -> None:
    """The last step of each would lower the value by less than its last digit, and none was good enough."""
    rng = np.random.default_rng(seed)
    rng.normal(0.0, 1.0, 8)
    samples = [rng.normal(0.3, 1.0, (60, 8)) for _ in range(16)]
    found = learn([np.zeros(8)] * 16, samples)
    _, slope = negative_log_likelihood(found.scaled, [own / found.scale for own in samples])
    gradient = slope + found.penalty
    inward = np.where(found.weights > 0.0, gradient, np.minimum(gradient, 0.0))
    assert np.abs(inward).max() < 1e-6


@given(st.integers(0, 10**6), st.floats(0.0, 1.0))
@settings(max_examples=20)
def test_the_objective_is_convex_and_has_a_bound(seed: int, share: float) -> None:
    rng = np.random.default_rng(seed)
    differences = [rng.normal(size=(5, 4)) for _ in range(3)]
    one, other = rng.uniform(0.0, 3.0, (2, 4))
    mixed = share * one + (1.0 - share) * other
    values = [negative_log_likelihood(w, differences)[0] for w in (one, other, mixed)]
    assert values[2] <= share * values[0] + (1.0 - share) * values[1] + 1e-9
    assert min(values) >= 0.0


def test_huge_weights_do_not_overflow() -> None:
    value, gradient = negative_log_likelihood(
        np.full(2, 1e5), [np.array([[-1.0, -2.0], [3.0, 1.0]])]
    )
    assert value == pytest.approx(3e5)
    assert np.isfinite(gradient).all()


def test_a_truth_is_found_again() -> None:
    """Demonstrations that are drawn as the model says: likelier the less they cost."""
    rng = np.random.default_rng(0)
    truth = np.array((3.0, 0.0, 1.0, 0.0, 2.0))
    demonstrations, samples = [], []
    for _ in range(150):
        features = rng.normal(size=(40, 5))
        chances = np.exp(-features @ truth)
        chosen = rng.choice(40, p=chances / chances.sum())
        demonstrations.append(features[chosen])
        samples.append(np.delete(features, chosen, axis=0))
    found = learn(demonstrations, samples, penalty=0.1)
    assert cosine(found.weights, truth) > 0.98
    np.testing.assert_allclose(found.scaled, found.weights * found.scale)


@pytest.mark.parametrize("penalty", [0.0, -1.0, np.nan])
def test_without_a_penalty_there_need_be_no_minimum(penalty: float) -> None:
    with pytest.raises(ConfigError, match="more than 0"):
        learn([np.zeros(3)], [np.ones((4, 3))], penalty)


def test_the_unit_of_a_feature_does_not_matter() -> None:
    rng = np.random.default_rng(1)
    demonstrations = [rng.normal(size=3) - 0.5 for _ in range(30)]
    samples = [rng.normal(size=(20, 3)) for _ in range(30)]
    unit = np.array((1.0, 1000.0, 1e-3))
    one = learn(demonstrations, samples)
    other = learn([d * unit for d in demonstrations], [s * unit for s in samples])
    np.testing.assert_allclose(other.weights * unit, one.weights, rtol=1e-4, atol=1e-6)


def test_what_tells_nothing_gets_no_weight_and_penalties_make_few() -> None:
    rng = np.random.default_rng(2)
    demonstrations = [np.append(rng.normal(size=4) - 0.3, 7.0) for _ in range(40)]
    samples = [np.column_stack((rng.normal(size=(20, 4)), np.full(20, 7.0))) for _ in range(40)]
    weak, strong = (learn(demonstrations, samples, penalty) for penalty in (0.1, 20.0))
    assert weak.weights[4] == 0.0
    assert (strong.weights > 1e-9).sum() < (weak.weights > 1e-9).sum()
    assert (weak.weights >= 0.0).all()


def test_what_does_not_fit_is_refused() -> None:
    with pytest.raises(DataError, match="as many of both"):
        learn([np.zeros(3)], [])
    with pytest.raises(DataError, match=r"demonstration 0 are \(3,\), of its samples \(4, 2\)"):
        learn([np.zeros(3)], [np.zeros((4, 2))])
    with pytest.raises(DataError, match="not finite"):
        learn([np.zeros(3)], [np.full((4, 3), np.nan)])
    assert cosine(np.zeros(3), np.ones(3)) == 0.0


# ---------------------------------------------------------------------- what is drawn
def test_samples_are_as_they_are_said_to_be() -> None:
    drawn = draw_around(path(), 4000, SPREAD, np.random.default_rng(0))
    aside = drawn - path()
    np.testing.assert_array_equal(aside[:, [0, -1]], 0.0)
    assert np.abs(aside.mean(axis=0)).max() < 0.004
    deviation = aside.std(axis=0)
    assert deviation.max(axis=0) == pytest.approx(SPREAD, rel=0.06)
    # Least jerk: the covariance is that of the longest waves of the inverse of R.
    count = len(path()) - 2
    third = np.zeros((count + 3, count))
    for row in range(count):
        third[row : row + 4, row] = (1, -3, 3, -1)
    rough, waves = np.linalg.eigh(third.T @ third)
    assert (1.0 / rough[:WAVES]).sum() > 0.99 * (1.0 / rough).sum()
    wanted = (waves[:, :WAVES] / rough[:WAVES]) @ waves[:, :WAVES].T
    wanted *= 0.05**2 / wanted.diagonal().max()
    np.testing.assert_allclose(np.cov(aside[:, 1:-1, 7].T), wanted, atol=3e-4)


def test_samples_are_smooth() -> None:
    drawn = draw_around(path(), 50, SPREAD, np.random.default_rng(1))
    rough = path() + np.random.default_rng(1).normal(0.0, 0.02, path().shape)
    smoothness = (third_differences(drawn.swapaxes(0, 1)) ** 2).sum(axis=(0, 2))
    assert smoothness.max() < 0.05 * (third_differences(rough) ** 2).sum()


def test_samples_keep_to_the_range_that_was_seen() -> None:
    low, high = path().min(axis=0) - 0.02, path().max(axis=0) + 0.02
    drawn = draw_around(path(), 200, np.full(14, 0.2), np.random.default_rng(2), (low, high))
    assert (drawn >= low - 1e-9).all()
    assert (drawn <= high + 1e-9).all()
    assert np.abs(drawn - path()).max() > 0.01


def test_too_short_movements_are_refused() -> None:
    with pytest.raises(DataError, match="n ≥ 3"):
        draw_around(path()[:2], 3, SPREAD, np.random.default_rng(0))


# ---------------------------------------------------------------------- what it costs
def test_costs_are_nearness_over_time_and_unsmoothness() -> None:
    assert NUMBER == len(COSTS) == 26
    paths = draw_around(path(), 3, SPREAD, np.random.default_rng(3))
    found = path_costs(BODY, paths, partner(), 0.02)
    for row, one in enumerate(paths):
        distances = pair_features(BODY.keypoints(one), partner())
        np.testing.assert_allclose(found[row, :25], 0.02 * np.exp(-distances / 0.2).sum(axis=0))
        padded = np.concatenate((one[:1], one[:1], one[:1], one, one[-1:], one[-1:], one[-1:]))
        assert found[row, 25] == pytest.approx((np.diff(padded, 3, axis=0) ** 2).sum())


def test_a_movement_that_was_cut_is_not_rough_where_it_was_cut() -> None:
    """It goes on as it did: a sudden rest would be rougher than all of it."""
    time = np.linspace(0.0, 1.0, 46)[:, None]
    whole = np.sin(2.0 * time) * np.linspace(0.1, 0.5, 14)
    inner = slice(BEYOND, -BEYOND)
    ends = whole[:BEYOND], whole[-BEYOND:]
    cut = path_costs(BODY, whole[None, inner], partner(40), 0.02, beyond=ends)[0, 25]
    assert cut == pytest.approx((np.diff(whole, 3, axis=0) ** 2).sum())
    assert cut < 0.01 * path_costs(BODY, whole[None, inner], partner(40), 0.02)[0, 25]


def test_movements_of_recordings_know_what_was_beyond() -> None:
    tracks = (
        arm_track([(0.5, 0.8, 0.3), (1.35, 0.8, -0.3)], 3.5),
        arm_track([], 3.5, away=0.6, name="b"),
    )
    found = movements_of(tracks)
    assert len(found) >= 1
    for movement in found:
        assert movement.beyond is not None
        before, after = movement.beyond
        assert before.shape == after.shape == (BEYOND, 14)
        apart = np.abs(np.diff(np.concatenate((before, movement.joints, after)), axis=0)).max()
        assert apart < 0.1


def test_nearer_costs_more() -> None:
    near, far = partner(), partner() + np.array((0.3, 0.0, 0.0))
    one, other = (path_costs(BODY, path()[None], where, 0.02)[0] for where in (near, far))
    assert (one[:25] > other[:25]).all()
    assert one[25] == other[25]


def test_costs_of_what_does_not_fit_are_refused() -> None:
    with pytest.raises(DataError, match="beside"):
        path_costs(BODY, path()[None], partner(39), 0.02)


@given(st.integers(0, 10**6))
@settings(max_examples=10, deadline=None)
def test_the_gradient_of_the_cost_is_that_of_finite_differences(seed: int) -> None:
    rng = np.random.default_rng(seed)
    movement = Movement(BODY, path(12), partner(12), 0.02)
    weights = rng.uniform(0.0, 1.0, NUMBER)
    (at,) = draw_around(movement.joints, 1, SPREAD, rng)
    value, gradient = total_cost(movement, at, weights)
    assert value == pytest.approx(path_costs(BODY, at[None], movement.partner, 0.02)[0] @ weights)

    def inner(values: np.ndarray) -> float:
        changed = at.copy()
        changed[1:-1] = values.reshape(10, 14)
        return float(path_costs(BODY, changed[None], movement.partner, 0.02)[0] @ weights)

    wanted = approx_fprime(at[1:-1].ravel(), inner, 1e-7)
    np.testing.assert_allclose(gradient[1:-1].ravel(), wanted, atol=2e-4)


def test_optimal_movements_cost_less_than_what_is_near_them() -> None:
    weights = np.zeros(NUMBER)
    weights[[24, 8, 25]] = 1.0, 0.5, 20.0
    movement = Movement(BODY, path(), partner(), 0.02)
    found = optimal_movement(movement, weights)
    np.testing.assert_array_equal(found.joints[[0, -1]], movement.joints[[0, -1]])
    least = total_cost(found, found.joints, weights)[0]
    assert least < total_cost(movement, movement.joints, weights)[0]
    around = draw_around(found.joints, 200, 0.2 * SPREAD, np.random.default_rng(0))
    costs = path_costs(BODY, around, found.partner, 0.02) @ weights
    assert (costs > least).mean() > 0.97
