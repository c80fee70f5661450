"""Motions of the robot that heed nobody: between random postures, as fast as is asked for."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hri_planner.robot.model import RobotModel
from hri_sim.simulator.trajectory import JointTrajectory

FloatArray = NDArray[np.float64]

LOWEST_M = 0.08
"""No point of the arm beyond the elbow is lower in a posture [m]: there is the table."""
MOST_ACCELERATION = 6.0
"""Of any point of the arm [m/s²]."""
_POINTS = 21


def draw_posture(robot: RobotModel, rng: np.random.Generator) -> FloatArray:
    """A posture (7,) [rad] that is above the table, and in front of the base more often than behind."""
    while True:
        q = rng.uniform(0.9 * robot.lower, 0.9 * robot.upper)
        q[0] = np.clip(rng.normal(0.0, 1.0), robot.lower[0], robot.upper[0])
        points = robot.frames(q)
        if points[1:, 2].min() > LOWEST_M:
            return q


def motion_to(
    robot: RobotModel, start: FloatArray, goal: FloatArray, speed: float, stamp_ns: int
) -> JointTrajectory:
    """A quintic from rest to rest, so long that no point of the arm is faster than that.

    Args:
        robot: The model.
        start: Joint angles (7,) [rad].
        goal: Joint angles (7,) [rad].
        speed: Of the fastest point [m/s]; slower where joints or the acceleration allow no more.
        stamp_ns: When it begins [ns].
    """
    s = np.linspace(0.0, 1.0, _POINTS)
    share = s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
    rate = 30.0 * s**2 * (1.0 - s) ** 2
    growth = 60.0 * s * (1.0 - 3.0 * s + 2.0 * s**2)
    way = goal - start
    q = start + share[:, None] * way
    points = robot.frames(q)
    step = s[1] - s[0]
    fastest = np.linalg.norm(np.gradient(points, step, axis=0), axis=-1).max()
    bent = np.linalg.norm(np.diff(points, 2, axis=0), axis=-1).max() / step**2
    joints = (np.abs(way) * rate.max() / (0.9 * robot.velocity)).max()
    duration = max(fastest / speed, np.sqrt(bent / MOST_ACCELERATION), joints, 0.2)
    return JointTrajectory(
        stamp_ns,
        robot.joint_names,
        s * duration,
        q,
        rate[:, None] * way / duration,
        growth[:, None] * way / duration**2,
    )
