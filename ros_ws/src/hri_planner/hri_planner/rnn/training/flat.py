"""Weights as one vector and back, in the order of their names."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


def flatten(arrays: Mapping[str, FloatArray]) -> FloatArray:
    """All numbers, array by array."""
    return np.concatenate([np.ravel(arrays[name]) for name in sorted(arrays)])


def unflatten(vector: FloatArray, like: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
    """Arrays of the shapes of others."""
    found, begin = {}, 0
    for name in sorted(like):
        end = begin + like[name].size
        found[name] = vector[begin:end].reshape(like[name].shape)
        begin = end
    return found
