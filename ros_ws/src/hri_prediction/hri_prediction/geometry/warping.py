"""Dynamic time warping of paths, as a sum of Euclidean distances along the cheapest way.

Not the root of a sum of squares, which some libraries compute by default.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hri_prediction.compiled import njit
from hri_prediction.errors import DataError

Array = NDArray[np.float64]


@njit
def _apart(first: Any, second: Any, i: int, j: int) -> float:
    squares = 0.0
    for k in range(first.shape[1]):
        apart = first[i, k] - second[j, k]
        squares += apart * apart
    return float(np.sqrt(squares))


@njit
def _warped(first: Any, second: Any) -> float:
    n, m = first.shape[0], second.shape[0]
    before, row = np.full(m + 1, np.inf), np.full(m + 1, np.inf)
    before[0] = 0.0
    for i in range(n):
        row[0] = np.inf
        for j in range(m):
            row[j + 1] = _apart(first, second, i, j) + min(before[j + 1], row[j], before[j])
        before, row = row, before
    return float(before[m])


@njit
def _path(first: Any, second: Any, pairs: Any) -> tuple[float, int]:
    """Distance, and how many pairs of indices were written to ``pairs`` (n + m, 2), from the end on."""
    n, m = first.shape[0], second.shape[0]
    sums = np.empty((n + 1, m + 1))
    sums[0, :] = np.inf
    sums[:, 0] = np.inf
    sums[0, 0] = 0.0
    for i in range(n):
        for j in range(m):
            sums[i + 1, j + 1] = _apart(first, second, i, j) + min(
                sums[i, j], sums[i, j + 1], sums[i + 1, j]
            )
    i, j, count = n, m, 0
    while i > 0:
        pairs[count, 0], pairs[count, 1] = i - 1, j - 1
        count += 1
        least = min(sums[i - 1, j - 1], sums[i - 1, j], sums[i, j - 1])
        if sums[i - 1, j - 1] == least:
            i, j = i - 1, j - 1
        elif sums[i - 1, j] == least:
            i -= 1
        else:
            j -= 1
    return float(sums[n, m]), count


def _checked(first: ArrayLike, second: ArrayLike) -> tuple[Array, Array]:
    """Both paths as kernels take them; these check nothing."""
    one, other = (np.array(path, dtype=float, order="C") for path in (first, second))
    if one.ndim != 2 or other.ndim != 2 or one.shape[1] != other.shape[1]:
        raise DataError(
            f"paths of shape {one.shape} and {other.shape}", expected="(n, d) and (m, d)"
        )
    if not len(one) or not len(other):
        raise DataError("a path without a point", expected="one or more points each")
    if not (np.isfinite(one).all() and np.isfinite(other).all()):
        raise DataError("a path that is not finite", expected="gaps to be left out")
    return one, other


def warped_distance(first: ArrayLike, second: ArrayLike) -> float:
    """Distance of two paths (n, d) and (m, d), in their unit.

    Raises:
        DataError: on other shapes, without a point, or with what is not finite.
    """
    return float(_warped(*_checked(first, second)))


def warping_path(first: ArrayLike, second: ArrayLike) -> tuple[float, NDArray[np.int64]]:
    """Distance of two paths (n, d) and (m, d), and which points of them are next to each other.

    Returns:
        The sum of distances, in the paths' unit, and pairs of indices (p, 2), from begin to end.

    Raises:
        DataError: as :func:`warped_distance`.
    """
    one, other = _checked(first, second)
    pairs = np.empty((len(one) + len(other), 2), dtype=np.int64)
    total, count = _path(one, other, pairs)
    return float(total), pairs[:count][::-1].copy()
