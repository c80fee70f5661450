"""Dynamic time warping, as a sum of Euclidean distances along the cheapest way (table 5.3).

Not the root of a sum of squares, which some libraries compute by default.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hri_prediction.compiled import njit

FloatArray = NDArray[np.float64]


@njit
def _warped(first: Any, second: Any) -> float:
    n, m = first.shape[0], second.shape[0]
    before, row = np.full(m + 1, np.inf), np.full(m + 1, np.inf)
    before[0] = 0.0
    for i in range(n):
        row[0] = np.inf
        for j in range(m):
            squares = 0.0
            for k in range(first.shape[1]):
                apart = first[i, k] - second[j, k]
                squares += apart * apart
            row[j + 1] = np.sqrt(squares) + min(before[j + 1], row[j], before[j])
        before, row = row, before
    return float(before[m])


def warped_distance(first: FloatArray, second: FloatArray) -> float:
    """Distance of two paths (n, d) and (m, d), in their unit."""
    return float(_warped(np.ascontiguousarray(first), np.ascontiguousarray(second)))


def distances(made: Sequence[FloatArray], human: Sequence[FloatArray]) -> FloatArray:
    """Of each made path to each human one (len(made), len(human))."""
    return np.array([[warped_distance(one, other) for other in human] for one in made])


@dataclass(frozen=True)
class Likeness:
    """How made paths compare with human ones.

    Attributes:
        sample: Mean distance of a made path to the human one next to it (the thesis' measure, which
            rewards paths that are all alike).
        sample_sd: Its standard deviation.
        paired: Mean distance to the human path in the same situation.
        coverage: Share of the human paths that are the nearest of some made one.
    """

    sample: float
    sample_sd: float
    paired: float
    coverage: float


def likeness(made: Sequence[FloatArray], human: Sequence[FloatArray]) -> Likeness:
    """Compare paths; the i-th of both belong to the same situation."""
    found = distances(made, human)
    nearest = found.min(axis=1)
    return Likeness(
        sample=float(nearest.mean()),
        sample_sd=float(nearest.std()),
        paired=float(np.diagonal(found).mean()),
        coverage=len(np.unique(found.argmin(axis=1))) / len(human),
    )
