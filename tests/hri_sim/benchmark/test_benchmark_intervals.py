"""Intervals: of as many trials as tasks make, also near all and none, and of few tasks."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats

from hri_sim.benchmark.intervals import (
    mean_interval,
    mean_of,
    share_difference_interval,
    share_interval,
)

ALIKE = 0.1
"""Correlation of motions of a task."""


def drawn(rng: np.random.Generator, tasks: int, share: float, quantiles=None) -> np.ndarray:
    """Successes of 15 motions of each task, whose chances are beta-distributed."""
    size = (1.0 - ALIKE) / ALIKE
    quantiles = rng.random(tasks) if quantiles is None else quantiles
    chances = stats.beta.ppf(quantiles, share * size, (1.0 - share) * size)
    return np.stack([rng.binomial(15, chances), np.full(tasks, 15)], axis=1).astype(float)


def test_intervals_count_tasks_not_motions():
    """Tasks that all succeed or all fail: the error of a share of 30 draws, not of 450."""
    good = np.random.default_rng(1).random(30) < 0.8
    sums = np.stack([15.0 * good, np.full(30, 15.0)], axis=1)
    share = mean_of(sums)
    low, high = share_interval(sums)
    assert low < share < high
    assert high - low == pytest.approx(2 * 2.1 * math.sqrt(share * (1.0 - share) / 30), rel=0.15)
    assert share_interval(10.0 * sums) == pytest.approx([low, high])


@pytest.mark.parametrize("tasks", [30, 6])
@pytest.mark.parametrize("share", [0.8, 0.97, 0.99])
def test_intervals_of_shares_cover_the_truth(tasks, share):
    rng = np.random.default_rng(2)
    spans = [share_interval(drawn(rng, tasks, share)) for _ in range(200)]
    assert np.mean([low <= share <= high for low, high in spans]) >= 0.91


@pytest.mark.parametrize("tasks", [30, 6])
def test_intervals_of_differences_cover_the_truth(tasks):
    """Also where tasks that are hard for one planner are hard for the other."""
    rng = np.random.default_rng(3)
    covered = []
    for _ in range(200):
        common = rng.normal(size=tasks)
        own = 0.7 * common + math.sqrt(1.0 - 0.49) * rng.normal(size=tasks)
        ours = drawn(rng, tasks, 0.99, stats.norm.cdf(common))
        theirs = drawn(rng, tasks, 0.9, stats.norm.cdf(own))
        low, high = share_difference_interval(ours, theirs)
        covered.append(low <= 0.09 <= high)
    assert np.mean(covered) >= 0.91


def test_intervals_of_means_cover_the_truth():
    rng = np.random.default_rng(4)
    covered = []
    for _ in range(100):
        means = rng.normal(2.0, 0.3, 6)
        low, high = mean_interval(np.stack([15.0 * means, np.full(6, 15.0)], axis=1))
        covered.append(low <= 2.0 <= high)
    assert np.mean(covered) >= 0.88


def test_all_and_none_are_not_certain():
    everything = np.full((30, 2), 75.0)
    low, high = share_interval(everything)
    assert (low, high) == (pytest.approx(0.025 ** (1 / 30)), 1.0)
    nothing = everything * [0.0, 1.0]
    assert share_interval(nothing) == pytest.approx([0.0, 1.0 - low])
    assert share_difference_interval(everything, nothing)[0] == pytest.approx(
        1.0 - math.sqrt(2.0) * (1.0 - low)
    )
    same = share_difference_interval(everything, everything)
    assert same == pytest.approx([low - 1.0, 1.0 - low])


def test_one_task_says_nothing():
    one = np.array([[3.0, 4.0], [0.0, 0.0]])
    assert share_interval(one) == [0.0, 1.0]
    assert mean_interval(one) is None


def test_a_bootstrap_of_few_tasks_would_only_be_their_range():
    assert mean_interval(np.tile([3.0, 4.0], (4, 1))) is None
    assert mean_interval(np.tile([3.0, 4.0], (5, 1))) == [0.75, 0.75]
