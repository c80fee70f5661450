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
        person: Keypoints (n, L + 1, 3) [m] of an arm of L limbs.
        radii: Of its limbs (L,) [m].

    Raises:
        ValueError: when these do not fit each other.
    """
    joints = np.array(joints, dtype=float, order="C")
    arms = np.array(person, dtype=float, order="C")
    # Compiled code would read past the end of arrays without a word.
    if joints.ndim != 2 or joints.shape[1] != 7:
        raise ValueError(f"joints must be (n, 7), not {joints.shape}")
    wanted = (len(joints), len(radii) + 1, 3)
    if arms.shape != wanted:
        raise ValueError(
            f"{len(joints)} postures and {len(radii)} radii want a person's keypoints as {wanted}, "
            f"not {arms.shape}"
        )
    return float(
        _limb_clearance(
            joints, arms[:, None], robot.lengths, robot.capsule_radii, np.array(radii, dtype=float)
        )
    )


@njit
def _limb_clearance(joints: Any, arms: Any, lengths: Any, own: Any, radii: Any) -> float:
    points, smallest = np.empty((4, 3)), np.inf
    for index in range(len(joints)):
        found = arm_clearance(joints[index], lengths, own, arms[index], radii, points)
        smallest = min(smallest, found[0])
    return smallest
