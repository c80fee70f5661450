"""Inverse optimal control: weights found again, against a search without derivatives; how surely; a law."""

from dataclasses import replace

import numpy as np
import pytest
from drawn import observed, problem
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from hri_prediction.errors import ConfigError, DataError
from hri_prediction.geometry.warping import warped_distance, warping_path
from hri_prediction.motor_control import ioc
from hri_prediction.motor_control.costs import CHAPTER_2, CHAPTER_3, shares
from hri_prediction.motor_control.ioc import explain, simplex_step
from hri_prediction.motor_control.law import WeightLaw, explained, fit_law, mean_postures
from hri_prediction.motor_control.observed import ObservedReach
from hri_prediction.motor_control.ocp import Motion, NotConverged, ReachSolver
from hri_prediction.motor_control.problem import ReachProblem
from hri_prediction.motor_control.search import search
from hri_prediction.motor_control.uncertainty import certainty


@pytest.mark.parametrize(
    "start",
    [[0.5, 0.6, 0.0, 0.0], [1.5, -0.5, 0.0, 0.0], [0.5, np.nan, 0.25, 0.25], [1.0], [0.0] * 4],
)
def test_starts_off_the_simplex_are_refused(solver, start):
    with pytest.raises(DataError, match="alpha"):
        explain(solver, observed(solver, problem(0), np.full(4, 0.25)), start=start)


@pytest.mark.parametrize("names", [CHAPTER_2, CHAPTER_3])
def test_weights_are_found_again(solver, rng, names):
    for number in (0, 17, 44, 80):
        alpha = (
            0.05 + 0.95 * rng.dirichlet(np.full(len(names), 3.0)) * (1.0 - 0.05 * len(names)) / 0.95
        )
        alpha /= alpha.sum()
        found = explain(solver, observed(solver, problem(number), alpha, names), names)
        np.testing.assert_allclose(found.alpha, alpha, atol=1e-3)
        assert found.solves <= 25
        assert found.distance_m < 1e-5
        assert (found.distance_m <= found.single_m).all()


def test_expected_weights_that_have_no_optimum_are_no_end(solver, monkeypatch):
    alpha, start = np.array([0.3, 0.4, 0.1, 0.2]), np.array([0.1, 0.2, 0.3, 0.4])
    tried = ioc._Search.tried

    def fails(self, at, *more):
        return None if np.array_equal(at, start) else tried(self, at, *more)

    monkeypatch.setattr(ioc._Search, "tried", fails)
    found = explain(solver, observed(solver, problem(30), alpha), start=start)
    np.testing.assert_allclose(found.alpha, alpha, atol=1e-3)


def test_one_cost_alone_is_recognised(solver):
    for index in range(4):
        alpha = np.eye(4)[index]
        found = explain(solver, observed(solver, problem(30), alpha))
        assert found.alpha[index] > 0.99


@pytest.mark.parametrize("name", ["hand_jerk", "joint_jerk", "energy"])
def test_one_cost_has_all_of_the_weight(solver, name):
    """Whatever the reach: it need not be its optimum."""
    seen = observed(solver, problem(5), np.array([0.3, 0.4, 0.1, 0.2]))
    found = explain(solver, seen, (name,))
    np.testing.assert_array_equal(found.alpha, [1.0])
    assert np.isfinite(found.distance_m)


def test_what_is_found_is_no_farther_than_what_a_search_finds(solver, rng):
    seen = observed(solver, problem(12), np.array([0.5, 0.25, 0.1, 0.15]))
    noisy = ObservedReach(
        seen.problem, seen.phases, seen.angles, seen.hand + rng.normal(0.0, 0.001, seen.hand.shape)
    )
    ours, theirs = explain(solver, noisy), search(solver, noisy, radii=(0.3,), evaluations=60)
    assert ours.distance_m <= theirs.distance_m * 1.002
    assert theirs.solves > 40 > ours.solves
    assert theirs.alpha.sum() == pytest.approx(1.0)
    with pytest.raises(ConfigError, match="joint_jerk"):
        search(solver, noisy, ("hand_jerk", "energy"))


def test_certainty_is_the_spread_of_repetitions(solver, rng):
    truth = np.array([0.35, 0.3, 0.15, 0.2])
    seen = observed(solver, problem(6), truth)
    found, sds = [], []
    for _ in range(25):
        noisy = ObservedReach(
            seen.problem,
            seen.phases,
            seen.angles,
            seen.hand + rng.normal(0.0, 3e-4, seen.hand.shape),
        )
        one = explain(solver, noisy, start=truth)
        sure = certainty(one, noisy)
        found.append(one.alpha)
        sds.append(sure.sd)
        assert sure.noise_m == pytest.approx(3e-4, rel=0.15)
    spread, told = np.std(found, axis=0), np.mean(sds, axis=0)
    assert (spread < 2.0 * told).all()
    assert (told < 2.5 * spread).all()
    np.testing.assert_allclose(sure.covariance.sum(axis=0), 0.0, atol=1e-12)  # the sum is known
    assert (np.diff(sure.axes_m) <= 0.0).all()


