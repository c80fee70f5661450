"""Motions of the robot that heed nobody: between random postures, or to another one on the way."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BPoly

from hri_planner.robot.model import RobotModel
from hri_sim.simulator.trajectory import JointTrajectory

FloatArray = NDArray[np.float64]

LOWEST_M = 0.08
"""No point of the arm beyond the elbow is lower in a posture [m]: there is the table."""
MOST_ACCELERATION = 10.0
"""Of any point of the arm [m/s²]: as much as the monitor reckons with."""
_POINTS, _LOOKS = 31, 121  # of a trajectory, and those at which a motion is looked at
_JOINT_SHARE = 0.9  # of the joints' speed limits
_LONGER, _TRIES = 1.15, 16


def draw_posture(robot: RobotModel, rng: np.random.Generator) -> FloatArray:
    """A posture (7,) [rad] that is above the table, and in front of the base more often than behind."""
    while True:
        q = rng.uniform(0.9 * robot.lower, 0.9 * robot.upper)
        q[0] = np.clip(rng.normal(0.0, 1.0), robot.lower[0], robot.upper[0])
        points = robot.frames(q)
        if points[1:, 2].min() > LOWEST_M:
            return q


@dataclass(frozen=True, eq=False)
class Motion:
    """A quintic that ends at rest.

    Attributes:
        duration: Of it [s].
        curve: Joint angles (7,) [rad] of the time from its beginning [s].
    """

    duration: float
    curve: BPoly

    def at(self, time_s: FloatArray | float) -> FloatArray:
        """Joint angles, speeds and accelerations (3, ..., 7) at times from its beginning [s]."""
        time_s = np.clip(time_s, 0.0, self.duration)
        found: FloatArray = np.array([self.curve(time_s, order) for order in range(3)])
        return found

    def trajectory(self, robot: RobotModel, stamp_ns: int) -> JointTrajectory:
        """What a controller gets; it begins at the stamp."""
        time_s = np.linspace(0.0, self.duration, _POINTS)
        return JointTrajectory(stamp_ns, robot.joint_names, time_s, *self.at(time_s))


def motion_to(
    robot: RobotModel, start: FloatArray, goal: FloatArray, speed: float
) -> Motion | None:
    """The shortest of some quintics to rest that keep to what is asked for.

    Args:
        robot: The model.
        start: Joint angles, speeds and accelerations it begins with (3, 7).
        goal: Joint angles (7,) [rad].
        speed: No point of the arm is faster [m/s], unless it is so at first.

    Returns:
        The motion; none when there is none within the joint limits, below :data:`MOST_ACCELERATION`.
    """
    end = np.zeros((3, 7))
    end[0] = goal
    # Of a quintic from rest to rest; nothing shorter will do.
    duration = max(
        float((1.875 * np.abs(goal - start[0]) / (_JOINT_SHARE * robot.velocity)).max()), 0.2
    )
    fastest = max(speed, _fastest_point(robot, start[0], start[1]))
    for _ in range(_TRIES):
        motion = Motion(duration, BPoly.from_derivatives([0.0, duration], [start, end]))
        if _keeps(robot, motion, fastest):
            return motion
        duration *= _LONGER
    return None


def _keeps(robot: RobotModel, motion: Motion, fastest: float) -> bool:
    """Whether a motion is within all limits: of joints, of speed and of acceleration."""
    q, qd, _ = motion.at(np.linspace(0.0, motion.duration, _LOOKS))
    if (q < robot.lower).any() or (q > robot.upper).any():
        return False
    if (np.abs(qd) > _JOINT_SHARE * robot.velocity + 1e-9).any():
        return False
    points = robot.frames(q)
    step = motion.duration / (_LOOKS - 1)
    speeds = np.linalg.norm(np.diff(points, axis=0), axis=-1) / step
    bent = np.linalg.norm(np.diff(points, 2, axis=0), axis=-1) / step**2
    return bool(speeds.max() <= fastest + 1e-9 and bent.max() <= MOST_ACCELERATION)


def _fastest_point(robot: RobotModel, q: FloatArray, qd: FloatArray) -> float:
    """Speed of the fastest point of the arm [m/s]."""
    step = 1e-5
    ways = robot.frames(q + step * qd) - robot.frames(q)
    return float(np.linalg.norm(ways, axis=-1).max()) / step
