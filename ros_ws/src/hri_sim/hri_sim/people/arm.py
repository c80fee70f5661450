"""Posture of a seated person's arm for a place of the hand tip.

The arm has seven joints and the hand tip three coordinates, so four choices are left. Here they are
made by rule: the shoulder stays, the wrist keeps a slight bend in the plane of the arm, the hand
does not twist out of it, and the elbow hangs at a swivel angle from straight down, about the line
from shoulder to hand tip (Korein 1985). Wrist bend and swivel are those of people: over the 200
reaches of the ADL Vicon data, the medians are 15 degrees of bend and 10-21 degrees of swivel
outwards.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from hri_prediction.arm.geometry import FloatArray

WRIST_BEND = math.radians(15.0)
"""Angle between forearm and hand, the hand bent downwards [rad]."""

FULL_STRETCH = 0.99
"""Largest share of the full length at which the arm is used: people do not lock their elbows."""

SHOULDER_BREADTH = 0.38
"""Distance of a person's two shoulder joints [m]: biacromial breadth, between women's and men's means."""

_BACKWARDS = np.array([1.0, 0.0, 0.0])  # the person looks along -x


@dataclass(frozen=True)
class ArmModel:
    """One arm of a person who sits across the table, looking along -x.

    Attributes:
        side: ``"right"`` or ``"left"``; the right arm is on the +y side.
        shoulder: Shoulder, world frame [m].
        upper_arm: Shoulder to elbow [m].
        forearm: Elbow to wrist [m].
        hand: Wrist to hand tip [m].
    """

    side: str
    shoulder: tuple[float, float, float]
    upper_arm: float
    forearm: float
    hand: float

    @property
    def lower(self) -> float:
        """Elbow to hand tip, over the bent wrist [m]."""
        bend = 2.0 * self.forearm * self.hand * math.cos(WRIST_BEND)
        return math.sqrt(self.forearm**2 + self.hand**2 + bend)

    @property
    def reach(self) -> tuple[float, float]:
        """Smallest and largest distance of the hand tip from the shoulder [m]."""
        folded = abs(self.upper_arm - self.lower)
        return folded / FULL_STRETCH, FULL_STRETCH * (self.upper_arm + self.lower)

    def can_reach(self, points: ArrayLike) -> bool:
        """Whether the hand tip gets to all points (..., 3) [m], world frame."""
        distance = np.linalg.norm(np.asarray(points, dtype=float) - self.shoulder, axis=-1)
        low, high = self.reach
        return bool(np.all((distance >= low) & (distance <= high)))

    def posture(self, hand_tip: ArrayLike, swivel: ArrayLike) -> FloatArray:
        """Keypoints of the arm.

        Args:
            hand_tip: Places of the hand tip, shape (..., 3) [m], world frame. A place out of reach
                is replaced by the nearest one within reach, seen from the shoulder.
            swivel: Swivel of the elbow outwards from straight down, shape (...) [rad].

        Returns:
            Shoulder, elbow, wrist, hand tip, shape (..., 4, 3) [m]. The lengths of the limbs hold
            exactly.
        """
        shoulder = np.asarray(self.shoulder, dtype=float)
        offset = np.asarray(hand_tip, dtype=float) - shoulder
        distance = np.sqrt((offset * offset).sum(axis=-1, keepdims=True))
        axis = offset / np.maximum(distance, 1e-9)
        low, high = self.reach
        distance = np.minimum(np.maximum(distance, low), high)
        tip = shoulder + distance * axis
        out, down = self._elbow_directions(axis)
        angle = np.asarray(swivel, dtype=float)[..., None]
        aside = np.cos(angle) * down + np.sin(angle) * out
        along = (distance**2 + self.upper_arm**2 - self.lower**2) / (2.0 * distance)
        height = np.sqrt(np.maximum(self.upper_arm**2 - along**2, 0.0))
        elbow = shoulder + along * axis + height * aside
        # In the arm's plane, in the basis (axis, aside): the elbow-tip line and its upper normal.
        forth = ((distance - along) * axis - height * aside) / self.lower
        up = (-height * axis - (distance - along) * aside) / self.lower
        sine = self.hand * math.sin(WRIST_BEND) / self.lower
        wrist = elbow + self.forearm * (math.sqrt(1.0 - sine**2) * forth + sine * up)
        found = np.empty((*elbow.shape[:-1], 4, 3))
        for number, point in enumerate((shoulder, elbow, wrist, tip)):
            found[..., number, :] = point
        return found

    def _elbow_directions(self, axis: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Outwards and downwards, perpendicular to the line from shoulder to hand tip."""
        down = axis * axis[..., 2:3] - np.array([0.0, 0.0, 1.0])
        length = np.sqrt((down * down).sum(axis=-1, keepdims=True))
        # With the hand straight below the shoulder, the elbow goes backwards.
        down = np.where(length > 1e-6, down / np.maximum(length, 1e-6), _BACKWARDS)
        sign = 1.0 if self.side == "right" else -1.0
        out = np.empty_like(axis)  # down x axis; np.cross takes ten times as long for one arm
        for k in range(3):
            a, b = (k + 1) % 3, (k + 2) % 3
            out[..., k] = down[..., a] * axis[..., b] - down[..., b] * axis[..., a]
        return sign * out, down
