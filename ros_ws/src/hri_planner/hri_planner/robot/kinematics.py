"""Forward kinematics of the LWR4+ in closed form, compiled.

The arm has a spherical shoulder, an elbow and a spherical wrist, so four points describe all its
capsules: shoulder, elbow, wrist and tool. Joint axes in turn: z, -y, z, y, z, -y, z, all parallel
to the base frame at the zero posture, in which the arm stands straight up.

``lengths`` everywhere is (4,): height of the shoulder above the base, shoulder to elbow, elbow to
wrist, wrist to tool [m].
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from hri_prediction.compiled import njit

FloatArray = NDArray[np.float64]


@njit
def arm_points(q: FloatArray, lengths: FloatArray, points: FloatArray) -> None:
    """Shoulder, elbow, wrist and tool of one configuration.

    Args:
        q: Joint angles (7,) [rad]; the last one moves no point.
        lengths: (4,) [m], see the module.
        points: Result (4, 3) [m], base frame.
    """
    c1, s1 = math.cos(q[0]), math.sin(q[0])
    c2, s2 = math.cos(q[1]), math.sin(q[1])
    c3, s3 = math.cos(q[2]), math.sin(q[2])
    c4, s4 = math.cos(q[3]), math.sin(q[3])
    c5, s5 = math.cos(q[4]), math.sin(q[4])
    c6, s6 = math.cos(q[5]), math.sin(q[5])
    # Columns x, y, z of the rotation after joint 2 (about z, then about -y).
    x0, x1, x2 = c1 * c2, s1 * c2, s2
    y0, y1, y2 = -s1, c1, 0.0
    z0, z1, z2 = -c1 * s2, -s1 * s2, c2
    points[0, 0] = 0.0
    points[0, 1] = 0.0
    points[0, 2] = lengths[0]
    points[1, 0] = lengths[1] * z0
    points[1, 1] = lengths[1] * z1
    points[1, 2] = lengths[0] + lengths[1] * z2
    # About z by q3, then about y by q4.
    u0, u1, u2 = c3 * x0 + s3 * y0, c3 * x1 + s3 * y1, c3 * x2 + s3 * y2
    y0, y1, y2 = c3 * y0 - s3 * x0, c3 * y1 - s3 * x1, c3 * y2 - s3 * x2
    x0, x1, x2 = c4 * u0 - s4 * z0, c4 * u1 - s4 * z1, c4 * u2 - s4 * z2
    z0, z1, z2 = s4 * u0 + c4 * z0, s4 * u1 + c4 * z1, s4 * u2 + c4 * z2
    points[2, 0] = points[1, 0] + lengths[2] * z0
    points[2, 1] = points[1, 1] + lengths[2] * z1
    points[2, 2] = points[1, 2] + lengths[2] * z2
    # About z by q5, then about -y by q6; only the z axis is needed on.
    u0, u1, u2 = c5 * x0 + s5 * y0, c5 * x1 + s5 * y1, c5 * x2 + s5 * y2
    points[3, 0] = points[2, 0] + lengths[3] * (c6 * z0 - s6 * u0)
    points[3, 1] = points[2, 1] + lengths[3] * (c6 * z1 - s6 * u1)
    points[3, 2] = points[2, 2] + lengths[3] * (c6 * z2 - s6 * u2)


@njit
def many_arm_points(q: FloatArray, lengths: FloatArray) -> FloatArray:
    """Points (n, 4, 3) of many configurations (n, 7); see :func:`arm_points`."""
    points = np.empty((q.shape[0], 4, 3))
    for index in range(q.shape[0]):
        arm_points(q[index], lengths, points[index])
    return points


@njit
def tool_jacobian(q: FloatArray, lengths: FloatArray, tool: FloatArray, jac: FloatArray) -> None:
    """Tool position and its derivative by the joint angles.

    Args:
        q: Joint angles (7,) [rad].
        lengths: (4,) [m].
        tool: Result (3,) [m].
        jac: Result (3, 7) [m/rad]; the last column is zero.
    """
    point_jacobian(q, lengths, 2, 1.0, tool, jac)


@njit
def point_jacobian(
    q: FloatArray, lengths: FloatArray, link: int, share: float, point: FloatArray, jac: FloatArray
) -> None:
    """A point on a capsule's axis, and its derivative by the joint angles.

    Args:
        q: Joint angles (7,) [rad].
        lengths: (4,) [m].
        link: 0 upper arm, 1 lower arm, 2 hand.
        share: Where along the axis, 0 to 1.
        point: Result (3,) [m].
        jac: Result (3, 7) [m/rad]; columns of joints that do not move the point are zero.
    """
    points = np.empty((4, 3))
    arm_points(q, lengths, points)
    for i in range(3):
        point[i] = points[link, i] + share * (points[link + 1, i] - points[link, i])
    x = np.array((1.0, 0.0, 0.0))
    y = np.array((0.0, 1.0, 0.0))
    z = np.array((0.0, 0.0, 1.0))
    moving = min(3 + 2 * link, 6)
    jac[:, moving:] = 0.0
    for joint in range(moving):
        if joint % 2 == 0:
            axis = z
            sign = 1.0
        else:
            axis = y
            sign = 1.0 if joint == 3 else -1.0
        # Joints 1-3 turn about the shoulder, 4-5 about the elbow (or its axis), 6-7 the wrist.
        origin = points[0] if joint < 3 else (points[1] if joint < 5 else points[2])
        d0, d1, d2 = point[0] - origin[0], point[1] - origin[1], point[2] - origin[2]
        jac[0, joint] = sign * (axis[1] * d2 - axis[2] * d1)
        jac[1, joint] = sign * (axis[2] * d0 - axis[0] * d2)
        jac[2, joint] = sign * (axis[0] * d1 - axis[1] * d0)
        c = math.cos(q[joint])
        s = sign * math.sin(q[joint])
        if joint % 2 == 0:
            for i in range(3):
                xi, yi = x[i], y[i]
                x[i] = c * xi + s * yi
                y[i] = c * yi - s * xi
        else:
            for i in range(3):
                xi, zi = x[i], z[i]
                x[i] = c * xi - s * zi
                z[i] = s * xi + c * zi
