"""Updates count trials by their costs, whatever their scale."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from hri_planner.pibb.exploration import exploration
from hri_planner.pibb.update import improved, probabilities
from hri_prediction.errors import DataError

# Differences that are neither lost beside an offset nor next to nothing.
costs_of_trials = st.lists(st.integers(-1000, 1000), min_size=1, max_size=12).map(
    lambda values: 0.01 * np.array(values)
)
greeds = st.floats(0.0, 20.0)


@settings(max_examples=200, deadline=None)
@given(costs=costs_of_trials, greed=greeds)
def test_better_trials_are_more_probable(costs, greed) -> None:
    found = probabilities(costs, greed)
    assert found.sum() == pytest.approx(1.0)
    assert (found > 0.0).all()
    order = np.argsort(costs, kind="stable")
    assert (np.diff(found[order]) <= 1e-15).all()
    for one, other in itertools.pairwise(order):
        if costs[one] == costs[other]:
            assert found[one] == found[other]
    spread = costs.max() - costs.min()
    if spread > 0.0:
        wanted = np.exp(-greed * (costs - costs.min()) / spread)
        np.testing.assert_allclose(found, wanted / wanted.sum(), rtol=1e-9)
        assert found.max() / found.min() == pytest.approx(np.exp(greed))


@settings(max_examples=200, deadline=None)
@given(costs=costs_of_trials, greed=greeds, shift=st.floats(-1e3, 1e3), scale=st.floats(1e-3, 1e3))
def test_neither_zero_nor_unit_of_costs_matter(costs, greed, shift, scale) -> None:
    wanted = probabilities(costs, greed)
    np.testing.assert_allclose(probabilities(scale * costs + shift, greed), wanted, atol=1e-6)


@pytest.mark.parametrize("count", [1, 2, 7])
def test_equal_costs_count_the_same(count: int) -> None:
    np.testing.assert_allclose(probabilities([3.0] * count, 8.0), 1.0 / count)
    np.testing.assert_allclose(probabilities(np.arange(count), 0.0), 1.0 / count)


@pytest.mark.parametrize(
    "costs", [[], [np.nan], [1.0, np.inf], [1.0, -np.inf, 2.0], [[1.0, 2.0]], 3.0]
)
def test_costs_that_are_none_are_refused(costs: object) -> None:
    with pytest.raises(DataError, match="expected finite numbers"):
        probabilities(costs, 8.0)
    with pytest.raises(DataError, match="expected finite numbers"):
        improved(np.zeros((3, 20)), np.zeros((2, 3, 20)), costs, 8.0)


def test_changes_that_do_not_fit_are_refused() -> None:
    for shape in ((3, 3, 20), (2, 3, 10), (2, 20)):
        with pytest.raises(DataError, match=r"expected \(2, 3, 20\)"):
            improved(np.zeros((3, 20)), np.zeros(shape), [1.0, 2.0], 8.0)


@settings(max_examples=100, deadline=None)
@given(changes=arrays(float, (4, 3, 5), elements=st.floats(-1.0, 1.0)), greed=greeds,
       costs=arrays(float, 4, elements=st.floats(0.0, 10.0)))  # fmt: skip
def test_weights_stay_among_their_samples(changes, costs, greed) -> None:
    weights = np.ones((3, 5))
    found = improved(weights, changes, costs, greed) - weights
    assert (found <= changes.max(axis=0) + 1e-9).all()
    assert (found >= changes.min(axis=0) - 1e-9).all()
    np.testing.assert_allclose(
        found, np.einsum("k,kij->ij", probabilities(costs, greed), changes), atol=1e-12
    )
    np.testing.assert_array_equal(weights, np.ones((3, 5)))


def test_the_best_counts_alone_when_greed_is_large() -> None:
    changes = np.random.default_rng(0).standard_normal((3, 3, 20))
    found = improved(np.zeros((3, 20)), changes, [2.0, 1.0, 1.9], 100.0)
    np.testing.assert_allclose(found, changes[1], atol=1e-9)


@pytest.mark.parametrize("samples", [6, 10])
def test_a_quadratic_is_learnt(samples: int) -> None:
    """Towards weights that samples can make; the distance falls to a third in 60 updates."""
    for seed in range(5):
        rng = np.random.default_rng(seed)
        goal, weights = exploration(rng, 1, 20, 0.1)[0], np.zeros((3, 20))
        begun = np.sum(goal**2)
        for update in range(60):
            changes = exploration(rng, samples, 20, 0.05 * 0.95**update)
            changes[0] = 0.0
            costs = np.sum((weights + changes - goal) ** 2, axis=(1, 2))
            weights = improved(weights, changes, costs, 8.0)
        assert np.sum((weights - goal) ** 2) < begun / 9.0
