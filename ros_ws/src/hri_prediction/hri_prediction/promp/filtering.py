r"""One observation at a time: a Kalman step in weight space, compiled.

The observation matrix has one block of W basis values a dimension, so :math:`P H^\top` costs
:math:`n D W` instead of :math:`n^2 D`. With :math:`S = L L^\top` and
:math:`V = P H^\top L^{-\top}` the update is :math:`P - V V^\top`: written to both triangles at
once it stays exactly symmetric, and no inverse is formed.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hri_prediction.compiled import njit
from hri_prediction.errors import DataError
from hri_prediction.promp.basis import basis_row
from hri_prediction.promp.model import ProMP

Array = NDArray[np.float64]
LOG_2PI = math.log(2.0 * math.pi)


@njit
def kalman_step(
    mean: Array, covariance: Array, row: Array, value: Array, seen: Array, noise: Array, gain: Array
) -> float:
    """Condition weights on one observation, in place.

    Args:
        mean: (D * W,) weights, overwritten.
        covariance: (D * W, D * W), overwritten.
        row: (W,) basis values at the observation's phase.
        value: (D,) observation; entries that are not seen are ignored.
        seen: (D,) bool.
        noise: (D, D) observation covariance.
        gain: (D, D * W) scratch.

    Returns:
        Log density of the seen entries before the update; NaN (state untouched) if the
        innovation covariance is not positive definite.
    """
    width = row.shape[0]
    dims = value.shape[0]
    size = mean.shape[0]
    index = np.empty(dims, np.int64)
    count = 0
    for d in range(dims):
        if seen[d]:
            index[count] = d
            count += 1
    # gain rows: H P, one a seen dimension
    for a in range(count):
        base = index[a] * width
        for j in range(size):
            gain[a, j] = 0.0
        for w in range(width):
            factor = row[w]
            for j in range(size):
                gain[a, j] += factor * covariance[base + w, j]
    lower = np.empty((count, count))
    error = np.empty(count)
    for a in range(count):
        base = index[a] * width
        predicted = 0.0
        for w in range(width):
            predicted += row[w] * mean[base + w]
        error[a] = value[index[a]] - predicted
        for b in range(a + 1):
            base_b = index[b] * width
            total = noise[index[a], index[b]]
            for w in range(width):
                total += row[w] * gain[a, base_b + w]
            lower[a, b] = total
    # Cholesky of S, then L^-1 applied to the innovation and to H P
    log_density = -0.5 * count * LOG_2PI
    for a in range(count):
        for b in range(a + 1):
            total = lower[a, b]
            for c in range(b):
                total -= lower[a, c] * lower[b, c]
            if a == b:
                if not total > 0.0:
                    return math.nan
                lower[a, a] = math.sqrt(total)
            else:
                lower[a, b] = total / lower[b, b]
    for a in range(count):
        for b in range(a):
            factor = lower[a, b]
            error[a] -= factor * error[b]
            for j in range(size):
                gain[a, j] -= factor * gain[b, j]
        scale = 1.0 / lower[a, a]
        error[a] *= scale
        for j in range(size):
            gain[a, j] *= scale
        log_density -= 0.5 * error[a] * error[a] + math.log(lower[a, a])
    for a in range(count):
        for j in range(size):
            mean[j] += gain[a, j] * error[a]
    # Whole rows keep the inner loop contiguous (vectorised); the products commute exactly, so
    # both triangles receive identical numbers.
    for i in range(size):
        for a in range(count):
            factor = gain[a, i]
            for j in range(size):
                covariance[i, j] -= factor * gain[a, j]
    return log_density


class WeightFilter:
    """Mutable, incremental counterpart of :meth:`ProMP.condition`: same result, sample by sample.

    Args:
        prior: Model to start from; it is not changed.
    """

    def __init__(self, prior: ProMP) -> None:
        self._prior = prior
        self._mean = prior.mean.copy()
        self._covariance = prior.covariance.copy()
        self._gain = np.zeros((prior.dims, prior.mean.size))
        self._row = np.zeros(prior.basis.count)
        self._centres = prior.basis.centres
        self._variance = prior.basis.variance

    def observe(self, phase: float, value: ArrayLike, noise: ArrayLike | None = None) -> float:
        """Condition on one observation (D,), NaN where not seen.

        Returns:
            Log density of what was seen, given everything before.

        Raises:
            DataError: on a wrong shape or noise that is not positive definite.
        """
        observed = np.asarray(value, dtype=float)
        if observed.shape != (self._prior.dims,):
            raise DataError(f"value {observed.shape}", expected=f"shape ({self._prior.dims},)")
        # A copy: read-only arrays would make the compiler build a second version.
        covariance = np.array(self._prior.noise if noise is None else noise, dtype=float)
        basis_row(float(phase), self._centres, self._variance, self._row)
        log_density = float(
            kalman_step(
                self._mean,
                self._covariance,
                self._row,
                observed,
                np.isfinite(observed),
                covariance,
                self._gain,
            )
        )
        if math.isnan(log_density):
            raise DataError("observation noise is not positive definite")
        return log_density

    def posterior(self) -> ProMP:
        """The distribution given everything observed so far."""
        return replace(self._prior, mean=self._mean, covariance=self._covariance)
