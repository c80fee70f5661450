"""The point of the robot's arm next to people's limbs, and how joint angles move it away: compiled.

The hand's capsule is left out: where the tool goes is not for the null space to say.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from hri_planner.robot.kinematics import arm_points, point_jacobian
from hri_prediction.compiled import njit
from hri_prediction.geometry.segments import closest_parameters

ARM_LINKS = 2
"""Upper and lower arm."""


@njit
def away_from_limbs(
    q: Any,
    lengths: Any,
    joints: Any,
    speeds: Any,
    radii: Any,
    reach: float,
    gain: float,
    row: Any,
) -> float:
    """How the nearest distance between the robot's arm and limbs changes, and how fast it is to grow.

    Args:
        q: Joint angles (7,) [rad].
        lengths: Of the robot (4,) [m].
        joints: Of each person's limbs in order (p, n, 3) [m].
        speeds: Of these (p, n, 3) [m/s].
        radii: Of robot link and limb together (2, m), the last of the hand [m].
        reach: Distance of surfaces within which something is done [m].
        gain: Share of what is missing to it that is made up a second [1/s].
        row: Result: derivative of the distance by the joint angles (7,) [m/rad]; zero when nothing is
            near.

    Returns:
        Speed at which the distance is to grow [m/s].
    """
    points = np.empty((4, 3))
    arm_points(q, lengths, points)
    limbs = joints.shape[1] - 1
    nearest, link, person, limb, on_link, on_limb = reach, -1, 0, 0, 0.0, 0.0
    for index in range(ARM_LINKS):
        for who in range(joints.shape[0]):
            for part in range(limbs):
                s, t, squares = closest_parameters(
                    points[index], points[index + 1], joints[who, part], joints[who, part + 1]
                )
                # Counted from the hand: what is known of an arm may begin at the elbow.
                own = max(radii.shape[1] - limbs + part, 0)
                distance = math.sqrt(squares) - radii[index, own]
                if distance < nearest:
                    nearest, link, person, limb = distance, index, who, part
                    on_link, on_limb = s, t
    row[:] = 0.0
    if link < 0:
        return 0.0
    point, jacobian = np.empty(3), np.empty((3, 7))
    point_jacobian(q, lengths, link, on_link, point, jacobian)
    length, coming = 0.0, 0.0
    outward = np.empty(3)
    for k in range(3):
        place = (1.0 - on_limb) * joints[person, limb, k] + on_limb * joints[person, limb + 1, k]
        outward[k] = point[k] - place
        length += outward[k] ** 2
    length = math.sqrt(length)
    if length < 1e-9:
        return 0.0
    for k in range(3):
        outward[k] /= length
        coming += outward[k] * (
            (1.0 - on_limb) * speeds[person, limb, k] + on_limb * speeds[person, limb + 1, k]
        )
        for joint in range(7):
            row[joint] += outward[k] * jacobian[k, joint]
    # What comes closer is given way to more the nearer it is.
    missing = 1.0 - max(nearest, 0.0) / reach
    return gain * (reach - nearest) + missing * max(coming, 0.0)
