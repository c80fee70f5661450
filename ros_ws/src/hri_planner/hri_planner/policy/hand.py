"""The tool as a policy moves it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hri_prediction.errors import DataError

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class HandState:
    """Of the tool that a policy moves, and of the policy.

    Attributes:
        position: Shape (3,) [m].
        velocity: Shape (3,) [m/s].
        acceleration: What was held until now (3,) [m/s²].
        filtered: Whether a filter had changed it.
        memory: What the policy remembers.
        wanted: What the policy asked for last (3,) [m/s²].
        count: Control steps since it was asked.
    """

    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    filtered: bool
    memory: FloatArray
    wanted: FloatArray
    count: int


def hand_at(position: ArrayLike, velocity: ArrayLike, memory: FloatArray) -> HandState:
    """A hand somewhere, whose policy is asked at the next step.

    Args:
        position: Shape (3,) [m].
        velocity: Shape (3,) [m/s].
        memory: What the policy remembers.

    Raises:
        DataError: when position or velocity is not finite.
    """
    place, speed = np.array(position, dtype=float), np.array(velocity, dtype=float)
    for values in (place, speed):
        if values.shape != (3,) or not np.isfinite(values).all():
            raise DataError(
                f"hand at {place}, velocity {speed}", expected="three finite numbers each"
            )
    return HandState(place, speed, np.zeros(3), False, memory, np.zeros(3), 0)