def test_nothing_is_known_of_what_does_not_show(solver):
    seen = observed(solver, problem(6), np.array([0.0, 1.0, 0.0, 0.0]))
    sure = certainty(explain(solver, seen), seen)
    assert (sure.sd <= 1.0).all()


def test_a_weight_that_is_found_to_be_0_may_be_more(solver, rng):
    """Where the true one is small it often comes out as 0: how far off that is, is told all the same."""
    truth = np.array([0.48, 0.5, 0.01, 0.01])
    seen = observed(solver, problem(6), truth)
    off, told = [], []
    for _ in range(25):
        noisy = replace(seen, hand=seen.hand + rng.normal(0.0, 3e-3, seen.hand.shape))
        one = explain(solver, noisy, start=truth)
        sure = certainty(one, noisy)
        at_bound = one.alpha < 1e-6
        np.testing.assert_allclose(sure.covariance.sum(axis=0), 0.0, atol=1e-9)
        assert (sure.sd > 0.0).all()
        off += (truth - one.alpha)[at_bound].tolist()
        told += sure.sd[at_bound].tolist()
    assert len(off) >= 10
    assert np.mean(np.array(off) < 2.0 * np.array(told)) > 0.9


def test_a_tiny_weight_that_has_to_give_way_is_in_nobodys_way(solver):
    """It gets to 0 at once, and the one that rises goes on at the cost of the others."""
    seen = observed(solver, problem(6), np.array([0.6, 0.4, 0.0, 0.0]))
    one = explain(solver, seen)
    slopes = one.jacobian.copy()
    slopes[..., 3] = slopes[..., 2] + 0.01 * (slopes[..., 0] - slopes[..., 1])
    rises = []
    for tiny in (0.0, 1e-5, 1e-4):
        alpha = np.array([0.6, 0.4 - tiny, tiny, 0.0])
        changed = replace(one, alpha=alpha, jacobian=slopes, path=seen.hand)
        rises.append(certainty(changed, seen, noise_m=1e-3).sd[3])
    assert rises[0] > 1e-3
    np.testing.assert_allclose(rises, rises[0], rtol=0.1)


def test_no_more_is_given_to_a_weight_than_others_have(solver):
    """At a corner of the simplex, too: what the others may be is what the one has less."""
    seen = observed(solver, problem(6), np.array([0.0, 1.0, 0.0, 0.0]))
    found = explain(solver, seen)
    sure = certainty(found, seen, noise_m=10.0)
    assert (sure.sd <= 1.0).all()
    assert sure.sd[found.alpha < 1e-6].min() > 0.1  # next to so much noise nothing is known


@given(
    st.integers(2, 6).flatmap(
        lambda n: st.tuples(
            arrays(float, n, elements=st.floats(0.01, 1.0)),
            arrays(float, (5, 3, n), elements=st.floats(-1.0, 1.0)),
            arrays(float, (5, 3), elements=st.floats(-1.0, 1.0)),
            arrays(float, 5, elements=st.floats(0.1, 10.0)),
        )
    ),
    st.sampled_from([0.0, 1e-3, 1.0]),
)
@settings(max_examples=100, deadline=None)
def test_steps_stay_on_the_simplex_and_do_not_make_the_model_worse(drawn, damping):
    weights, slopes, wanted, counted = drawn
    alpha = weights / weights.sum()
    found = simplex_step(alpha, slopes, wanted, counted, damping)
    assert (found >= 0.0).all()
    assert found.sum() == pytest.approx(1.0)

    def model(at):
        left = slopes @ (at - alpha) - wanted
        return float((counted[:, None] * left**2).sum())

    assert model(found) <= model(alpha) * (1.0 + 1e-6) + 1e-6


def test_a_law_is_fitted_to_all_paths_at_once(solver, rng):
    theta = np.zeros((3, 7))
    theta[:, 0] = (-0.3, -1.0, -0.6)
    theta[:, 1:] = rng.normal(0.0, 0.5, (3, 6))
    law = WeightLaw(CHAPTER_2, theta)
    reaches, truth = [], []
    for number in range(0, 81, 3):
        task = problem(number)
        alpha = law.alpha(task.q_start, task.q_end)
        reaches.append(observed(solver, task, alpha))
        truth.append(alpha)
    steps = []
    fitted = fit_law(lambda _: solver, reaches, progress=lambda done, of: steps.append((done, of)))
    found = [fitted.law.alpha(each.problem.q_start, each.problem.q_end) for each in reaches]
    assert explained(truth, found) > 0.99
    assert fitted.rms_m < 1e-4
    assert steps[-1][0] == steps[-1][1]
    np.testing.assert_allclose(
        shares(truth[0], CHAPTER_2, ("hand_jerk", "energy")), truth[0][0] + truth[0][3]
    )


