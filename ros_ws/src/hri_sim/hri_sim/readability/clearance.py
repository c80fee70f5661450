"""How near the robot came to a person."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hri_planner.robot.model import RobotModel
from hri_prediction.compiled import njit
from hri_sim.simulator.distances import arm_clearance

FloatArray = NDArray[np.float64]


def limb_clearance(
    robot: RobotModel, joints: FloatArray, person: FloatArray, radii: Sequence[float]
) -> float:
    """Smallest surface distance [m].

    Args:
        robot: The robot.
        joints: Its angles (n, 7) [rad].
        person: Keypoints of an arm (n, 4, 3) [m].
        radii: Of its limbs (3,) [m].
    """
    return float(
        _limb_clearance(
            np.array(joints, dtype=float, order="C"),
            np.array(person, dtype=float, order="C")[:, None],
            robot.lengths,
            robot.capsule_radii,
            np.array(radii, dtype=float),
        )
    )


@njit
def _limb_clearance(joints: Any, arms: Any, lengths: Any, own: Any, radii: Any) -> float:
    points, smallest = np.empty((4, 3)), np.inf
    for index in range(len(joints)):
        found = arm_clearance(joints[index], lengths, own, arms[index], radii, points)
        smallest = min(smallest, found[0])
    return smallest
