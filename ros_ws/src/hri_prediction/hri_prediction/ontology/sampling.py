"""Movements around a movement that are about as smooth as it is.

Drawn from N(ξ, σ R⁻¹), R = KᵀK with K third differences (Kalakrishnan et al. 2013: differences of some
order; of the third order the samples are of least jerk), begin and end fixed; of its longest waves alone.
All waves are as rough as each other, but the k-th is only some k⁻⁶ of the variance of where a movement
goes: with all of them everything that is drawn is rougher than the movement by nearly the same amount, and
smoothness alone explains what people did.
"""

from __future__ import annotations

import functools

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cholesky_banded, eig_banded, solve_banded

from hri_prediction.errors import DataError

FloatArray = NDArray[np.float64]

WAVES = 4
"""Longest waves that movements are drawn of: more than 99 % of the variance of where they go."""
_HALVINGS = 12


BEYOND = 3
"""So many points beyond each end belong to third differences."""


def third_differences(
    points: FloatArray, beyond: tuple[FloatArray, FloatArray] | None = None
) -> FloatArray:
    """Third differences along the first axis (n, ...) → (n + 3, ...).

    Args:
        points: Of a movement.
        beyond: The three points before it, and those after it, alike in all else (3, ...); none: rest.
    """
    if beyond is None:
        before, after = points[:1], points[-1:]
    else:
        before, after = beyond
    shape = (BEYOND, *points.shape[1:])
    ends = (np.broadcast_to(each, shape) for each in (before, after))
    first, last = ends
    return np.diff(np.concatenate((first, points, last)), BEYOND, axis=0)


def _roughness(count: int) -> FloatArray:
    """R of the points between fixed ends, upper diagonals as banded solvers take them (4, count)."""
    rows = np.zeros((count + 3, count))
    for k, value in enumerate((1.0, -3.0, 3.0, -1.0)):
        rows[np.arange(count) + 3 - k, np.arange(count)] = value
    full = rows.T @ rows
    banded = np.zeros((4, count))
    for k in range(4):
        banded[3 - k, k:] = np.diagonal(full, k)
    return banded


@functools.lru_cache(maxsize=64)
def bends(count: int) -> FloatArray:
    """What movements of least jerk are made of: columns (count, count) whose products sum to R⁻¹.

    Scaled so that the largest deviation of what they make of white noise is 1.

    Args:
        count: Points between the ends.
    """
    found: FloatArray = solve_banded((0, 3), cholesky_banded(_roughness(count)), np.eye(count))
    return _scaled(found)


@functools.lru_cache(maxsize=64)
def long_waves(count: int) -> FloatArray:
    """The same of its :data:`WAVES` longest waves, or as many as there are: (count, waves)."""
    last = min(WAVES, count) - 1
    rough, waves = eig_banded(_roughness(count), select="i", select_range=(0, last))
    return _scaled(waves / np.sqrt(rough))


def _scaled(columns: FloatArray) -> FloatArray:
    # Variances are the sums of the squares of the rows.
    found = columns / np.sqrt((columns**2).sum(axis=1).max())
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
        limits: Least and greatest value of each joint (j,): what is beyond is halved towards the movement
            until it is not, twelve times at most: where the movement is at a limit itself, what would go
            beyond stays so by 1/4096 of what was drawn. One that is beyond is not held to them.

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
    waves = long_waves(inner)
    aside = waves @ rng.standard_normal((waves.shape[1], count * path.shape[1]))
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
