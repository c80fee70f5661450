"""What is told of a reach before it begins: moments over unknown timing, and whether errors are as said."""

from __future__ import annotations

import numpy as np
import pytest

from hri_sim.benchmark.conditions import task_conditions
from hri_sim.benchmark.learning import task_library
from hri_sim.benchmark.prior import PriorObserver, slow_s, unknown_timing
from hri_sim.benchmark.watching import Watch
from hri_sim.scenario.conditions import DELAY_S

WRIST = 2


def test_moments_are_those_of_drawn_onsets_and_durations():
    (task,) = task_library("tuning", 0).tasks
    rng = np.random.default_rng(1)
    onsets = rng.uniform(*DELAY_S, size=4000)
    durations = task.duration_mean_s * np.exp(task.duration_log_sd * rng.normal(size=4000))
    times = np.array([0.0, 0.2, 0.7, 1.2, 1.6, 3.0])
    mean, covariance = unknown_timing(task.promp, task, times, 0.0)
    for time, said, spread in zip(times, mean, covariance, strict=True):
        phases = np.clip((time - onsets) / durations, 0.0, 1.0)
        means = task.promp.trajectory_mean(phases)
        both = task.promp.trajectory_covariance(phases).mean(axis=0) + np.cov(means.T)
        np.testing.assert_allclose(said.ravel(), means.mean(axis=0), atol=4e-3)
        for point, own in enumerate((both[:3, :3], both[3:, 3:])):
            largest = np.linalg.eigvalsh(spread[point])[-1]
            assert np.sqrt(largest) == pytest.approx(np.sqrt(np.linalg.eigvalsh(own)[-1]), rel=0.08)


def test_slow_parts_are_those_of_a_minimum_jerk_motion():
    length, whole, speed = 0.35, 1.3, 0.04
    share = np.linspace(0.0, 1.0, 200_001)
    fast = 30.0 * length / whole * (share * (1.0 - share)) ** 2 > speed
    seen = np.array([fast.mean() * whole])
    (found,) = slow_s(length, seen, speed)
    assert found == pytest.approx(0.5 * (whole - seen[0]), abs=1e-4)
    assert slow_s(length, seen, 0.0) == pytest.approx(0.0)
    assert np.isfinite(slow_s(0.0, seen, speed)).all()


def test_errors_are_as_large_as_said_at_every_time():
    times = np.arange(0.1, 2.4, 0.1)
    squares, said = [], []
    for number in (0, 1, 2, 3, 5, 6, 7, 8):
        library = task_library("tuning", number)
        for condition in task_conditions("tuning", number).conditions[:6]:
            person = condition.person()
            observer = PriorObserver(library)
            watch = Watch(person, observer, np.random.default_rng(number))
            watch.advance(0.0)
            (forecast,) = watch.known(1)
            points, sigma = forecast.sample(times)
            squares.append(((points[0] - person.truth(times))[:, WRIST] ** 2).sum(axis=1))
            said.append(sigma[0, :, WRIST] ** 2)
    ratio = np.sqrt(np.mean(squares, axis=0) / np.mean(said, axis=0))
    # Sigma is of the widest direction: an error of one in that alone is 1, in all three sqrt(3).
    assert (ratio > 0.7).all(), ratio
    assert (ratio < 1.75).all(), ratio