class Fails:
    """A solver of an arm that nothing is an optimum for, from some call on."""

    def __init__(self, solver: ReachSolver, after: int) -> None:
        self._solver, self._left, self.arm = solver, after, solver.arm

    def solve(self, reach: ReachProblem, weights: np.ndarray, *start: object) -> Motion:
        motion = self._solver.solve(reach, weights, *start)
        self._left -= 1
        if self._left < 0:
            raise NotConverged(reach, weights, motion, 1.0)
        return motion


@pytest.mark.parametrize("after", [0, 3], ids=["no scale factors", "no optimum to begin with"])
def test_a_reach_without_an_optimum_costs_nobody_their_law(solver, after):
    law = WeightLaw(CHAPTER_2, np.full((3, 7), -0.2))
    tasks = [problem(number) for number in range(0, 81, 9)]
    reaches = [observed(solver, each, law.alpha(each.q_start, each.q_end)) for each in tasks]
    broken = Fails(solver, after)
    fitted = fit_law(lambda each: broken if each is reaches[4] else solver, reaches)
    assert fitted.left_out == (4,)
    others = fit_law(lambda _: solver, [*reaches[:4], *reaches[5:]])
    assert others.left_out == ()
    np.testing.assert_allclose(fitted.law.theta, others.law.theta, atol=1e-9)
    with pytest.raises(NotConverged):
        fit_law(lambda _: Fails(solver, after), reaches[:2])


class Stays:
    """A solver of an arm that finds an optimum of what it was first asked with a law, and of nothing else.

    Scale factors take as many calls as there are costs that they are taken from.
    """

    def __init__(self, solver: ReachSolver) -> None:
        self._solver, self.arm = solver, solver.arm
        self._known: list[np.ndarray] = []

    def solve(self, reach: ReachProblem, weights: np.ndarray, *start: object) -> Motion:
        motion = self._solver.solve(reach, weights, *start)
        if len(self._known) < 4:
            self._known.append(weights)
        if not any(np.array_equal(weights, each) for each in self._known):
            raise NotConverged(reach, weights, motion, 1.0)
        return motion

    def path_derivatives(self, *arguments: object) -> object:
        return self._solver.path_derivatives(*arguments)


def test_a_reach_that_no_step_suits_does_not_hold_the_others(solver):
    law = WeightLaw(CHAPTER_2, np.full((3, 7), -0.2))
    tasks = [problem(number) for number in range(0, 81, 9)]
    reaches = [observed(solver, each, law.alpha(each.q_start, each.q_end)) for each in tasks]
    stays = Stays(solver)
    fitted = fit_law(lambda each: stays if each is reaches[4] else solver, reaches)
    assert fitted.left_out == (4,)
    assert fitted.converged
    others = fit_law(lambda _: solver, [*reaches[:4], *reaches[5:]])
    assert fitted.rms_m < 1e-4
    for each in tasks:
        at = each.q_start, each.q_end
        np.testing.assert_allclose(fitted.law.alpha(*at), others.law.alpha(*at), atol=1e-3)
    with pytest.raises(NotConverged):
        fit_law(lambda _: Stays(solver), reaches[:3])
    assert not fit_law(lambda _: solver, reaches, steps=1).converged


def test_repetitions_share_their_weights_but_not_their_ends(solver, rng):
    """Beside a law of each reach by itself, whose postures are not those that weights hang on."""
    theta = np.zeros((3, 7))
    theta[:, 0] = (-0.3, -1.0, -0.6)
    theta[:, 1:] = rng.normal(0.0, 0.5, (3, 6))
    law = WeightLaw(CHAPTER_2, theta)
    reaches, which, truth = [], [], []
    for number in range(0, 81, 4):
        task = problem(number)
        alpha = law.alpha(task.q_start, task.q_end)
        for sign in (-1.0, 0.0, 1.0):
            moved = sign * rng.normal(0.0, np.radians(4.0), (2, 3))
            again = ReachProblem.at_rest(
                task.q_start + moved[0], task.q_end + moved[1], task.duration * (1.0 + 0.1 * sign)
            )
            reaches.append(observed(solver, again, alpha))
            which.append(f"task {number}")
            truth.append(alpha)

    def share(alike):
        fitted = fit_law(lambda _: solver, reaches, alike=alike)
        ends = mean_postures(reaches, alike or range(len(reaches)))
        return explained(truth, [fitted.law.alpha(*each) for each in ends])

    shared, apart = share(which), share(())
    print(f"explained {shared:.4f} with repetitions, {apart:.4f} without")
    assert shared > 0.95
    assert shared > apart
    with pytest.raises(DataError, match="2 names of"):
        fit_law(lambda _: solver, reaches, alike=["a", "b"])
    with pytest.raises(ConfigError, match="0 steps"):
        fit_law(lambda _: solver, reaches, steps=0)


