"""Online calibration: coverage on what the model did not expect, and no change where it is right."""

import numpy as np
import pytest

from hri_prediction.prediction.calibration import OnlineCalibration

REGION_95 = 7.814727903251179


def run(scale: float, steps: int, rate: float = 0.05, limit: float = 100.0, seed: int = 0):
    """Feed predictions whose errors are ``scale`` times what they claim; share inside and factor."""
    rng = np.random.default_rng(seed)
    calibration = OnlineCalibration(0.1, 3, rate, limit)
    covariance = np.broadcast_to(np.diag([1e-4, 4e-4, 1e-4]), (3, 3, 3))
    spread = np.sqrt(np.diag(covariance[0]))
    inside = []
    for i in range(steps):
        now = 0.1 * i
        wrist = scale * spread * rng.standard_normal(3)
        factors = calibration.factors(np.array([0.1]))
        inside.append(np.sum((wrist / spread) ** 2) <= factors[0] * REGION_95)
        calibration.seen(now, wrist)
        calibration.predicted(now, np.zeros((3, 3)), covariance)
    return np.array(inside), calibration


@pytest.mark.parametrize("scale", [1.0, 2.0, 4.0])
def test_in_the_long_run_95_percent_are_inside(scale: float) -> None:
    inside, _ = run(scale, 4000)
    assert 0.94 <= inside[1000:].mean() <= 0.99


@pytest.mark.parametrize("together_s", [0.0, 0.3])
def test_overlapping_predictions_widen_no_further_than_is_needed(together_s: float) -> None:
    """At 50 Hz and up to 1 s ahead, errors alike for a while: regions as published hold 95 %."""
    scale = 3.0
    rng = np.random.default_rng(1)
    calibration = OnlineCalibration(0.1, 10, 0.05, 100.0)
    covariance = np.broadcast_to(np.diag([1e-4, 4e-4, 1e-4]), (10, 3, 3))
    spread = np.sqrt(np.diag(covariance[0]))
    stays = np.exp(-0.02 / together_s) if together_s else 0.0
    error = rng.standard_normal(3)
    squares, factors = [], []
    for i in range(3000):
        error = stays * error + np.sqrt(1.0 - stays**2) * rng.standard_normal(3)
        squares.append(scale**2 * error @ error)
        calibration.seen(0.02 * i, scale * spread * error)
        calibration.predicted(0.02 * i, np.zeros((10, 3)), covariance)
        factors.append(calibration.factors(np.array([0.1, 0.5, 1.0])))
    published = np.array(factors)
    for column, ahead in enumerate((5, 25, 50)):
        inside = np.array(squares[ahead:]) <= published[:-ahead, column] * REGION_95
        assert 0.93 <= inside[500:].mean() <= 0.98
        # Not at first either.
        assert published[:, column].max() < 2.5 * scale**2
        assert 0.7 < np.median(published[500:, column]) / scale**2 < 1.3


def test_more_than_the_largest_factor_is_not_made_up_for() -> None:
    inside, calibration = run(20.0, 1000)
    assert calibration.factors(np.array([0.1]))[0] == pytest.approx(100.0)
    assert inside[500:].mean() < 0.8


def test_errors_as_claimed_change_little() -> None:
    _, calibration = run(1.0, 4000)
    assert calibration.factors(np.array([0.1, 0.2, 0.3])).max() < 2.0


def test_smaller_errors_than_claimed_change_nothing() -> None:
    _, calibration = run(0.3, 500)
    np.testing.assert_array_equal(calibration.factors(np.array([0.0, 0.15, 1.0])), 1.0)


def test_the_factor_has_a_limit_and_can_be_switched_off() -> None:
    _, calibration = run(100.0, 500, limit=9.0)
    assert calibration.factors(np.array([0.3]))[0] == pytest.approx(9.0)
    _, calibration = run(100.0, 500, rate=0.0)
    assert calibration.factors(np.array([0.3]))[0] == 1.0


def test_factors_grow_from_one_and_stay_level() -> None:
    _, calibration = run(4.0, 500)
    factors = calibration.factors(np.array([0.0, 0.05, 0.1, 0.3, 1.5]))
    assert factors[0] == 1.0
    assert 1.0 < factors[1] < factors[2]
    assert factors[4] == factors[3]


def test_only_times_at_which_the_wrist_was_seen_count() -> None:
    calibration = OnlineCalibration(0.05, 1, 0.05, 100.0)
    horizon = np.array([0.05])
    covariance = np.eye(3)[None] * 1e-6
    calibration.seen(0.0, np.zeros(3))
    calibration.predicted(0.0, np.zeros((1, 3)), covariance)
    calibration.seen(0.2, np.ones(3))  # after a gap
    assert calibration.factors(horizon)[0] == 1.0
    # Between two samples the wrist is where the line between them is.
    calibration.predicted(0.2, np.full((1, 3), 1.5), covariance)
    calibration.seen(0.3, np.full(3, 2.0))
    assert calibration.factors(horizon)[0] == 1.0
    calibration.predicted(0.3, np.zeros((1, 3)), covariance)
    calibration.forget_pending()
    calibration.seen(0.35, np.full(3, 2.0))
    assert calibration.factors(horizon)[0] == 1.0
    calibration.predicted(0.35, np.zeros((1, 3)), covariance)
    calibration.seen(0.4, np.full(3, 2.0))
    assert calibration.factors(horizon)[0] > 1.0
    calibration.reset()
    assert calibration.factors(horizon)[0] == 1.0
