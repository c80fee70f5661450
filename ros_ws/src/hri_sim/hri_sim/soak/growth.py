"""Whether something grows: memory by a robust slope, latency by medians of the first and the last third."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import theilslopes

FloatArray = NDArray[np.float64]

MOST_POINTS = 400
"""More points are put together by their medians: a slope looks at all pairs."""
BLOCK_S = 10.0
"""Latencies within a block depend on each other: blocks are drawn as a whole [s]."""
DRAWS = 2000
LEAST_BLOCKS = 3
"""In each third; with fewer nothing can be said."""


@dataclass(frozen=True)
class Growth:
    """How something grew.

    Attributes:
        first: Median of the first third.
        last: Median of the last third.
        share: Growth, as a share of ``first``.
        low: Lower end of its 95 % interval.
        high: Upper end.
        span_s: Over what time [s].
    """

    first: float
    last: float
    share: float
    low: float
    high: float
    span_s: float


def _binned(time_s: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    if len(values) <= MOST_POINTS:
        return time_s, values
    parts = np.array_split(np.arange(len(values)), MOST_POINTS)
    times = np.array([np.median(time_s[part]) for part in parts])
    return times, np.array([np.median(values[part]) for part in parts])


def memory_growth(time_s: FloatArray, values: FloatArray) -> Growth:
    """Growth of a process' memory over its life.

    The slope is Theil's and Sen's (the median of the slopes between all pairs of points): single peaks do
    not move it. A step may hardly do so either; so growth is what that slope makes of the whole time, or
    the difference of the medians of first and last third, whichever is more.

    Args:
        time_s: Times (N,) [s], rising; at least three.
        values: Memory (N,), in any unit.
    """
    times, points = _binned(time_s, values)
    span_s = float(time_s[-1] - time_s[0])
    slope, _, low, high = theilslopes(points, times, alpha=0.95)
    third = max(len(values) // 3, 1)
    first, last = float(np.median(values[:third])), float(np.median(values[-third:]))
    scale = span_s / first
    return Growth(
        first=first,
        last=last,
        share=max(float(slope) * scale, last / first - 1.0),
        low=float(low) * scale,
        high=float(high) * scale,
        span_s=span_s,
    )


def latency_growth(
    time_s: FloatArray, values: FloatArray, rng: np.random.Generator
) -> Growth | None:
    """Growth of the median of latencies from the first to the last third of a run.

    The interval is that of a bootstrap which draws whole blocks of :data:`BLOCK_S`.

    Args:
        time_s: When each was measured (N,) [s].
        values: Latencies (N,).
        rng: Draws blocks.

    Returns:
        None when there is too little to tell.
    """
    if not len(values):
        return None
    begin, span_s = float(time_s.min()), float(time_s.max() - time_s.min())
    thirds = []
    for inside in (time_s < begin + span_s / 3.0, time_s >= begin + 2.0 * span_s / 3.0):
        numbers = np.floor((time_s[inside] - begin) / BLOCK_S).astype(int)
        thirds.append([values[inside][numbers == number] for number in np.unique(numbers)])
    if min(map(len, thirds)) < LEAST_BLOCKS:
        return None
    first, last = (float(np.median(np.concatenate(blocks))) for blocks in thirds)
    drawn = np.array([[_drawn_median(blocks, rng) for blocks in thirds] for _ in range(DRAWS)])
    low, high = np.percentile(drawn[:, 1] / drawn[:, 0] - 1.0, (2.5, 97.5))
    return Growth(first, last, last / first - 1.0, float(low), float(high), span_s)


def _drawn_median(blocks: list[FloatArray], rng: np.random.Generator) -> float:
    chosen = rng.integers(len(blocks), size=len(blocks))
    return float(np.median(np.concatenate([blocks[index] for index in chosen])))
