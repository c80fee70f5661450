"""Normalisation: each group of three coordinates by one symmetric maximum, so that zero stays zero."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hri_prediction.errors import DataError

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Scales:
    """Largest absolute coordinates of the training data, which become 1.

    Attributes:
        goal: Of f_H2G [m].
        push: Of f_H2H [1/m].
        acceleration: Of the accelerations [m/s²].

    Raises:
        DataError: when one is not finite and positive.
    """

    goal: float
    push: float
    acceleration: float

    def __post_init__(self) -> None:
        """Check the values."""
        for name in ("goal", "push", "acceleration"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0.0):
                raise DataError(f"scale of {name} = {value!r}", expected="a positive number")

    @property
    def inputs(self) -> FloatArray:
        """What the six features are divided by (6,)."""
        return np.repeat((self.goal, self.push), 3)


def scales_of(inputs: ArrayLike, outputs: ArrayLike) -> Scales:
    """Scales of training data.

    Args:
        inputs: Features (n, 6).
        outputs: Accelerations (m, 3) [m/s²].

    Raises:
        DataError: when a group is zero throughout: without a partner nearby nothing can be learnt of
            partners.
    """
    seen = np.abs(np.asarray(inputs, dtype=float))
    told = float(np.max(np.abs(np.asarray(outputs, dtype=float)), initial=0.0))
    found = {
        "way to the goal": float(np.max(seen[:, :3], initial=0.0)),
        "push of the partner": float(np.max(seen[:, 3:], initial=0.0)),
        "acceleration": told,
    }
    for name, value in found.items():
        if value == 0.0:
            raise DataError(f"the {name} is zero in all training data", expected="hands that meet")
    return Scales(*found.values())
