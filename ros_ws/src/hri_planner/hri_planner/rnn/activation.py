"""Activation functions of the cells."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

TRIPLE_SCALE = 4.0
TRIPLE_OFFSETS = (-2.0, 0.0, 2.0)


def sigmoid(x: FloatArray) -> FloatArray:
    """Logistic function, without overflow."""
    return 0.5 * (np.tanh(0.5 * x) + 1.0)


def triple_tanh(x: FloatArray) -> FloatArray:
    """Triple-tanh (eq. 5.11): the mean of tanh(4 (x - p)), p = -2, 0, 2.

    Four plateaus, at ±1 and ±1/3, between which it is steep: a state may rest at either.
    """
    parts = [np.tanh(TRIPLE_SCALE * (x - offset)) for offset in TRIPLE_OFFSETS]
    found: FloatArray = sum(parts[1:], parts[0]) / len(parts)
    return found
