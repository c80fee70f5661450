"""Where elbow and wrist are at given joint angles, and the joint angles of an arm that was seen."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hri_prediction.errors import DataError
from hri_prediction.motor_control.arm_model import ArmModel
from hri_prediction.motor_control.convention import (
    PITCH_YAW,
    YAW_PITCH,
    convention_of,
)

Array = NDArray[np.float64]


def _turned(axis: str, angles: Array, vectors: Array) -> Array:
    """Vectors (..., 3) turned about an axis by angles (...)."""
    angle = -angles if axis == "-y" else angles
    c, s = np.cos(angle), np.sin(angle)
    x, y, z = vectors[..., 0], vectors[..., 1], vectors[..., 2]
    if axis == "z":
        return np.stack([c * x - s * y, s * x + c * y, z], axis=-1)
    return np.stack([c * x + s * z, y, -s * x + c * z], axis=-1)


def elbow_and_wrist(angles: ArrayLike, arm: ArmModel) -> tuple[Array, Array]:
    """Positions of elbow and wrist, from the shoulder, in the frame of the arm model.

    Args:
        angles: q (..., 3) [rad].
        arm: Lengths and convention.

    Returns:
        Two arrays (..., 3) [m].
    """
    q = np.asarray(angles, dtype=float)
    convention = convention_of(arm.convention)
    first, second, third = (q[..., joint] for joint in convention.joints)
    axes = convention.axes
    upper = np.broadcast_to([arm.upper_m, 0.0, 0.0], q.shape)
    forearm = _turned(axes[2], third, np.broadcast_to([arm.forearm_m, 0.0, 0.0], q.shape))
    elbow = _turned(axes[0], first, _turned(axes[1], second, upper))
    wrist = _turned(axes[0], first, _turned(axes[1], second, upper + forearm))
    return elbow, wrist


def hand(angles: ArrayLike, arm: ArmModel) -> Array:
    """Position of the wrist, which the thesis calls the hand (..., 3) [m]."""
    return elbow_and_wrist(angles, arm)[1]


def hand_jacobian(angles: ArrayLike, arm: ArmModel) -> Array:
    """Derivatives of the wrist's position by the joint angles (..., 3, 3) [m/rad]: column k by q_k."""
    q = np.asarray(angles, dtype=float)
    elbow, wrist = elbow_and_wrist(q, arm)
    found = np.empty((*q.shape, 3))
    joints = convention_of(arm.convention).joints
    for axis, joint, arm_of_joint in zip(
        _axes(q, arm), joints, (wrist, wrist, wrist - elbow), strict=True
    ):
        found[..., joint] = np.cross(axis, arm_of_joint)
    return found


def elbow_jacobian(angles: ArrayLike, arm: ArmModel) -> Array:
    """Derivatives of the elbow's position by the joint angles (..., 3, 3) [m/rad]: column k by q_k."""
    q = np.asarray(angles, dtype=float)
    elbow, _ = elbow_and_wrist(q, arm)
    found = np.zeros((*q.shape, 3))
    joints = convention_of(arm.convention).joints
    for axis, joint in zip(_axes(q, arm)[:2], joints[:2], strict=True):
        found[..., joint] = np.cross(axis, elbow)
    return found


def _axes(q: Array, arm: ArmModel) -> list[Array]:
    """Axes of the three rotations in the frame of the model, each (..., 3)."""
    convention = convention_of(arm.convention)
    units = {"y": [0.0, 1.0, 0.0], "-y": [0.0, -1.0, 0.0], "z": [0.0, 0.0, 1.0]}
    found = []
    for index, axis in enumerate(convention.axes):
        vector = np.broadcast_to(units[axis], q.shape).astype(float)
        for before in reversed(range(index)):
            vector = _turned(convention.axes[before], q[..., convention.joints[before]], vector)
        found.append(vector)
    return found


def joint_angles(
    shoulder: ArrayLike, elbow: ArrayLike, wrist: ArrayLike, convention: str = YAW_PITCH.name
) -> Array:
    """Joint angles of an arm that was seen, from the directions of its segments.

    An arm has four degrees of freedom from shoulder to wrist, the model three: what the shoulder rolls is
    left out, and q3 is the angle between upper arm and forearm. So elbow and wrist of the model come
    where they were seen only as far as nothing rolls (:func:`elbow_and_wrist`, thesis 2.2.4.3, step 3).

    Args:
        shoulder: In the frame of the arm model, or any that is parallel to it (..., 3) [m].
        elbow: The same.
        wrist: The same.
        convention: How the joints turn.

    Returns:
        (..., 3) [rad]; q2 (with ``pitch_yaw``: q1) is continuous along the last axis but one, also where
        the arm hangs straight down, and NaN where a point is.

    Raises:
        DataError: when a segment has no length.
    """
    which = convention_of(convention)
    upper = np.asarray(elbow, dtype=float) - np.asarray(shoulder, dtype=float)
    forearm = np.asarray(wrist, dtype=float) - np.asarray(elbow, dtype=float)
    for vector, name in ((upper, "upper arm"), (forearm, "forearm")):
        lengths = np.linalg.norm(vector, axis=-1)
        if (lengths < 1e-6).any():
            raise DataError(f"the {name} has no length", expected="two different points")
    x, y, z = upper[..., 0], upper[..., 1], upper[..., 2]
    q = np.empty(upper.shape)
    if which is PITCH_YAW:
        # p = Ry(q1) Rz(q2) x = (c1 c2, s2, -s1 c2)
        q[..., 1] = np.arctan2(y, np.hypot(x, z))
        q[..., 0] = np.arctan2(-z, x)
        turning = 0
    else:
        # p = Rz(q2) Ry(q1) x = (c2 c1, s2 c1, -s1)
        q[..., 0] = np.arctan2(-z, np.hypot(x, y))
        q[..., 1] = np.arctan2(y, x)
        turning = 1
    crossed = np.linalg.norm(np.cross(upper, forearm), axis=-1)
    q[..., 2] = np.arctan2(crossed, (upper * forearm).sum(axis=-1))
    if q.ndim > 1:
        q[..., turning] = _unwrapped(q[..., turning])
    return q


def _unwrapped(angles: Array) -> Array:
    """Angles without leaps of a whole turn along the last axis; NaN stays."""
    found = angles.copy()
    rows = found.reshape(-1, found.shape[-1])
    for row in rows:
        seen = np.isfinite(row)
        row[seen] = np.unwrap(row[seen])
    return rows.reshape(found.shape)
