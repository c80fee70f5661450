"""Measures of motions, on motions whose measure is known."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hri_planner.rnn.metrics.correlation import correlations
from hri_planner.rnn.metrics.reaching import reach_steps, reaching
from hri_planner.rnn.metrics.warping import distances, likeness
from hri_prediction.geometry.warping import warped_distance

GOAL = np.zeros(3)


def approaching(*away: float) -> np.ndarray:
    """A path on the x axis with these distances to the goal [m]."""
    return np.array([(value, 0.0, 0.0) for value in away])


def test_a_goal_that_is_left_again_is_reached_only_later() -> None:
    paths = np.stack((
        approaching(0.2, 0.02, 0.1, 0.02, 0.01),
        approaching(0.2, 0.1, 0.02, 0.01, 0.0),
        approaching(0.2, 0.01, 0.0, 0.01, 0.05),
        approaching(0.02, 0.01, 0.0, 0.0, 0.0),
    ))  # fmt: skip
    np.testing.assert_array_equal(reach_steps(paths, np.zeros((4, 3))), [3.0, 2.0, np.nan, 0.0])


def test_measures_of_reaching() -> None:
    paths = np.stack((approaching(0.2, 0.1, 0.002), approaching(0.2, 0.1, 0.08)))
    found = reaching(paths, np.zeros((2, 3)), [1.0, 1.0], 0.5)
    assert found.reached_share == 0.5
    assert found.reach_time_mse == pytest.approx(0.25)
    assert found.terminal_reached == pytest.approx(0.002)
    assert found.terminal_all == pytest.approx(0.041)
    assert found.terminal_max == pytest.approx(0.08)
    nobody = reaching(paths[1:], np.zeros((1, 3)), [1.0], 0.5)
    assert np.isnan(nobody.reach_time_mse)
    assert np.isnan(nobody.terminal_reached)


def slow_warping(first: np.ndarray, second: np.ndarray) -> float:
    """By the definition."""
    table = np.full((len(first) + 1, len(second) + 1), np.inf)
    table[0, 0] = 0.0
    for i in range(1, len(first) + 1):
        for j in range(1, len(second) + 1):
            step = min(table[i - 1, j], table[i, j - 1], table[i - 1, j - 1])
            table[i, j] = np.linalg.norm(first[i - 1] - second[j - 1]) + step
    return float(table[-1, -1])


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), n=st.integers(1, 12), m=st.integers(1, 12))
def test_warping_is_the_sum_along_the_cheapest_way(seed: int, n: int, m: int) -> None:
    rng = np.random.default_rng(seed)
    first, second = rng.normal(size=(n, 3)), rng.normal(size=(m, 3))
    found = warped_distance(first, second)
    assert found == pytest.approx(slow_warping(first, second))
    assert found == pytest.approx(warped_distance(second, first))
    assert warped_distance(first, first) == 0.0
    assert warped_distance(np.repeat(first, 2, axis=0), first) == pytest.approx(0.0)


def test_paths_that_are_all_alike_are_near_but_cover_little() -> None:
    human = [approaching(0.3, 0.1, place) for place in (0.0, 0.02, 0.04, 0.06)]
    alike, true = [human[1]] * 4, human
    assert likeness(true, human).paired == 0.0
    assert likeness(true, human).coverage == 1.0
    found = likeness(alike, human)
    assert found.sample == 0.0
    assert found.paired > 0.0
    assert found.coverage == 0.25
    assert distances(alike, human).shape == (4, 4)


def test_correlations_are_normalised() -> None:
    time = np.linspace(0.0, 6.0, 200)
    states = np.stack((np.sin(time), -3.0 * np.sin(time), np.zeros(200)), axis=1)
    found = correlations(states, np.stack((2.0 * np.sin(time), np.zeros(200)), axis=1))
    assert found == pytest.approx(np.array(((1.0, 0.0), (-1.0, 0.0), (0.0, 0.0))))