def test_slopes_of_a_law_match_finite_differences(rng):
    law = WeightLaw(CHAPTER_2, rng.normal(0.0, 0.5, (3, 7)))
    start, end, step = rng.normal(size=3), rng.normal(size=3), 1e-6
    slopes = law.slopes(start, end)
    for i in range(3):
        for j in range(7):
            moved = np.zeros((3, 7))
            moved[i, j] = step
            ahead, behind = (
                WeightLaw(CHAPTER_2, law.theta + s * moved).alpha(start, end) for s in (1.0, -1.0)
            )
            np.testing.assert_allclose(slopes[:, i, j], (ahead - behind) / (2 * step), atol=1e-8)


def test_laws_that_cannot_be_are_refused(solver):
    with pytest.raises(ConfigError, match="joint_jerk"):
        WeightLaw(("hand_jerk", "energy"), np.zeros((1, 7)))
    with pytest.raises(DataError, match="theta"):
        WeightLaw(CHAPTER_2, np.zeros((2, 7)))
    with pytest.raises(DataError, match="no reaches"):
        fit_law(lambda _: solver, [])


@given(st.integers(0, 10_000), st.integers(2, 30), st.integers(2, 30))
@settings(max_examples=40, deadline=None)
def test_warping_paths_are_what_their_distance_says(seed, n, m):
    rng = np.random.default_rng(seed)
    first, second = rng.normal(size=(n, 3)), rng.normal(size=(m, 3))
    total, pairs = warping_path(first, second)
    assert total == pytest.approx(warped_distance(first, second), rel=1e-12)
    assert total == pytest.approx(
        np.linalg.norm(first[pairs[:, 0]] - second[pairs[:, 1]], axis=1).sum()
    )
    assert pairs[0].tolist() == [0, 0]
    assert pairs[-1].tolist() == [n - 1, m - 1]
    steps = np.diff(pairs, axis=0)
    assert ((steps >= 0) & (steps <= 1)).all()
    assert warped_distance(first, first) == 0.0
    assert (
        total
        <= np.linalg.norm(first[0] - second, axis=1).sum()
        + np.linalg.norm(first - second[-1], axis=1).sum()
    )


def test_reaches_that_were_not_seen_are_refused():
    task = problem(0)
    ten, three = np.linspace(0.0, 1.0, 10), np.zeros((10, 3))
    with pytest.raises(DataError, match="10 or more"):
        ObservedReach(task, ten[:5], three[:5], three[:5])
    with pytest.raises(DataError, match="not finite"):
        ObservedReach(task, ten, three, np.full((10, 3), np.nan))
    with pytest.raises(DataError, match="increasing"):
        ObservedReach(task, ten[::-1], three, three)


@pytest.mark.parametrize(
    ("first", "second"),
    [
        (np.zeros((0, 3)), np.zeros((2, 3))),
        (np.zeros((2, 3)), np.zeros((2, 2))),
        (np.zeros(3), np.zeros((2, 3))),
        (np.full((2, 3), np.nan), np.zeros((2, 3))),
    ],
)
def test_paths_that_cannot_be_compared_are_refused(first, second):
    for compare in (warped_distance, warping_path):
        with pytest.raises(DataError):
            compare(first, second)


def test_a_cost_alone_without_optimum_leaves_the_mix_explained(solver, monkeypatch):
    seen = observed(solver, problem(3), np.array([0.3, 0.3, 0.1, 0.3]))
    plain = ReachSolver.solve

    def solve(self, task, weights, start=None):
        if np.count_nonzero(weights) == 1 and weights[5] > 0.0:
            motion = plain(self, task, np.eye(7)[2])
            raise NotConverged(task, np.asarray(weights), motion, 1.0)
        return plain(self, task, weights, start)

    monkeypatch.setattr(ReachSolver, "solve", solve)
    found = explain(solver, seen)
    assert found.single_m[3] == np.inf
    assert found.single_motions[3] is None
    np.testing.assert_allclose(found.alpha, [0.3, 0.3, 0.1, 0.3], atol=1e-3)


def test_weights_that_are_all_the_same_have_no_variance():
    with pytest.raises(DataError, match="variance"):
        explained([[0.5, 0.5]], [[0.4, 0.6]])
