"""Calibration online: predictions are compared with what came, and widened where they were too sure.

A library that does not fit its person (other movements, pauses, another pace) makes regions too narrow.
Of every prediction some horizons are kept until their time has come; the factor on the covariance then
rises by ``rate * 0.95`` (in its logarithm) when the wrist was outside of the 95 % region, and falls by
``rate * 0.05`` when it was inside (adaptive conformal inference: Gibbs and Candès, "Adaptive conformal
inference under distribution shift", NeurIPS 2021). So in the long run 95 % of what is compared is inside,
whatever the movements are, where these hold:

* The factor stays within its bounds. It never falls below one, since a few good reaches do not show that
  regions may be narrower (those of a model that is too careful hold more than 95 %), and never rises
  above ``largest``: errors ten times the claimed ones at its default of 100.
* The person stays, and reaches for some seconds: a new one begins at one.
* There is a library, and a reach has been noticed. Nothing else is compared or widened.
* Errors change slowly. What came of a horizon is known only when it is over, 1 s later for the longest.

The position now is not widened, and horizons beyond the longest share its factor. The wrist decides; the
elbow's covariance takes the wrist's factor.

Many predictions wait at the same time, but they cannot drive the factor too far together: each is held
against the factor of when its time comes, so that there is no further rise once that is large enough.
"""

from __future__ import annotations

import math
from collections import deque

import numpy as np
from numpy.typing import NDArray

from hri_prediction.prediction.live_scores import REGION_95, LiveScores
from hri_prediction.tracks.segmentation import ROUNDING_S

Array = NDArray[np.float64]

LEVEL = 0.95
SCORED_S = (0.1, 0.2, 0.5)
"""Horizons of which scores are kept, as in the evaluation offline [s]."""
_LONGEST_GAP_S = 0.15
"""Over longer gaps between samples nobody knows where the wrist was [s]."""


class OnlineCalibration:
    """Factors on the covariances of predicted wrist positions, one a horizon.

    Args:
        step_s: Distance of the horizons that are compared [s].
        count: Number of horizons; the longest is ``count * step_s``.
        rate: How fast the factors follow; 0 keeps them at one.
        largest: Largest factor.

    Attributes:
        scores: What came of the predictions at those of `SCORED_S` that are compared.
    """

    def __init__(self, step_s: float, count: int, rate: float, largest: float) -> None:
        self.step_s, self.count = step_s, count
        self._rate = rate
        self._limit = math.log(largest)
        self._horizons = np.arange(1, count + 1) * step_s
        self._scored = {
            k: horizon
            for horizon in SCORED_S
            for k in range(count)
            if abs(self._horizons[k] - horizon) < ROUNDING_S
        }
        self.reset()

    def reset(self) -> None:
        """Forget the person."""
        self._logs = np.zeros(self.count)
        self.scores = LiveScores()
        self.forget_pending()

    def forget_pending(self) -> None:
        """Drop predictions whose time has not come; the factors stay."""
        self._pending: list[deque[tuple[float, Array, Array, float]]] = [
            deque() for _ in range(self.count)
        ]
        self._before: tuple[float, Array] | None = None

    def predicted(self, now_s: float, mean: Array, covariance: Array) -> None:
        """Keep a prediction until its times have come.

        Args:
            now_s: Its time [s].
            mean: Wrist at ``now_s + (k + 1) step_s`` (count, 3) [m].
            covariance: Before any factor (count, 3, 3) [m²].
        """
        for k, waiting in enumerate(self._pending):
            due_s = now_s + float(self._horizons[k])
            waiting.append((due_s, mean[k], covariance[k], math.exp(self._logs[k])))

    def seen(self, now_s: float, wrist: Array) -> None:
        """Compare what is due with the wrist (3,) [m] that was seen at ``now_s``."""
        if self._before is not None:
            begin_s, begin = self._before
            for k, waiting in enumerate(self._pending):
                while waiting and waiting[0][0] <= now_s + ROUNDING_S:
                    due_s, mean, covariance, factor = waiting.popleft()
                    if (
                        due_s < begin_s - ROUNDING_S
                        or now_s - begin_s > _LONGEST_GAP_S + ROUNDING_S
                    ):
                        continue  # the wrist was not seen then
                    share = (due_s - begin_s) / (now_s - begin_s)
                    error = begin + share * (wrist - begin) - mean
                    if k in self._scored:
                        self.scores.add(self._scored[k], error, factor * covariance)
                    self._adapt(k, error, covariance)
        self._before = (now_s, wrist.copy())

    def _adapt(self, k: int, error: Array, covariance: Array) -> None:
        square = float(error @ np.linalg.solve(covariance, error))
        missed = square > math.exp(self._logs[k]) * REGION_95
        step = self._rate * (LEVEL if missed else LEVEL - 1.0)
        self._logs[k] = min(max(self._logs[k] + step, 0.0), self._limit)

    def factors(self, times_s: Array) -> Array:
        """Factors on the covariance at horizons (K,) [s]: one at none, level beyond the longest."""
        logs = np.interp(times_s, np.r_[0.0, self._horizons], np.r_[0.0, self._logs])
        return np.asarray(np.exp(logs))
