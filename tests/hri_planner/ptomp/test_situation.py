"""The five inputs of parameter adaptation."""

import math

import numpy as np
import pytest

from hri_planner.ptomp.forecast import HumanForecast
from hri_planner.ptomp.plan import JointPlan
from hri_planner.ptomp.result import ReplanResult
from hri_planner.ptomp.situation import (
    AHEAD_S,
    WINDOW_S,
    PredictionError,
    Situation,
    situation,
    uncertainty,
)

OFFSETS = np.linspace(0.0, 1.0, 21)
RADII = np.full(3, 0.05)


def replan(contact_s: float | None) -> ReplanResult:
    plan = JointPlan(np.array([2.0, 3.0]), *np.zeros((3, 2, 7)))
    return ReplanResult(
        plan=plan,
        stage="reaching",
        feasible=contact_s is None,
        reason="",
        iterations=1,
        cost_terms={"collision": 0.7, "effort": 3.0},
        predicted_clearance_m=0.1,
        predicted_first_contact_s=contact_s,
        goal_error_m=0.0,
    )


def test_uncertainty_is_the_mean_root_of_the_largest_eigenvalue():
    rng = np.random.default_rng(0)
    factor = rng.normal(size=(6, 4, 3, 3))
    covariance = factor @ factor.transpose(0, 1, 3, 2)
    largest = np.linalg.eigvalsh(covariance)[..., -1]
    forecast = HumanForecast(0.0, 0.1, np.zeros((6, 4, 3)), np.sqrt(largest), RADII)
    by_hand = [np.linalg.norm(c, 2) ** 0.5 for c in covariance.reshape(-1, 3, 3)]
    assert uncertainty(forecast) == pytest.approx(np.mean(by_hand))


@pytest.mark.parametrize(
    ("contact_s", "start_in_s", "left_s"),
    [
        (None, 0.014, 1.5),
        (2.4, 0.014, 0.414),  # 0.4 s into a plan that begins 14 ms from now
        (2.4, 0.0, 0.4),
        (2.0, -0.01, 0.0),  # it is happening
    ],
)
def test_time_to_collision(contact_s, start_in_s, left_s):
    found = situation([0.01], [0.02], 0.3, 1.5, replan(contact_s), start_in_s)
    assert found.time_to_collision == pytest.approx(left_s)
    assert found.collision_cost == 0.7


def test_the_worst_arm_counts_and_nobody_is_certain():
    found = situation([0.01, 0.03], [0.02, 0.0], 0.3, 1.5)
    assert found == Situation(0.03, 0.02, 0.3, 1.5, 0.0)
    assert situation([], [], math.inf, 1.5) == Situation(0.0, 0.0, math.inf, 1.5, 0.0)


def said(error, begin_s, velocity):
    """A wrist predicted to move steadily from where it is."""
    start = begin_s * velocity
    error.observe(begin_s, OFFSETS, start + OFFSETS[:, None] * velocity)


def test_right_predictions_have_no_error():
    error = PredictionError()
    for k in range(60):
        said(error, 0.04 * k, np.array([0.5, -0.2, 0.1]))
    assert error.rms == pytest.approx(0.0, abs=1e-12)


def test_the_error_is_that_of_predictions_made_a_while_before():
    """The wrist moves at 0.5 m/s and is always predicted to stay: it is off by what it moves."""
    error = PredictionError()
    for k in range(80):
        where = np.array([0.5 * 0.04 * k, 0.0, 0.3])
        error.observe(0.04 * k, OFFSETS, np.tile(where, (len(OFFSETS), 1)))
        if 0.04 * k < AHEAD_S - 1e-9:
            assert error.rms == 0.0
    assert error.rms == pytest.approx(0.5 * AHEAD_S, rel=1e-6)


def test_old_errors_are_forgotten():
    error = PredictionError()
    where = np.zeros((len(OFFSETS), 3))
    for k in range(200):
        if k == 50:
            where = where + np.array(
                [0.1, 0.0, 0.0]
            )  # a jump: off for as long as predictions look ahead
        error.observe(0.02 * k, OFFSETS, where)
        if k in (55, 99):
            assert error.rms > 0.0
    assert error.rms == 0.0
    assert WINDOW_S == 1.0


def test_a_clock_that_goes_back_begins_anew():
    error = PredictionError()
    for k in range(30):
        error.observe(5.0 + 0.04 * k, OFFSETS, np.full((len(OFFSETS), 3), 0.01 * k))
    assert error.rms > 0.0
    error.observe(1.0, OFFSETS, np.zeros((len(OFFSETS), 3)))
    assert error.rms == 0.0


def test_predictions_that_do_not_reach_so_far_are_not_compared():
    error = PredictionError()
    for k in range(30):
        error.observe(0.04 * k, OFFSETS[:3], np.full((3, 3), 0.01 * k))
    assert error.rms == 0.0
