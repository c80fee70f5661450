"""True distances of the simulated scene, compiled: robot to people, robot to table."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from hri_planner.robot.kinematics import arm_points
from hri_planner.separation.pairs import robot_ends
from hri_prediction.compiled import njit
from hri_prediction.geometry.segments import closest_parameters, segment_distance

FloatArray = NDArray[np.float64]


@njit
def arm_clearance(
    q: FloatArray,
    lengths: FloatArray,
    robot_radii: FloatArray,
    arms: FloatArray,
    limb_radii: FloatArray,
    points: FloatArray,
) -> tuple[float, int, int, int]:
    """Smallest signed surface distance between robot capsules and the limbs of all arms.

    Args:
        q: Joint angles (7,) [rad].
        lengths: The robot's lengths (4,) [m], see :mod:`hri_planner.robot.kinematics`.
        robot_radii: (3,) [m].
        arms: Keypoints (P, L + 1, 3) [m] of arms of L limbs; one with NaN in its first number is left out.
        limb_radii: (L,) [m].
        points: Result (4, 3) [m]: shoulder, elbow, wrist and tool of the robot.

    Returns:
        Distance [m] (infinite without arms), robot capsule, arm, limb (-1 without arms).
    """
    arm_points(q, lengths, points)
    best, at = math.inf, (-1, -1, -1)
    for person in range(arms.shape[0]):
        if math.isnan(arms[person, 0, 0]):
            continue
        for i in range(robot_radii.shape[0]):
            for j in range(limb_radii.shape[0]):
                axis = segment_distance(
                    points[i], points[i + 1], arms[person, j], arms[person, j + 1]
                )
                distance = axis - robot_radii[i] - limb_radii[j]
                if distance < best:
                    best, at = distance, (i, person, j)
    return best, at[0], at[1], at[2]


@njit
def approach_speed(
    q: FloatArray,
    qd: FloatArray,
    lengths: FloatArray,
    capsule: int,
    limb: FloatArray,
    points: FloatArray,
    velocities: FloatArray,
) -> float:
    """Speed at which the point of a robot's capsule that is nearest to a limb comes at it [m/s].

    The points are those of the axes; the velocity is projected on the line from the robot's to the limb's.
    Where the axes meet there is no such line, and the point's whole speed counts.

    Args:
        q: Joint angles (7,) [rad].
        qd: Joint speeds (7,) [rad/s].
        lengths: The robot's lengths (4,) [m].
        capsule: Which of the robot's, 0 to 2.
        limb: Ends of the limb's axis (2, 3) [m].
        points: Result (4, 3) [m]: shoulder, elbow, wrist and tool of the robot.
        velocities: Result (4, 3) [m/s]: theirs.

    Returns:
        Negative where the point goes away.
    """
    robot_ends(q, qd, lengths, points, velocities)
    s, t, squared = closest_parameters(points[capsule], points[capsule + 1], limb[0], limb[1])
    along, speed = 0.0, 0.0
    for k in range(3):
        point = points[capsule, k] + s * (points[capsule + 1, k] - points[capsule, k])
        other = limb[0, k] + t * (limb[1, k] - limb[0, k])
        velocity = velocities[capsule, k] + s * (
            velocities[capsule + 1, k] - velocities[capsule, k]
        )
        along += velocity * (other - point)
        speed += velocity * velocity
    if squared <= 0.0:
        return math.sqrt(speed)
    return along / math.sqrt(squared)


@njit
def box_distance(x: float, y: float, z: float, center: FloatArray, half: FloatArray) -> float:
    """Signed distance of a point to an axis-parallel box [m]; negative inside."""
    dx = abs(x - center[0]) - half[0]
    dy = abs(y - center[1]) - half[1]
    dz = abs(z - center[2]) - half[2]
    outside = math.sqrt(max(dx, 0.0) ** 2 + max(dy, 0.0) ** 2 + max(dz, 0.0) ** 2)
    return outside + min(max(dx, max(dy, dz)), 0.0)


@njit
def segment_box_distance(
    a: FloatArray, b: FloatArray, center: FloatArray, half: FloatArray
) -> float:
    """Smallest signed distance of a segment a-b to a box [m], to 1e-9 of its length.

    The distance to a convex set is convex along a line: golden section search.
    """
    ratio = 0.5 * (math.sqrt(5.0) - 1.0)
    low, high = 0.0, 1.0
    s, t = 1.0 - ratio, ratio
    ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    fs = box_distance(a[0] + s * ux, a[1] + s * uy, a[2] + s * uz, center, half)
    ft = box_distance(a[0] + t * ux, a[1] + t * uy, a[2] + t * uz, center, half)
    for _ in range(44):
        if fs <= ft:
            high, t, ft = t, s, fs
            s = high - ratio * (high - low)
            fs = box_distance(a[0] + s * ux, a[1] + s * uy, a[2] + s * uz, center, half)
        else:
            low, s, fs = s, t, ft
            t = low + ratio * (high - low)
            ft = box_distance(a[0] + t * ux, a[1] + t * uy, a[2] + t * uz, center, half)
    ends = min(
        box_distance(a[0], a[1], a[2], center, half), box_distance(b[0], b[1], b[2], center, half)
    )
    return min(min(fs, ft), ends)


@njit
def table_clearance(
    q: FloatArray,
    lengths: FloatArray,
    robot_radii: FloatArray,
    center: FloatArray,
    half: FloatArray,
    points: FloatArray,
) -> float:
    """Smallest signed surface distance between the robot's capsules and a box [m].

    Args:
        q: Joint angles (7,) [rad].
        lengths: The robot's lengths (4,) [m].
        robot_radii: (3,) [m].
        center: Centre of the box (3,) [m].
        half: Half edge lengths (3,) [m].
        points: Result (4, 3) [m]: shoulder, elbow, wrist and tool of the robot.
    """
    arm_points(q, lengths, points)
    best = math.inf
    for i in range(3):
        axis = segment_box_distance(points[i], points[i + 1], center, half)
        best = min(best, axis - robot_radii[i])
    return best
