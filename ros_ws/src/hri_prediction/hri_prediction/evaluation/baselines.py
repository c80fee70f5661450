r"""Simple predictors to compare with: a minimum-jerk fit, the mean trajectory, a plain ProMP.

Each learns from the same reaches as ours, tasks pooled, and comes in up to three versions:

* as named: it is told nothing. The onset is the one that the segmentation has found in the samples
  so far, the duration is the geometric mean of the training reaches (`MinimumJerk`: unknown, with
  their spread as prior).
* ``_told_duration``: true onset and true duration are given.
* ``_told_task``: the task is given as well, and it learns from reaches of this task alone.

All forecasts are Gaussians of the wrist.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from hri_prediction.errors import DataError
from hri_prediction.evaluation.observation import POINTS, Example, Observation
from hri_prediction.evaluation.replay import Forecast
from hri_prediction.geometry.minimum_jerk import minimum_jerk

Array = NDArray[np.float64]
NOISE_SD = 0.002
"""Deviation of samples from the plain ProMP, and the smallest of any forecast [m]."""
WEIGHTS = 8
"""Basis functions a dimension of the plain ProMP."""
WEIGHT_SD = 0.01
"""Added to the spread of its weights, which few reaches leave singular [m]. Of 0 and 0.01, and of 2, 5, 10
and 20 mm of noise, these give the smallest end-point errors on the ADL reaches, told the duration."""


class Baseline(Protocol):
    """A predictor that has learnt from examples."""

    def forecast(self, seen: Observation, times: Array) -> Forecast:
        """Predict the wrist at ``times`` (K,) on the clock of the track."""


def _durations(known: Sequence[Example]) -> tuple[float, float]:
    """Mean and standard deviation of the logarithm of the duration."""
    logs = np.log([e.duration_s for e in known])
    return float(logs.mean()), max(float(logs.std()), 0.1)


def _wrists(known: Sequence[Example]) -> Array:
    if not known:
        raise DataError("no reach to learn from", expected="at least one")
    return np.stack([e.values[:, 3:] for e in known])


def _scatter(points: Array) -> Array:
    """Covariance (..., 3, 3) of the next one after (N, ..., 3), with the floor of `NOISE_SD`."""
    count = len(points)
    centred = points - points.mean(axis=0)
    total = np.einsum("n...i,n...j->...ij", centred, centred)
    # The mean of so few is not known exactly either.
    share = (1.0 + 1.0 / count) / max(count - 1, 1)
    spread: Array = share * total + NOISE_SD**2 * np.eye(3)
    return spread


class MinimumJerk:
    """A straight minimum-jerk path from the observed start, its end fitted to the samples so far.

    The end point has the mean and spread of the training reaches' end points as prior; deviations
    of samples from the path have the root mean square that they have in the training. An unknown
    duration is averaged over, with the likelihood of each.

    Args:
        known: Reaches to learn from.
    """

    def __init__(self, known: Sequence[Example]) -> None:
        wrists = _wrists(known)
        self._end, self._spread = wrists[:, -1].mean(axis=0), _scatter(wrists[:, -1])
        share = minimum_jerk(np.linspace(0.0, 1.0, POINTS))[:, None]
        straight = wrists[:, :1] + share * (wrists[:, -1:] - wrists[:, :1])
        self._variance = max(float(np.mean((wrists - straight) ** 2)), NOISE_SD**2)
        mean, sd = _durations(known)
        steps = np.linspace(-2.2, 2.2, 21)
        self._grid = np.exp(mean + sd * steps)
        self._log_prior = -0.5 * steps**2

    def forecast(self, seen: Observation, times: Array) -> Forecast:
        """See :class:`Baseline`."""
        told = seen.duration_s
        grid = self._grid if told is None else np.array([told])
        log_weights = self._log_prior.copy() if told is None else np.zeros(1)
        start = seen.start
        when, points = seen.samples()
        way = points[:, 3:] - start
        prior = self._end + seen.shoulder - start
        means, spreads = [], []
        for i, duration in enumerate(grid):
            share = minimum_jerk((when - seen.onset_s) / duration)
            # All samples together say: the way to go is `fitted`, give or take `noise`.
            square = max(float(share @ share), 1e-12)
            fitted, noise = share @ way / square, self._variance / square
            innovation = fitted - prior
            total = self._spread + noise * np.eye(3)
            solved = np.linalg.solve(total, np.column_stack([innovation, self._spread]))
            mean = prior + self._spread @ solved[:, 0]
            spread = self._spread - self._spread @ solved[:, 1:]
            misfit = float(np.sum((way - share[:, None] * fitted) ** 2)) / self._variance
            misfit += float(innovation @ solved[:, 0])
            volume = float(np.linalg.slogdet(total)[1]) - 3.0 * np.log(noise)
            log_weights[i] -= 0.5 * (misfit + volume)
            ahead = minimum_jerk((times - seen.onset_s) / duration)
            means.append(start + ahead[:, None] * mean)
            spreads.append(ahead[:, None, None] ** 2 * spread + self._variance * np.eye(3))
        weights = np.exp(log_weights - log_weights.max())
        weights /= weights.sum()
        path = np.einsum("h,hki->ki", weights, np.stack(means))
        apart = np.stack(means) - path
        covariance = np.einsum("h,hkij->kij", weights, np.stack(spreads))
        covariance += np.einsum("h,hki,hkj->kij", weights, apart, apart)
        return Forecast(path, covariance)


class MeanTrajectory:
    """The mean of the training reaches over the phase; what is observed does not change it.

    Args:
        known: Reaches to learn from.
    """

    def __init__(self, known: Sequence[Example]) -> None:
        wrists = _wrists(known)
        self._mean, self._spread = wrists.mean(axis=0), _scatter(wrists)
        self._duration = float(np.exp(_durations(known)[0]))

    def forecast(self, seen: Observation, times: Array) -> Forecast:
        """See :class:`Baseline`."""
        duration = self._duration if seen.duration_s is None else seen.duration_s
        place = np.clip((times - seen.onset_s) / duration, 0.0, 1.0) * (POINTS - 1)
        lower = np.minimum(place.astype(int), POINTS - 2)
        share = (place - lower)[:, None]
        mean = self._mean[lower] + share * (self._mean[lower + 1] - self._mean[lower])
        step = self._spread[lower + 1] - self._spread[lower]
        return Forecast(seen.shoulder + mean, self._spread[lower] + share[..., None] * step)


class PlainProMP:
    """One ProMP of elbow and wrist, by the package ``movement_primitives`` (dfki-ric).

    Weights of each reach by its ridge regression, their mean and covariance (and `WEIGHT_SD`) as the
    distribution, conditioned on every sample by its ``condition_position``.

    Args:
        known: Reaches to learn from.

    Raises:
        ImportError: when the package is not installed.
    """

    def __init__(self, known: Sequence[Example]) -> None:
        from movement_primitives.promp import ProMP

        phases = np.linspace(0.0, 1.0, POINTS)
        self._promp: Any = ProMP(6, WEIGHTS)
        weights = np.stack([self._promp.weights(phases, e.values, 1e-6) for e in known])
        spread = WEIGHT_SD**2 * np.eye(weights.shape[1])
        if len(known) > 1:
            spread += np.cov(weights, rowvar=False)
        self._promp.from_weight_distribution(weights.mean(axis=0), spread)
        self._duration = float(np.exp(_durations(known)[0]))

    def forecast(self, seen: Observation, times: Array) -> Forecast:
        """See :class:`Baseline`."""
        duration = self._duration if seen.duration_s is None else seen.duration_s
        reference = np.tile(seen.shoulder, 2)
        promp = self._promp
        for time, point in zip(*seen.samples(), strict=True):
            phase = min((time - seen.onset_s) / duration, 1.0)
            promp = promp.condition_position(point - reference, NOISE_SD**2 * np.eye(6), t=phase)
        # The package divides the phases it gets by their largest, in place: the last one must be 1.
        phases = np.append(np.clip((times - seen.onset_s) / duration, 0.0, 1.0), 1.0)
        mean = promp.mean_trajectory(phases)[:-1, 3:] + seen.shoulder
        whole = promp.cov_trajectory(phases).reshape(6, phases.size, 6, phases.size)
        index = np.arange(times.size)
        # Advanced indices apart from each other come first: (K, 6, 6).
        blocks = whole[:, index, :, index][:, 3:, 3:]
        return Forecast(mean, blocks + NOISE_SD**2 * np.eye(3))
