"""Joint trajectories as messages have them."""

from __future__ import annotations

from array import array

import numpy as np
from trajectory_msgs.msg import JointTrajectory as JointTrajectoryMessage

from hri_prediction.errors import DataError
from hri_prediction.ros.time import to_ns
from hri_sim.simulator.trajectory import JointTrajectory


def _matrix(rows: list[array[float]]) -> np.ndarray:
    return np.array([np.asarray(row, dtype=float) for row in rows])


def trajectory_from_message(message: JointTrajectoryMessage) -> JointTrajectory:
    """Trajectory of a message.

    Raises:
        DataError: when its points differ in size.
    """
    points = message.points
    names = tuple(message.joint_names)
    for index, point in enumerate(points):
        for what in ("positions", "velocities", "accelerations"):
            values = getattr(point, what)
            optional = what != "positions" and len(getattr(points[0], what)) == 0
            if len(values) != (0 if optional else len(names)):
                raise DataError(
                    f"point {index} has {len(values)} {what}",
                    expected=f"{len(names)} (one a joint)",
                )
    with_velocity = bool(points) and len(points[0].velocities) > 0
    with_acceleration = with_velocity and len(points[0].accelerations) > 0
    return JointTrajectory(
        stamp_ns=to_ns(message.header.stamp),
        joint_names=names,
        time_s=np.array([p.time_from_start.sec + p.time_from_start.nanosec * 1e-9 for p in points]),
        positions=_matrix([p.positions for p in points]) if points else np.empty((0, len(names))),
        velocities=_matrix([p.velocities for p in points]) if with_velocity else None,
        accelerations=_matrix([p.accelerations for p in points]) if with_acceleration else None,
    )
