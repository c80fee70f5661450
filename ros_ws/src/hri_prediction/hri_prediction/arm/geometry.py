"""The arm as four keypoints and three capsules.

Every module speaks of an arm as the points shoulder, elbow, wrist and hand tip (in this order) and,
where volume matters, as three capsules: upper arm, forearm and hand (wrist to hand tip).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hri_prediction.errors import ConfigError, DataError, shown

KEYPOINTS = ("shoulder", "elbow", "wrist", "hand_tip")
"""Order of the keypoints along axis -2 of every ``(..., 4, 3)`` array."""

SIDES = ("left", "right")
"""The two values of a ``side``."""

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class ArmRadii:
    """Radii of the three capsules around an arm.

    Attributes:
        upper: Radius around the shoulder-elbow segment [m].
        forearm: Radius around the elbow-wrist segment [m].
        hand: Radius around the wrist-hand tip segment [m].

    Raises:
        ConfigError: when a radius is not finite and positive.
    """

    upper: float = 0.05
    forearm: float = 0.04
    hand: float = 0.05

    def __post_init__(self) -> None:
        """Check the values."""
        for name in ("upper", "forearm", "hand"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise ConfigError(f"ArmRadii.{name} = {value!r}", expected="a positive length in m")

    @property
    def array(self) -> FloatArray:
        """The radii, shape (3,) [m], in the order of :func:`arm_capsules`."""
        return np.array([self.upper, self.forearm, self.hand])


def arm_capsules(keypoints: ArrayLike) -> FloatArray:
    """Axes of the three capsules of an arm.

    Args:
        keypoints: Points of one or more arms, shape (..., 4, 3) [m], any frame.

    Returns:
        Segments shoulder-elbow, elbow-wrist, wrist-hand tip as (start, end), shape (..., 3, 2, 3)
        [m], in the same frame. NaN keypoints give NaN ends.

    Raises:
        DataError: when the last two axes are not (4, 3).
    """
    points = np.asarray(keypoints, dtype=np.float64)
    if points.ndim < 2 or points.shape[-2:] != (4, 3):
        raise DataError(f"keypoints have shape {points.shape}", expected="(..., 4, 3)")
    return np.stack((points[..., :-1, :], points[..., 1:, :]), axis=-2)


def check_side(side: object) -> None:
    """Raise :class:`DataError` unless ``side`` is ``"left"`` or ``"right"``."""
    if side not in SIDES:
        raise DataError(f"side = {shown(side)}", expected="left or right")
