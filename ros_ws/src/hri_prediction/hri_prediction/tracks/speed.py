r"""Speed of noisy positions: the slope of a regression line, freed of what noise adds to it.

Raw differences are useless: 2 mm of noise at 250 Hz reads as 0.7 m/s. A regression over a short window
is calmer, and what noise adds to the norm of its slope is known from the residuals of the same line:

.. math:: \hat v^2 = \max(0, |b|^2 - \operatorname{tr} \operatorname{Cov}(b))
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from hri_prediction.compiled import njit

Array = NDArray[np.float64]


@njit
def regression_speed(times: Array, points: Array) -> float:
    """Speed (m/s) of the line through ``points`` (n, 3) at ``times`` (n,), noise removed.

    NaN with fewer than 4 samples or no spread of times. The variance of the slope is estimated
    from the residuals. They hold curvature too, but its share is small for short windows.
    """
    count = times.shape[0]
    if count < 4:
        return math.nan
    mid = 0.0
    for i in range(count):
        mid += times[i]
    mid /= count
    spread = 0.0
    for i in range(count):
        spread += (times[i] - mid) ** 2
    if spread <= 0.0:
        return math.nan
    square = 0.0
    variance = 0.0
    for d in range(points.shape[1]):
        level = 0.0
        slope = 0.0
        for i in range(count):
            level += points[i, d]
            slope += (times[i] - mid) * points[i, d]
        level /= count
        slope /= spread
        rest = 0.0
        for i in range(count):
            rest += (points[i, d] - level - slope * (times[i] - mid)) ** 2
        square += slope * slope
        variance += rest / (count - 2) / spread
    return math.sqrt(max(0.0, square - variance))
