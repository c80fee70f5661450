"""Whole arms of seated people, of the places of their hands."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from hri_prediction.arm.geometry import FloatArray
from hri_sim.people.arm import ArmModel

LIMBS_M = (0.29, 0.26, 0.09)
"""Upper arm, forearm and hand."""

SWIVEL = 0.25
"""Of the elbow, outwards from straight down [rad]."""

_UPRIGHT = 0.9
"""Share of the arm's reach that people use sitting upright; for places further off they lean."""

_SOFTLY_M = 0.02
"""Leaning sets in over about this much of the hand's way."""


@dataclass(frozen=True, eq=False)
class SeatedArm:
    """The right arm of a person who looks in any direction, and leans towards far places; or of many.

    Attributes:
        shoulder: Where the shoulder is when sitting upright (..., 3) [m].
        yaw: How far the person is turned from looking along -x (...) [rad].
    """

    shoulder: FloatArray
    yaw: ArrayLike

    @property
    def model(self) -> ArmModel:
        """The arm from its shoulder, of a person who looks along -x."""
        return ArmModel("right", (0.0, 0.0, 0.0), *LIMBS_M)

    def keypoints(self, hand: ArrayLike) -> FloatArray:
        """Keypoints of the arm.

        Args:
            hand: Places of the hand tip (..., 3) [m], frame of the shoulder's place; one for each person,
                where the arms are those of many.

        Returns:
            Shoulder, elbow, wrist, hand tip (..., 4, 3) [m]; the tip is where it was asked to be.
        """
        model = self.model
        offset = np.asarray(hand, dtype=float) - self.shoulder
        distance = np.linalg.norm(offset, axis=-1, keepdims=True)
        over = (distance - _UPRIGHT * model.reach[1]) / _SOFTLY_M
        lean = np.minimum(_SOFTLY_M * np.logaddexp(0.0, over), distance)
        shoulder = self.shoulder + lean * offset / np.maximum(distance, 1e-9)
        cosine, sine = np.cos(self.yaw), np.sin(self.yaw)
        turn = np.zeros((*np.shape(self.yaw), 3, 3))
        turn[..., 0, 0] = turn[..., 1, 1] = cosine
        turn[..., 0, 1], turn[..., 1, 0], turn[..., 2, 2] = -sine, sine, 1.0
        seen = np.einsum("...i,...ij->...j", np.asarray(hand, dtype=float) - shoulder, turn)
        arm = model.posture(seen, np.full(distance.shape[:-1], SWIVEL))
        found: FloatArray = np.einsum("...ki,...ji->...kj", arm, turn) + shoulder[..., None, :]
        return found
