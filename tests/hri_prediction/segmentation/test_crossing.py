"""Crossings of a low speed, fitted to positions: exact on cubic rises, calmer than the speed itself."""

import numpy as np
import pytest

from hri_prediction.tracks.crossing import rise_crossing, rise_misfit
from hri_prediction.tracks.segmentation import ReachSegmenter, SegmentationConfig

TIMES = np.arange(-0.3, 0.25, 0.004)
JERK = np.array([3.0, -1.0, 2.0])


def rise(start: float, noise: float = 0.0, seed: int = 0) -> np.ndarray:
    points = np.array([0.4, 0.1, 0.2]) + np.maximum(0.0, TIMES - start)[:, None] ** 3 * JERK
    return points + noise * np.random.default_rng(seed).standard_normal(points.shape)


def true_crossing(start: float, speed: float) -> float:
    return start + float(np.sqrt(speed / (3.0 * np.linalg.norm(JERK))))


@pytest.mark.parametrize("start", [-0.02, 0.0, 0.033])
@pytest.mark.parametrize("off", [-0.03, 0.0, 0.03])
def test_a_cubic_rise_is_found_wherever_the_search_begins(start, off):
    truth = true_crossing(start, 0.04)
    found = rise_crossing(TIMES, rise(start), 0.04, truth + off, 0.06)
    assert found == pytest.approx(truth, abs=0.001)


def test_the_misfit_is_that_of_least_squares():
    points = rise(0.01, 0.002)
    misfit, jerk = rise_misfit(TIMES, points, 0.02)
    design = np.stack([np.ones(TIMES.size), np.maximum(0.0, TIMES - 0.02) ** 3], axis=1)
    solution, rest, *_ = np.linalg.lstsq(design, points, rcond=None)
    assert misfit == pytest.approx(rest.sum(), rel=1e-9)
    assert jerk == pytest.approx(np.linalg.norm(solution[1]), rel=1e-9)


def test_noise_moves_it_by_milliseconds():
    truth = true_crossing(0.0, 0.04)
    errors = [
        rise_crossing(TIMES, rise(0.0, 0.002, seed), 0.04, truth + 0.02, 0.06) - truth
        for seed in range(60)
    ]
    assert abs(np.mean(errors)) < 0.004
    assert np.std(errors) < 0.012


def test_rest_alone_leaves_the_crossing_where_it_was():
    still = np.tile([0.4, 0.1, 0.2], (TIMES.size, 1))
    assert rise_crossing(TIMES, still, 0.04, 0.05, 0.06) == 0.05


def test_a_motion_that_was_never_at_rest_leaves_it_too():
    """It began before the first sample: how the cubic begins cannot be seen."""
    assert rise_crossing(TIMES, rise(-10.0), 0.04, 0.05, 0.06) == 0.05


@pytest.mark.parametrize("count", [1, 5, 7])
def test_few_samples_leave_it_too(count):
    around = np.abs(TIMES).argsort()[:count]
    times, points = np.sort(TIMES[around]), rise(0.0)[np.sort(around)]
    assert rise_crossing(times, points, 0.04, 0.005, 0.06) == 0.005


@pytest.mark.parametrize("off", [-0.08, 0.08])
def test_what_lies_out_of_reach_is_not_taken(off):
    near = true_crossing(0.0, 0.04) + off
    assert rise_crossing(TIMES, rise(0.0), 0.04, near, 0.06) == near


def test_onsets_scatter_less_than_crossings_of_the_speed():
    config = SegmentationConfig()
    fitted, raw = [], []
    tau = np.clip(np.arange(-0.5, 0.6, 0.004), 0.0, 1.0)
    path = 0.35 * tau**3 * (10.0 - 15.0 * tau + 6.0 * tau**2)
    for seed in range(40):
        rng = np.random.default_rng(seed)
        points = np.zeros((tau.size, 3))
        points[:, 0] = path
        points += 0.002 * rng.standard_normal(points.shape)
        segmenter = ReachSegmenter(config)
        for time_s, point in zip(np.arange(-0.5, 0.6, 0.004), points, strict=True):
            before = segmenter._speeds.copy()
            event = segmenter.push(float(time_s), point)
            if event is not None:
                fitted.append(event.time_s)
                level = [t for t, v in before if v < config.onset_speed]
                raw.append(level[-1])
                break
    assert len(fitted) == 40
    assert np.std(fitted) < 0.6 * np.std(raw)
