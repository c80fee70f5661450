"""Trunk, shoulder girdle and arm as fourteen joints: what movements are learnt in (thesis, 4.5).

The base is where a person's upper back is when they sit at rest, looking along its x axis, z up. From
there: where the trunk goes to (three), how it turns (yaw, pitch, roll), how far the shoulder is raised,
three angles of the shoulder joint, elbow, forearm and wrist. With all angles at zero the arm hangs down.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hri_prediction.compiled import njit
from hri_prediction.errors import DataError

FloatArray = NDArray[np.float64]

JOINTS = (
    "trunk x", "trunk y", "trunk z", "trunk yaw", "trunk pitch", "trunk roll", "shoulder elevation",
    "shoulder flexion", "shoulder abduction", "shoulder rotation", "elbow flexion", "forearm rotation",
    "wrist flexion", "wrist deviation",
)  # fmt: skip
"""The first three in metres, the others in radians."""
COUNT = len(JOINTS)

Geometry = tuple[FloatArray, float, FloatArray, float]
"""Base, heading, limbs and side of an upper body."""

_GIRDLE_M = 0.19
"""From the middle of the upper back to the shoulder joint: half of the biacromial breadth."""
_STEP = 1e-6
_ROUNDS = 60


@dataclass(frozen=True, eq=False)
class UpperBody:
    """A person's upper body.

    Attributes:
        base: Where the upper back is at rest (3,) [m].
        heading: Where the person looks, from the world's x towards y [rad].
        limbs: Girdle, upper arm, forearm, hand (4,) [m].
        side: 1: the arm is the left one, -1: the right one.
    """

    base: FloatArray
    heading: float
    limbs: FloatArray
    side: float = -1.0

    @property
    def geometry(self) -> Geometry:
        """The same for kernels."""
        return self.base, self.heading, self.limbs, self.side

    def keypoints(self, q: FloatArray) -> FloatArray:
        """Shoulder, elbow, wrist, hand tip (..., 4, 3) [m] of joints (..., 14)."""
        angles = np.ascontiguousarray(q, dtype=float)
        if angles.shape[-1:] != (COUNT,):
            raise DataError(f"joints have shape {angles.shape}", expected=f"(..., {COUNT})")
        flat = angles.reshape(-1, COUNT)
        out = np.empty((len(flat), 4, 3))
        _all_points(flat, self.geometry, out)
        return out.reshape(*angles.shape[:-1], 4, 3)


@njit
def _turned(matrix: FloatArray, axis: int, angle: float) -> None:
    """Turn a frame (3, 3), its axes as columns, about one of its own axes."""
    one, other = (axis + 1) % 3, (axis + 2) % 3
    cosine, sine = math.cos(angle), math.sin(angle)
    for row in range(3):
        a, b = matrix[row, one], matrix[row, other]
        matrix[row, one] = cosine * a + sine * b
        matrix[row, other] = -sine * a + cosine * b


@njit
def points_of(q: FloatArray, body: Geometry, frame: FloatArray, out: FloatArray) -> None:
    """Keypoints (4, 3) [m] of joints (14,); ``frame`` (3, 3) is for intermediate results."""
    base, heading, limbs, side = body
    frame[:] = 0.0
    for k in range(3):
        frame[k, k] = 1.0
    _turned(frame, 2, heading)
    for k in range(3):
        out[0, k] = base[k] + frame[k, 0] * q[0] + frame[k, 1] * q[1] + frame[k, 2] * q[2]
    _turned(frame, 2, q[3])
    _turned(frame, 1, q[4])
    _turned(frame, 0, q[5])
    _turned(frame, 0, side * q[6])
    for k in range(3):
        out[0, k] += side * limbs[0] * frame[k, 1]
    _turned(frame, 1, -q[7])
    _turned(frame, 0, side * q[8])
    _turned(frame, 2, side * q[9])
    for k in range(3):
        out[1, k] = out[0, k] - limbs[1] * frame[k, 2]
    _turned(frame, 1, -q[10])
    for k in range(3):
        out[2, k] = out[1, k] - limbs[2] * frame[k, 2]
    _turned(frame, 2, side * q[11])
    _turned(frame, 1, -q[12])
    _turned(frame, 0, side * q[13])
    for k in range(3):
        out[3, k] = out[2, k] - limbs[3] * frame[k, 2]


@njit
def _all_points(q: FloatArray, body: Geometry, out: FloatArray) -> None:
    frame = np.empty((3, 3))
    for row in range(q.shape[0]):
        points_of(q[row], body, frame, out[row])


def body_of(keypoints: FloatArray, heading: float, side: str = "right") -> UpperBody:
    """The upper body of somebody who was recorded: limbs of the median length, base behind the shoulder.

    Args:
        keypoints: Of the recording (n, 4, 3) [m].
        heading: Where the person looks [rad].
        side: Of the arm.
    """
    lengths = np.linalg.norm(np.diff(keypoints, axis=1), axis=-1)
    limbs = np.concatenate(([_GIRDLE_M], np.nanmedian(lengths, axis=0)))
    sign = {"left": 1.0, "right": -1.0}[side]
    aside = np.array((-math.sin(heading), math.cos(heading), 0.0))
    base = np.nanmedian(keypoints[:, 0], axis=0) - sign * _GIRDLE_M * aside
    return UpperBody(base, heading, limbs, sign)


NEUTRAL = np.array((0, 0, 0, 0, 0, 0, 0, 0.5, 0.2, 0, 1.2, 0, 0, 0), dtype=float)
"""Posture from which joints are reckoned to move as little as they must: the hand before the body."""
_STIFFNESS = np.array((3, 3, 3, 1, 1, 1, 1, 0.2, 0.2, 0.2, 0.2, 0.2, 0.5, 0.5))
"""How little each joint is used: trunk and girdle help where the arm does not reach."""
_PRICE_M = 2e-3


@njit
def _solve_posture(
    wanted: FloatArray,
    start: FloatArray,
    neutral: FloatArray,
    price: FloatArray,
    body: Geometry,
    out: FloatArray,
) -> None:
    """The joints (14,) whose keypoints are nearest to some (4, 3), and that move least (Gauss–Newton)."""
    frame, points, moved = np.empty((3, 3)), np.empty((4, 3)), np.empty((4, 3))
    jacobian, rest = np.zeros((26, 14)), np.zeros(26)
    q = start.copy()
    for k in range(14):
        jacobian[12 + k, k] = price[k]
    for _ in range(_ROUNDS):
        points_of(q, body, frame, points)
        for k in range(14):
            other = q.copy()
            other[k] += _STEP
            points_of(other, body, frame, moved)
            for row in range(4):
                for axis in range(3):
                    jacobian[3 * row + axis, k] = (moved[row, axis] - points[row, axis]) / _STEP
        for row in range(4):
            for axis in range(3):
                rest[3 * row + axis] = wanted[row, axis] - points[row, axis]
        for k in range(14):
            rest[12 + k] = price[k] * (neutral[k] - q[k])
        normal = jacobian.T @ jacobian
        step = np.linalg.solve(normal, jacobian.T @ rest)
        longest = np.abs(step).max()
        q += step * min(1.0, 0.5 / max(longest, 1e-12))
        if longest < 1e-8:
            break
    out[:] = q


def joints_of(body: UpperBody, keypoints: FloatArray) -> FloatArray:
    """Joints over time.

    Args:
        body: Whose.
        keypoints: Shoulder, elbow, wrist, hand tip (n, 4, 3) [m], all seen.

    Returns:
        (n, 14): of all postures that have these keypoints, to a millimetre or so, the one that is nearest
        to the neutral one.

    Raises:
        DataError: when something is not finite, or the shape is another.
    """
    points = np.ascontiguousarray(keypoints, dtype=float)
    if points.ndim != 3 or points.shape[1:] != (4, 3) or not np.isfinite(points).all():
        raise DataError(f"keypoints {points.shape}", expected="(n, 4, 3), all finite")
    found = np.empty((len(points), COUNT))
    start = NEUTRAL.copy()
    for row, wanted in enumerate(points):
        _solve_posture(wanted, start, NEUTRAL, _PRICE_M * _STIFFNESS, body.geometry, found[row])
        start = found[row].copy()
    return found
