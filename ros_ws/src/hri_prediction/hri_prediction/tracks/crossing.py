r"""When a hand that sets out from rest, or comes to rest, passes a low speed: a fit to its positions.

The speed itself is too noisy where it is low: at 0.04 m/s, 2 mm of tracking noise move its crossing by
some 30 ms. But a hand that leaves rest with finite jerk moves by :math:`c\,(t - t_0)^3`; this is fitted
to all positions around, and passes the speed :math:`v` at :math:`t_0 + \sqrt{v / 3 |c|}`.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from hri_prediction.compiled import njit

Array = NDArray[np.float64]


@njit
def rise_misfit(times: Array, points: Array, start: float) -> tuple[float, float]:
    """Sum of squares that ``x0 + c max(0, t - start)^3`` leaves, and the length of the best ``c``.

    Args:
        times: (n,) seconds.
        points: (n, 3) metres.
        start: When the motion begins [s].
    """
    count = times.shape[0]
    level = 0.0
    for i in range(count):
        level += max(0.0, times[i] - start) ** 3
    level /= count
    spread = 0.0
    for i in range(count):
        spread += (max(0.0, times[i] - start) ** 3 - level) ** 2
    misfit = 0.0
    square = 0.0
    for d in range(points.shape[1]):
        middle = 0.0
        for i in range(count):
            middle += points[i, d]
        middle /= count
        slope = 0.0
        for i in range(count):
            slope += (max(0.0, times[i] - start) ** 3 - level) * (points[i, d] - middle)
        slope = slope / spread if spread > 0.0 else 0.0
        square += slope * slope
        for i in range(count):
            rise = max(0.0, times[i] - start) ** 3 - level
            misfit += (points[i, d] - middle - slope * rise) ** 2
    return misfit, math.sqrt(square)


@njit
def rise_crossing(times: Array, points: Array, speed: float, near: float, reach: float) -> float:
    """When the motion that begins in these samples passes a speed.

    Args:
        times: (n,) seconds, increasing; at rest in the beginning.
        points: (n, 3) metres.
        speed: The speed to be passed [m/s].
        near: Where the crossing is thought to be [s].
        reach: Farthest that it may lie from there [s].

    Returns:
        Time of the crossing [s]; ``near`` where the samples do not tell.
    """
    steps = 60
    first = max(near - 3.0 * reach, times[0])
    last = min(near + reach, times[times.shape[0] - 1])
    if times.shape[0] < 8 or last <= first:
        return near
    gap = (last - first) / steps
    best, chosen = math.inf, 0
    misfits = np.empty(steps + 1)
    for k in range(steps + 1):
        misfits[k] = rise_misfit(times, points, first + k * gap)[0]
        if misfits[k] < best:
            best, chosen = misfits[k], k
    if chosen == 0 or chosen == steps:
        return near
    before, after = misfits[chosen - 1], misfits[chosen + 1]
    bend = before - 2.0 * best + after
    shift = 0.5 * (before - after) / bend if bend > 0.0 else 0.0
    start = first + (chosen + shift) * gap
    jerk = rise_misfit(times, points, start)[1]
    if jerk <= 0.0:
        return near
    found = start + math.sqrt(speed / (3.0 * jerk))
    return found if abs(found - near) <= reach else near
