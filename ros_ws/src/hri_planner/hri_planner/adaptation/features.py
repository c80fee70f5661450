"""The five inputs of parameter adaptation as a vector (section 6.4.7)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hri_planner.ptomp.situation import Situation

FloatArray = NDArray[np.float64]

_REACH = 3.0  # standard deviations

FEATURES = {
    "uncertainty": "m",
    "error": "m",
    "distance": "m",
    "time_to_collision": "s",
    "collision_cost": "log(1 + cost)",
}
"""Names and units, in the order of the vector."""
FAR_M = 2.0
"""Distances beyond this are this: people who are far, or not there, make no difference [m]."""


def vector(situation: Situation) -> FloatArray:
    """The inputs (5,) in the order of :data:`FEATURES`.

    Costs range over several powers of ten; their logarithm is what a model can follow.
    """
    return np.array(
        [
            situation.uncertainty,
            situation.error,
            min(situation.distance, FAR_M),
            situation.time_to_collision,
            math.log1p(max(situation.collision_cost, 0.0)),
        ]
    )


@dataclass(frozen=True)
class Scaling:
    """Brings vectors to mean 0 and standard deviation 1 of those it was made from.

    Attributes:
        center: (5,).
        scale: (5,), positive.
    """

    center: FloatArray
    scale: FloatArray

    @classmethod
    def of(cls, features: FloatArray) -> Scaling:
        """Made from vectors (n, 5); what never differs among them is not scaled."""
        spread = features.std(axis=0)
        return cls(features.mean(axis=0), np.where(spread > 1e-12, spread, 1.0))

    def __call__(self, features: FloatArray) -> FloatArray:
        """Scaled vectors (..., 5), within three standard deviations: models do not go far beyond.

        A situation that training never saw is taken for the most extreme that it knows.
        """
        return np.clip((features - self.center) / self.scale, -_REACH, _REACH)
