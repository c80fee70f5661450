r"""Joint angles of the model that come nearest to an arm that was seen.

A real arm rolls about the upper arm, the model does not. Angles from the directions of the segments
(`kinematics.joint_angles`) then put the wrist elsewhere, by decimetres where the arm hangs down and its
yaw is hardly seen. Nearest in the sense of

.. math:: \min_q |e(q) - e|^2 + |w(q) - w|^2, \qquad q_{min} \le q \le q_{max}

shares what the model cannot do among elbow e and wrist w; where nothing rolls both are the same.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hri_prediction.motor_control.arm_model import ANATOMICAL, ArmModel, JointLimits
from hri_prediction.motor_control.kinematics import (
    elbow_and_wrist,
    elbow_jacobian,
    hand_jacobian,
    joint_angles,
)

Array = NDArray[np.float64]

_STEPS = 30
_YAWS = np.radians([-30.0, 30.0, 90.0])
"""Where to begin, beside where the upper arm points: what is nearest need not be near that."""
_ENOUGH_RAD = 1e-10


def nearest_angles(points: Array, arm: ArmModel, limits: JointLimits = ANATOMICAL) -> Array:
    """Joint angles (N, 3) [rad] within the limits, nearest to shoulder, elbow and wrist (N, 3, 3) [m].

    NaN where a point is.

    Raises:
        DataError: when a segment has no length.
    """
    elbow, wrist = points[:, 1] - points[:, 0], points[:, 2] - points[:, 0]
    first = joint_angles(points[:, 0], points[:, 1], points[:, 2], arm.convention)
    low, high = np.array(limits.lower), np.array(limits.upper)
    # Within half a turn of the middle of the limits: the same posture, and one that may be allowed.
    first -= 2.0 * np.pi * np.round((first - 0.5 * (low + high)) / (2.0 * np.pi))
    best, least = np.full_like(first, np.nan), np.full(len(first), np.inf)
    for yaw in (None, *_YAWS):
        start = first.copy()
        if yaw is not None:
            start[:, 1] = yaw
        found, squares = _descend(np.clip(start, low, high), elbow, wrist, arm, low, high)
        nearer = squares < least - 1e-12
        best[nearer], least[nearer] = found[nearer], squares[nearer]
    return best


def _descend(
    q: Array, elbow: Array, wrist: Array, arm: ArmModel, low: Array, high: Array
) -> tuple[Array, Array]:
    """Levenberg-Marquardt steps of all samples at once, cut off at the limits."""
    squares = _squares(q, elbow, wrist, arm)
    damping = np.full(len(q), 1e-4)
    for _ in range(_STEPS):
        at_elbow, at_wrist = elbow_and_wrist(q, arm)
        jacobian = np.concatenate([elbow_jacobian(q, arm), hand_jacobian(q, arm)], axis=1)
        residual = np.concatenate([elbow - at_elbow, wrist - at_wrist], axis=1)
        right = np.einsum("nij,ni->nj", jacobian, residual)
        normal = np.einsum("nij,nik->njk", jacobian, jacobian)
        held = ((q <= low) & (right < 0.0)) | ((q >= high) & (right > 0.0))
        right[held] = 0.0
        free = ~held
        normal *= free[:, :, None] & free[:, None, :]
        normal += (damping[:, None] + held)[..., None] * np.eye(3)
        step = np.linalg.solve(normal, right[..., None])[..., 0]
        tried = np.clip(q + step, low, high)
        new = _squares(tried, elbow, wrist, arm)
        better = new < squares
        moved = np.abs(tried - q).max()
        q = np.where(better[:, None], tried, q)
        squares = np.where(better, new, squares)
        damping = np.clip(np.where(better, 0.2 * damping, 5.0 * damping), 1e-10, 1e3)
        if moved < _ENOUGH_RAD:
            break
    return q, squares


def _squares(q: Array, elbow: Array, wrist: Array, arm: ArmModel) -> Array:
    at_elbow, at_wrist = elbow_and_wrist(q, arm)
    found: Array = np.square(at_elbow - elbow).sum(axis=1) + np.square(at_wrist - wrist).sum(axis=1)
    return found
