"""Onset and end of reaches, streaming and offline."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hri_prediction.errors import ConfigError, DataError
from hri_prediction.tracks.segmentation import (
    ReachSegmenter,
    SegmentationConfig,
    find_reaches,
    regression_speed,
)


def minimum_jerk(time: np.ndarray, start: float, duration: float, length: float) -> np.ndarray:
    z = np.clip((time - start) / duration, 0.0, 1.0)
    return length * z**3 * (10 - 15 * z + 6 * z**2)


def recording(rate: float, noise: float, seed: int = 0, pause: float = 1.0):
    time = np.arange(0.0, 4.5 + pause, 1.0 / rate)
    x = minimum_jerk(time, 1.0, 1.0, 0.4) - minimum_jerk(time, 2.0 + pause, 1.0, 0.4)
    points = np.column_stack([x, 0.1 * x, 0.0 * x])
    rng = np.random.default_rng(seed)
    return time, points + noise * rng.standard_normal(points.shape)


@pytest.mark.parametrize(("rate", "noise"), [(60, 0.001), (100, 0.001), (250, 0.002), (250, 0.0)])
def test_two_reaches_are_found(rate, noise):
    for seed in range(5):
        reaches = find_reaches(*recording(rate, noise, seed))
        assert len(reaches) == 2
        for reach, onset in zip(reaches, (1.0, 3.0), strict=True):
            # The minimum-jerk speed passes 0.04 m/s some 60 ms after its start.
            assert reach.onset_s == pytest.approx(onset + 0.06, abs=0.06)
            assert reach.end_s == pytest.approx(onset + 0.94, abs=0.06)


def test_there_and_back_without_rest_are_two():
    reaches = find_reaches(*recording(250, 0.002, pause=0.0))
    assert len(reaches) == 2
    assert reaches[0].end_s == pytest.approx(2.0, abs=0.06)
    assert reaches[1].onset_s == pytest.approx(2.0, abs=0.06)


@pytest.mark.parametrize("rate", [60, 250])
def test_rest_with_noise_is_no_reach(rate):
    time = np.arange(0.0, 20.0, 1.0 / rate)
    noise = 0.002 if rate == 250 else 0.001
    points = noise * np.random.default_rng(0).standard_normal((time.size, 3))
    assert find_reaches(time, points) == []


def test_short_twitch_is_no_reach():
    time = np.arange(0.0, 2.0, 0.004)
    x = minimum_jerk(time, 1.0, 0.1, 0.02)
    assert find_reaches(time, np.column_stack([x, x * 0, x * 0])) == []


def test_detection_is_causal_and_prompt():
    time, points = recording(250, 0.002)
    segmenter = ReachSegmenter()
    for t, p in zip(time, points, strict=True):
        event = segmenter.push(t, p)
        if event is not None:
            assert event.kind == "onset"
            assert event.time_s < t < 1.25
            break
    else:
        pytest.fail("no onset")


def test_lost_samples_and_gaps():
    time, points = recording(250, 0.001)
    holes = points.copy()
    holes[::3] = np.nan
    assert len(find_reaches(time, holes)) == 2
    gap = (time > 1.3) & (time < 1.7)
    assert len(find_reaches(time[~gap], points[~gap])) == 1


def test_speed_is_freed_of_noise():
    rng, time = np.random.default_rng(0), np.arange(25) * 0.004
    rest = [regression_speed(time, 0.002 * rng.standard_normal((25, 3))) for _ in range(300)]
    moving = [
        regression_speed(
            time, np.outer(time, [0.3, 0.4, 0.0]) + 0.002 * rng.standard_normal((25, 3))
        )
        for _ in range(300)
    ]
    assert np.sqrt(np.mean(np.square(rest))) < 0.03
    assert np.mean(moving) == pytest.approx(0.5, abs=0.005)
    assert np.isnan(regression_speed(time[:3], np.zeros((3, 3))))


@settings(max_examples=20, deadline=None)
@given(st.floats(-100.0, 100.0), st.floats(0.0, 6.3))
def test_shift_in_time_and_rotation_do_not_matter(shift, angle):
    time, points = recording(100, 0.001)
    c, s = np.cos(angle), np.sin(angle)
    turned = points @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    base = find_reaches(time, points)
    other = find_reaches(time + shift, turned + 3.0)
    assert len(base) == len(other)
    for a, b in zip(base, other, strict=True):
        assert b.onset_s - shift == pytest.approx(a.onset_s, abs=1e-6)


def test_bad_input_is_refused():
    segmenter = ReachSegmenter()
    segmenter.push(1.0, np.zeros(3))
    with pytest.raises(DataError):
        segmenter.push(1.0, np.zeros(3))
    with pytest.raises(DataError):
        find_reaches(np.arange(3.0), np.zeros((2, 3)))
    with pytest.raises(ConfigError):
        SegmentationConfig(on_speed=0.03)
