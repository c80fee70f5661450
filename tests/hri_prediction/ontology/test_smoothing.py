"""Keypoints at any instant: against SciPy's filter, and what gaps do."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import savgol_filter

from hri_prediction.ontology.smoothing import SmoothedArm, smoothed_track, wide_enough

STEP = 0.004


def pushed(points: np.ndarray, times: np.ndarray | None = None, half: float = 0.02) -> SmoothedArm:
    arm = SmoothedArm(half, 0.1)
    for row, keypoints in enumerate(points):
        arm.push(float(times[row]) if times is not None else row * STEP, keypoints)
    return arm


def test_regular_samples_are_filtered_as_scipy_does() -> None:
    points = np.random.default_rng(0).normal(size=(60, 4, 3)).cumsum(axis=0)
    wanted = savgol_filter(points, 11, 2, axis=0)  # half of 20 ms: five samples on either side
    arm = pushed(points)
    for row in range(10, 50):
        np.testing.assert_allclose(arm.at(row * STEP), wanted[row], atol=1e-11)


@pytest.mark.parametrize("rate_hz", [60.0, 100.0, 120.0])
def test_slower_sources_are_smoothed_too(rate_hz: float) -> None:
    """Wherever an instant lies between their samples."""
    rng = np.random.default_rng(2)
    times = np.arange(400) / rate_hz
    arm = pushed(rng.normal(0.0, 1.0, (400, 4, 3)), times)
    assert arm.half_s == pytest.approx(2.6 / rate_hz)
    inner = np.arange(0.4, times[-1] - 0.4, 0.02)
    spread = np.std([arm.at(at) for at in inner], axis=0).mean()
    # A straight line between two leaves 0.8 of white noise on average, a parabola through five 0.7 or less.
    assert spread < 0.72
    bent = times[:, None, None] ** 2 * np.ones((4, 3))
    arm = pushed(bent, times)
    for at in inner:
        np.testing.assert_allclose(arm.at(at), at**2, atol=1e-9)


@pytest.mark.parametrize(("rate_hz", "half"), [(250.0, 0.08), (40.0, 0.08), (20.0, 0.13)])
def test_recordings_of_any_rate_are_smoothed(rate_hz: float, half: float) -> None:
    times = np.arange(200) / rate_hz
    assert wide_enough(times, 0.08) == pytest.approx(half)
    noise = np.random.default_rng(1).normal(0.0, 1.0, (200, 4, 3))
    inner = np.arange(1.0, times[-1] - 1.0, 0.02) if rate_hz < 100.0 else times[50:150]
    found = smoothed_track(times, noise, inner, wide_enough(times, 0.08), 0.2)
    assert found.std() < 0.72
    assert wide_enough(times[:1], 0.08) == 0.08


@given(st.integers(0, 10**6))
@settings(max_examples=30)
def test_parabolas_come_out_as_they_are_however_samples_come(seed: int) -> None:
    rng = np.random.default_rng(seed)
    times = np.sort(rng.uniform(0.0, 0.2, 60))
    coefficients = rng.normal(size=(3, 4, 3))
    u = times[:, None, None]
    points = coefficients[0] + coefficients[1] * u + coefficients[2] * u**2
    arm = pushed(points, times)
    at = float(rng.uniform(0.05, 0.15))
    wanted = coefficients[0] + coefficients[1] * at + coefficients[2] * at**2
    # Where few samples are near it is a straight line, which is off by the bend between two of them.
    np.testing.assert_allclose(arm.at(at), wanted, atol=0.01)


def test_short_gaps_are_straight_lines_and_long_ones_gaps() -> None:
    points = np.zeros((100, 4, 3))
    points[:] = np.arange(100.0)[:, None, None] ** 2
    points[40:60] = np.nan  # 84 ms between the neighbours
    points[20:, 3] = np.nan  # the hand tip is never seen again
    arm = pushed(points)
    middle = arm.at(50 * STEP)
    assert middle[0, 0] == pytest.approx(39**2 + (50 - 39) / 21 * (60**2 - 39**2))
    assert np.isfinite(middle[:3]).all()
    assert np.isnan(middle[3]).all()
    points[34:60] = np.nan  # 108 ms
    assert np.isnan(pushed(points).at(50 * STEP)).all()


def test_nothing_is_known_beyond_the_samples() -> None:
    arm = pushed(np.zeros((10, 4, 3)))
    assert np.isnan(arm.at(-0.01)).all()
    assert np.isnan(arm.at(0.05)).all()
    assert arm.newest_s == pytest.approx(0.036)
    arm.forget()
    assert arm.newest_s == -np.inf


def test_old_samples_are_forgotten_and_new_ones_are_not() -> None:
    points = np.random.default_rng(1).normal(size=(3000, 4, 3))
    arm, short = pushed(points), pushed(points[-200:], STEP * np.arange(2800, 3000))
    np.testing.assert_allclose(arm.at(2950 * STEP), short.at(2950 * STEP), atol=1e-12)


def test_without_smoothing_samples_are_what_they_are() -> None:
    points = np.random.default_rng(1).normal(size=(30, 4, 3))
    arm = pushed(points, half=0.0)
    np.testing.assert_allclose(arm.at(7 * STEP), points[7])
    np.testing.assert_allclose(arm.at(7.5 * STEP), 0.5 * (points[7] + points[8]))
