"""Smooth noise: correlated normals whose accelerations are small.

With A the second difference of a sequence that is zero before its start and after its end, the
noise has covariance R^-1, R = A'A (STOMP, Kalakrishnan et al. 2011). R is pentadiagonal, so a draw
is one banded back-substitution of standard normals. As A reaches beyond both ends, R is the
Toeplitz matrix (1, -4, 6, -4, 1) for every length, and the factors of all lengths are nested
in one.
"""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hri_planner.ptomp.layout import FAST, ROW
from hri_prediction.compiled import njit

FloatArray = NDArray[np.float64]


@njit
def banded_cholesky(size: int) -> FloatArray:
    """Cholesky factor L of R: rows diagonal, first and second subdiagonal (3, size)."""
    band = np.zeros((3, size))
    for i in range(size):
        second = 1.0 / band[0, i - 2] if i >= 2 else 0.0
        first = 0.0
        if i >= 1:
            overlap = band[1, i - 2] * second if i >= 2 else 0.0
            first = (-4.0 - overlap) / band[0, i - 1]
        band[0, i] = math.sqrt(6.0 - first * first - second * second)
        if i >= 1:
            band[1, i - 1] = first
        if i >= 2:
            band[2, i - 2] = second
    return band


@njit(fastmath=FAST)
def add_smooth_noise(band: Any, normals: Any, size: int, factor: Any, rows: Any) -> None:
    """Add ``factor`` times the solutions x of L' x = z to three rows.

    Three recursions side by side: each alone would wait for its own last value.

    Args:
        band: That of :func:`smoothing_factors`: no division is left in the recursion.
        normals: Three times z (3 * size,).
        size: Length of each.
        factor: Standard deviation at the middle, times the normalisation.
        rows: (3, size), changed.
    """
    x0, x1, x2 = rows[0], rows[1], rows[2]
    z0, z1, z2 = normals[:size], normals[size:], normals[2 * size :]
    scale, first, second = band[0], band[1], band[2]
    zero = rows.dtype.type(0.0)
    a0, a1, a2, b0, b1, b2 = zero, zero, zero, zero, zero, zero
    for k in range(size):
        i = size - 1 - k
        d, f, g = scale[i], first[i], second[i]
        # The newest value enters last, so that only one operation waits for it.
        y0 = (z0[i] * d - g * b0) - f * a0
        y1 = (z1[i] * d - g * b1) - f * a1
        y2 = (z2[i] * d - g * b2) - f * a2
        x0[i] += factor * y0
        x1[i] += factor * y1
        x2[i] += factor * y2
        b0, b1, b2 = a0, a1, a2
        a0, a1, a2 = y0, y1, y2


@njit
def _largest_deviation(band: FloatArray, size: int) -> float:
    """Standard deviation of the noise at the middle of a sequence, its largest."""
    middle = size // 2
    forward = np.zeros(size)
    squared = 0.0
    for i in range(middle, size):
        value = 1.0 if i == middle else 0.0
        if i >= 1:
            value -= band[1, i - 1] * forward[i - 1]
        if i >= 2:
            value -= band[2, i - 2] * forward[i - 2]
        forward[i] = value / band[0, i]
        squared += forward[i] * forward[i]
    return math.sqrt(squared)


@functools.cache
def smoothing_factors() -> tuple[FloatArray, FloatArray]:
    """Factors for back-substitution at all lengths, and the noise's normalisation.

    Returns:
        (3, ROW): 1 / diagonal of L, and its first and second subdiagonal divided by the diagonal of
        the same column; and 1 / largest standard deviation by length (ROW + 1,).
    """
    band = banded_cholesky(ROW)
    scale = np.zeros(ROW + 1)
    for size in range(1, ROW + 1):
        scale[size] = 1.0 / _largest_deviation(band, size)
    scaled = np.stack((1.0 / band[0], band[1] / band[0], band[2] / band[0]))
    scaled.setflags(write=False)
    scale.setflags(write=False)
    return scaled, scale
