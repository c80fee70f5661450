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


@pytest.mark.parametrize(
    "points",
    [rise(0.0)[:5], np.zeros((TIMES.size, 3)), rise(-10.0)],
    ids=["too few", "no motion", "never at rest"],
)
def test_what_tells_nothing_leaves_the_crossing_where_it_was(points):
    times = TIMES[: len(points)]
    near = float(times[-1]) - 0.005 if len(points) < 10 else 0.05
    assert rise_crossing(times, points, 0.04, near, 0.06) == pytest.approx(near, abs=0.06)


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
