"""How good the predictions of the last seconds were, by what came: the evaluation while it runs."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

KEPT = 500
"""Comparisons that are kept, of each horizon."""
REGION_50 = 2.3659738843753377
"""50 % quantile of the chi-square distribution with three degrees of freedom."""
REGION_95 = 7.814727903251179
"""Its 95 % quantile."""
_LOG_2PI = math.log(2.0 * math.pi)


@dataclass(frozen=True)
class LiveFigures:
    """Figures of the wrist at one horizon, over the newest comparisons.

    Attributes:
        n: How many comparisons.
        error_median_m: Median distance between prediction and wrist [m].
        error_mean_m: Mean distance [m].
        coverage50: Share within the 50 % region.
        coverage95: Share within the 95 % region.
        nll: Mean negative log density [nats, of metres].
    """

    n: int
    error_median_m: float
    error_mean_m: float
    coverage50: float
    coverage95: float
    nll: float


class LiveScores:
    """The newest comparisons of predicted and seen wrist positions, by horizon."""

    def __init__(self) -> None:
        self._rows: dict[float, deque[tuple[float, float, float]]] = {}

    def add(self, horizon_s: float, error: Array, covariance: Array) -> None:
        """Note what came of a prediction.

        Args:
            horizon_s: How far ahead it was made [s].
            error: What was seen less what was predicted (3,) [m].
            covariance: As published (3, 3) [m²].
        """
        factor = np.linalg.cholesky(covariance)
        white = np.linalg.solve(factor, error)
        square = float(white @ white)
        log_det = 2.0 * float(np.log(np.diagonal(factor)).sum())
        rows = self._rows.setdefault(horizon_s, deque(maxlen=KEPT))
        nll = 0.5 * (square + log_det + 3.0 * _LOG_2PI)
        rows.append((float(np.linalg.norm(error)), square, nll))

    def figures(self) -> dict[float, LiveFigures]:
        """Figures by horizon [s], in increasing order; none of one at which nothing was due yet."""
        found = {}
        for horizon_s in sorted(self._rows):
            error, square, nll = np.array(self._rows[horizon_s]).T
            found[horizon_s] = LiveFigures(
                n=error.size,
                error_median_m=float(np.median(error)),
                error_mean_m=float(error.mean()),
                coverage50=float(np.mean(square <= REGION_50)),
                coverage95=float(np.mean(square <= REGION_95)),
                nll=float(nll.mean()),
            )
        return found
