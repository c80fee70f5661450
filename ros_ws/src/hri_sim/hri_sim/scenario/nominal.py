"""The robot's nominal motion: what it would do if nobody were there.

It decides whether a condition is a test at all, and it is the baseline of the benchmarks.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from hri_planner.robot import RobotModel, solve_ik
from hri_prediction.arm.geometry import FloatArray
from hri_prediction.errors import PlanningError
from hri_prediction.geometry.minimum_jerk import minimum_jerk

PEAK_SPEED = 1.875
"""Largest speed of a minimum-jerk motion, as a multiple of its mean speed."""


def nominal_goal(robot: RobotModel, q0: ArrayLike, position: ArrayLike) -> FloatArray:
    """The posture (7,) [rad] nearest to ``q0`` (7,) whose tool is at ``position`` (3,) [m].

    The search begins at the same random starting points each time: equal arguments, equal posture.

    Raises:
        PlanningError: when the position is out of reach.
    """
    rng = np.random.default_rng(0)
    return solve_ik(robot, np.asarray(position, dtype=float), np.asarray(q0, dtype=float), rng)


def nominal_motion(
    robot: RobotModel, q0: ArrayLike, goal: ArrayLike, duration: float, rate_hz: float = 250.0
) -> tuple[FloatArray, FloatArray]:
    """Joint-space minimum-jerk motion to the goal posture nearest to the present one.

    Args:
        robot: The robot.
        q0: Present posture, at rest (7,) [rad].
        goal: Tool position (3,) [m], base frame.
        duration: From rest to rest [s].
        rate_hz: Rows a second, at least; the last row is the arrival.

    Returns:
        Times (N,) from 0 to ``duration`` [s] and joint angles (N, 7) [rad].

    Raises:
        PlanningError: when the goal is out of reach or the duration is not positive.
    """
    if not (math.isfinite(duration) and duration > 0.0):
        raise PlanningError(f"duration = {duration!r} s", expected="a positive time")
    start = np.asarray(q0, dtype=float)
    end = nominal_goal(robot, start, goal)
    time = np.linspace(0.0, duration, max(2, math.ceil(duration * rate_hz) + 1))
    return time, start + minimum_jerk(time / duration)[:, None] * (end - start)


def speed_share(robot: RobotModel, q0: FloatArray, q1: FloatArray, duration: float) -> float:
    """Highest joint speed of a minimum-jerk motion from q0 to q1, as a share of the limit."""
    return float(np.max(PEAK_SPEED * np.abs(q1 - q0) / duration / robot.velocity))
