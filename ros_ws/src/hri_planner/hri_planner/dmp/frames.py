"""The frame of a way: x from start to goal, z upwards; weights carried from one way to another."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

_UPRIGHT = 0.99
"""Cosine to the vertical above which a way has no heading of its own."""


def way_frame(start: FloatArray, goal: FloatArray) -> FloatArray:
    """Rotation (3, 3), whose columns are the frame's axes; the identity where there is no way."""
    way = np.asarray(goal, dtype=float) - start
    length = float(np.linalg.norm(way))
    if length < 1e-9:
        return np.eye(3)
    x = way / length
    up = np.array((0.0, 0.0, 1.0)) if abs(x[2]) < _UPRIGHT else np.array((1.0, 0.0, 0.0))
    y = np.cross(up, x)
    y /= np.linalg.norm(y)
    return np.column_stack((x, y, np.cross(x, y)))


def carried(
    weights: FloatArray, before: tuple[FloatArray, FloatArray], now: tuple[FloatArray, FloatArray]
) -> FloatArray:
    """Weights (3, k) [m] of a way (start, goal) as those of another: turned with it, and as much longer.

    The path is then similar to the one before, but for what is up.
    """
    length = float(np.linalg.norm(before[1] - before[0]))
    scale = float(np.linalg.norm(now[1] - now[0])) / length if length > 1e-9 else 1.0
    turned: FloatArray = scale * way_frame(*now) @ way_frame(*before).T @ weights
    return turned
