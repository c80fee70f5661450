"""Movements around a movement that are about as smooth as it is.

Drawn from N(ξ, σ R⁻¹), R = KᵀK with K third differences (Kalakrishnan et al. 2013: differences of some
order; of the third order the samples are of least jerk), begin and end fixed.
"""

from __future__ import annotations

import functools

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cholesky_banded, solve_banded

from hri_prediction.errors import DataError

FloatArray = NDArray[np.float64]

_HALVINGS = 12


def third_differences(points: FloatArray) -> FloatArray:
    """Third differences along the first axis (n, ...) → (n + 3, ...), with rest beyond both ends."""
    padded = np.concatenate(
        (np.repeat(points[:1], 3, axis=0), points, np.repeat(points[-1:], 3, axis=0))
    )
    return np.diff(padded, 3, axis=0)


@functools.lru_cache(maxsize=64)
def bends(count: int) -> FloatArray:
    """What movements of least jerk are made of: columns (count, count) whose products sum to R⁻¹.

    Scaled so that the largest deviation of what they make of white noise is 1.

    Args:
        count: Points between the ends.
    """
    rows = np.zeros((count + 3, count))
    for k, value in enumerate((1.0, -3.0, 3.0, -1.0)):
        rows[np.arange(count) + 3 - k, np.arange(count)] = value
    full = rows.T @ rows
    banded = np.zeros((4, count))
    for k in range(4):
        banded[3 - k, k:] = np.diagonal(full, k)
    found: FloatArray = solve_banded((0, 3), cholesky_banded(banded), np.eye(count))
    # Variances are the sums of the squares of the rows.
    found /= np.sqrt((found**2).sum(axis=1).max())
    found.setflags(write=False)
    return found


def draw_around(
    path: FloatArray,
    count: int,
    spread: FloatArray,
    rng: np.random.Generator,
    limits: tuple[FloatArray, FloatArray] | None = None,
) -> FloatArray:
    """Movements around one.

    Args:
        path: The movement (n, j).
        count: How many.
        spread: Standard deviation of each joint where it is largest, in the middle (j,).
        rng: Draws them.
        limits: Least and greatest value of each joint (j,): what is beyond is brought nearer to the
            movement until it is not. A movement that is itself beyond them is not held to them there.

    Returns:
        (count, n, j); begins and ends are those of the movement.

    Raises:
        DataError: when the movement has fewer than three points, or shapes do not fit.
    """
    if path.ndim != 2 or len(path) < 3 or spread.shape != path.shape[1:]:
        raise DataError(
            f"a movement {path.shape} with a spread {spread.shape}",
            expected="(n, j), n ≥ 3, and (j,)",
        )
    inner = len(path) - 2
    aside = bends(inner) @ rng.standard_normal((inner, count * path.shape[1]))
    aside = aside.reshape(inner, count, path.shape[1]).transpose(1, 0, 2) * spread
    found = np.repeat(path[None], count, axis=0)
    found[:, 1:-1] += aside
    if limits is not None:
        low = np.minimum(limits[0], path.min(axis=0)) - 1e-12
        high = np.maximum(limits[1], path.max(axis=0)) + 1e-12
        for _ in range(_HALVINGS):
            beyond = ((found < low) | (found > high)).any(axis=1)[:, None, :]
            if not beyond.any():
                break
            found = np.where(beyond, path + 0.5 * (found - path), found)
    return found
