"""What the predictor says, and how elbow and wrist become a whole arm."""

from __future__ import annotations

import enum
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


REACH_SLACK = 1.15
"""Lengths may be this much larger than they look now: tracking noise, a shoulder that moves along."""


class ReachState(enum.IntEnum):
    """What the person is doing."""

    IDLE = 0
    REACHING = 1
    INVALID = 2


@dataclass(frozen=True)
class Prediction:
    """Predicted distribution of one arm, keypoints shoulder, elbow, wrist, hand tip.

    Never holds NaN. In the state INVALID the mean is the last known arm.

    Args:
        stamp_ns: Capture time of the newest sample used.
        state: What the person is doing.
        reason: Why the state is INVALID, or what is wrong with the newest samples; else empty.
        side: "left" or "right".
        times_s: (K,) offsets from ``stamp_ns``, uniform, from 0.
        mean: (K, 4, 3) metres, world frame.
        covariance: (K, 4, 3, 3) square metres; of what a sensor will see, noise included.
        onset_ns: When the arm left its rest, estimated once a reach; 0 unless REACHING.
        duration_mean_s: Expected duration from rest to rest, 0 when there is no reach.
        duration_std_s: Its standard deviation.
        task_names: Names of the tasks, the last one "unknown"; empty without a library.
        task_probabilities: (n,) probabilities, summing to one; unless REACHING those before any sample.
    """

    stamp_ns: int
    state: ReachState
    reason: str
    side: str
    times_s: Array
    mean: Array
    covariance: Array
    onset_ns: int
    duration_mean_s: float
    duration_std_s: float
    task_names: tuple[str, ...]
    task_probabilities: Array


def rotated_along(vector: Array, start: Array, directions: Array) -> Array:
    """Rotate ``vector`` (3,) as ``start`` (3,) turns into each of ``directions`` (K, 3).

    The shortest rotation (Rodrigues) is used; its length is kept. Where a direction is undefined
    or opposite to the start, the vector stays as it is.
    """
    norms = np.linalg.norm(directions, axis=1)
    length = float(np.linalg.norm(start))
    if length < 1e-9:
        return np.broadcast_to(vector, directions.shape).copy()
    unit = start / length
    target = directions / np.maximum(norms, 1e-9)[:, None]
    axis = -target @ _crossing(unit)
    cosine = target @ unit
    usable = (norms > 1e-9) & (cosine > -0.999)
    crossed = axis @ _crossing(vector)
    twice = axis * (axis @ vector)[:, None] - vector * np.sum(axis * axis, axis=1)[:, None]
    turned = vector + crossed + twice / np.maximum(1.0 + cosine, 1e-9)[:, None]
    rotated: Array = np.where(usable[:, None], turned, vector)
    return rotated


def _crossing(vector: Array) -> Array:
    """Matrix M with a M = a x ``vector`` for rows a; for a few rows, faster than ``numpy.cross``."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def within_reach(shoulder: Array, elbow_wrist: Array, upper_arm: float, forearm: float) -> Array:
    """Predicted points, drawn towards the shoulder where no arm could reach them.

    Extrapolation knows no anatomy: after a fault in the data, or late in the horizon, it may leave the
    arm's reach.

    Args:
        shoulder: (3,) shoulder, metres.
        elbow_wrist: (K, 2, 3) predicted positions.
        upper_arm: Shoulder to elbow now, metres.
        forearm: Elbow to wrist now, metres.

    Returns:
        (K, 2, 3), of which none is further than REACH_SLACK times the lengths from the shoulder.
    """
    limits = REACH_SLACK * np.array([upper_arm, upper_arm + forearm])
    offsets = elbow_wrist - shoulder
    distances = np.linalg.norm(offsets, axis=2)
    scale = np.minimum(1.0, limits / np.maximum(distances, 1e-9))
    result: Array = shoulder + scale[..., None] * offsets
    return result


def whole_arm(
    shoulder: Array,
    elbow_wrist: Array,
    covariance: Array,
    hand: Array,
    forearm: Array,
    shoulder_sd: float,
    hand_sd: float,
) -> tuple[Array, Array]:
    """Add shoulder and hand tip.

    Args:
        shoulder: (3,) last seen shoulder.
        elbow_wrist: (K, 2, 3) predicted positions.
        covariance: (K, 2, 3, 3) of them.
        hand: (3,) last seen vector from wrist to hand tip.
        forearm: (3,) vector from elbow to wrist at that time.
        shoulder_sd: Standard deviation of the shoulder, metres.
        hand_sd: Standard deviation that the hand tip has beyond the wrist's.

    Returns:
        mean (K, 4, 3) and covariance (K, 4, 3, 3).
    """
    points = elbow_wrist.shape[0]
    mean = np.empty((points, 4, 3))
    mean[:, 0] = shoulder
    mean[:, 1:3] = elbow_wrist
    direction = elbow_wrist[:, 1] - elbow_wrist[:, 0]
    mean[:, 3] = elbow_wrist[:, 1] + rotated_along(hand, forearm, direction)
    full = np.empty((points, 4, 3, 3))
    full[:, 0] = np.eye(3) * shoulder_sd**2
    full[:, 1:3] = covariance
    full[:, 3] = covariance[:, 1] + np.eye(3) * hand_sd**2
    return mean, full
