"""Places on the axes of limbs, whose joints are given in order, next to a point: compiled."""

from __future__ import annotations

from typing import Any

import numpy as np

from hri_prediction.compiled import njit


@njit
def places_of(joints: Any, speeds: Any, point: Any) -> tuple[Any, Any]:
    """Joints (n), and where limbs (n - 1) are next to a point, with their velocities."""
    count = len(joints)
    place, speed = np.empty((2 * count - 1, 3)), np.empty((2 * count - 1, 3))
    place[:count], speed[:count] = joints, speeds
    for index in range(count - 1):
        share = share_along(joints[index], joints[index + 1], point)
        for k in range(3):
            place[count + index, k] = (1.0 - share) * joints[index, k] + share * joints[
                index + 1, k
            ]
            speed[count + index, k] = (1.0 - share) * speeds[index, k] + share * speeds[
                index + 1, k
            ]
    return place, speed


@njit
def share_along(first: Any, second: Any, point: Any) -> float:
    """Where along a segment, 0 to 1, it is next to a point; all (3,)."""
    squares, along = 0.0, 0.0
    for k in range(3):
        way = second[k] - first[k]
        squares += way * way
        along += way * (point[k] - first[k])
    return min(max(along / squares, 0.0), 1.0) if squares > 1e-12 else 0.0


@njit
def nearest_on(joints: Any, point: Any) -> tuple[int, float]:
    """Limb next to a point, and where along it, 0 to 1."""
    best, limb, where = np.inf, 0, 0.0
    for index in range(len(joints) - 1):
        share = share_along(joints[index], joints[index + 1], point)
        distance = 0.0
        for k in range(3):
            place = (1.0 - share) * joints[index, k] + share * joints[index + 1, k]
            distance += (place - point[k]) ** 2
        if distance < best:
            best, limb, where = distance, index, share
    return limb, where
