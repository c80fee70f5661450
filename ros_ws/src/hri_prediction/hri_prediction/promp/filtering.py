r"""One observation at a time: a Kalman step in weight space, compiled.

The observation matrix has one block of W basis values an entry, so :math:`P H^\top` costs
:math:`n W` an entry instead of :math:`n^2`. With :math:`S = L L^\top` and
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
from hri_prediction.promp.basis import basis_row, slope_row
from hri_prediction.promp.model import ProMP
from hri_prediction.promp.observation import check_duration, observation_noise

Array = NDArray[np.float64]
LOG_2PI = math.log(2.0 * math.pi)
NEGLIGIBLE = 1e-18
"""Basis values below this are left out of sums that others of order one dominate: rounding."""


@njit
def support(row: Array, threshold: float) -> tuple[int, int]:
    """First index, and the one after the last, of what exceeds ``threshold`` x the largest size."""
    largest = 0.0
    for w in range(row.shape[0]):
        largest = max(largest, abs(row[w]))
    first, last = 0, row.shape[0]
    while first < last - 1 and abs(row[first]) < threshold * largest:
        first += 1
    while last > first + 1 and abs(row[last - 1]) < threshold * largest:
        last -= 1
    return first, last


@njit
def subtract_squares(covariance: Array, gain: Array, count: int) -> None:
    """``covariance -= gain[:count].T @ gain[:count]``, exactly symmetric.

    Whole rows keep the inner loops contiguous (vectorised), three rows of the gain at a time save
    passes over the covariance; the products commute exactly, and both triangles add them up in the
    same order, so they receive identical numbers.
    """
    size = covariance.shape[0]
    whole = count - count % 3
    for i in range(size):
        target = covariance[i]
        for a in range(0, whole, 3):
            one, two, three = gain[a], gain[a + 1], gain[a + 2]
            x, y, z = one[i], two[i], three[i]
            for j in range(size):
                target[j] -= x * one[j] + y * two[j] + z * three[j]
        for a in range(whole, count):
            one = gain[a]
            x = one[i]
            for j in range(size):
                target[j] -= x * one[j]


@njit
def kalman_step(
    mean: Array,
    covariance: Array,
    rows: Array,
    value: Array,
    seen: Array,
    noise: Array,
    gain: Array,
) -> float:
    """Condition weights on one observation, in place.

    Args:
        mean: (D * W,) weights, overwritten.
        covariance: (D * W, D * W), overwritten.
        rows: (O, W) basis values at the observation's phase: of positions, or of positions and
            velocities.
        value: (O * D,) observation; entries that are not seen are ignored.
        seen: (O * D,) bool.
        noise: (O * D, O * D) observation covariance.
        gain: (O * D, D * W) scratch, or larger.

    Returns:
        Log density of the seen entries before the update; NaN (state untouched) if the
        innovation covariance is not positive definite.
    """
    width = rows.shape[1]
    size = mean.shape[0]
    dims = size // width
    entries = rows.shape[0] * dims
    index = np.empty(entries, np.int64)
    count = 0
    for e in range(entries):
        if seen[e]:
            index[count] = e
            count += 1
    limits = np.empty((rows.shape[0], 2), np.int64)
    for o in range(rows.shape[0]):
        limits[o, 0], limits[o, 1] = support(rows[o], NEGLIGIBLE)
    # gain rows: H P, one a seen entry
    lower = np.empty((count, count))
    error = np.empty(count)
    for a in range(count):
        order, base = index[a] // dims, (index[a] % dims) * width
        target = gain[a]
        predicted = 0.0
        for j in range(size):
            target[j] = 0.0
        for w in range(limits[order, 0], limits[order, 1]):
            factor = rows[order, w]
            source = covariance[base + w]
            predicted += factor * mean[base + w]
            for j in range(size):
                target[j] += factor * source[j]
        error[a] = value[index[a]] - predicted
        for b in range(a + 1):
            order_b, base_b = index[b] // dims, (index[b] % dims) * width
            total = noise[index[a], index[b]]
            for w in range(limits[order_b, 0], limits[order_b, 1]):
                total += rows[order_b, w] * target[base_b + w]
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
        target = gain[a]
        for b in range(a):
            factor = lower[a, b]
            source = gain[b]
            error[a] -= factor * error[b]
            for j in range(size):
                target[j] -= factor * source[j]
        scale = 1.0 / lower[a, a]
        error[a] *= scale
        for j in range(size):
            target[j] *= scale
        log_density -= 0.5 * error[a] * error[a] + math.log(lower[a, a])
    for a in range(count):
        source = gain[a]
        for j in range(size):
            mean[j] += source[j] * error[a]
    subtract_squares(covariance, gain, count)
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
        self._gain = np.zeros((2 * prior.dims, prior.mean.size))
        self._rows = np.zeros((2, prior.basis.count))
        self._centres = prior.basis.centres
        self._variance = prior.basis.variance

    def observe(
        self,
        phase: float,
        value: ArrayLike,
        noise: ArrayLike | None = None,
        *,
        duration: float | None = None,
    ) -> float:
        """Condition on one observation (E,), NaN where not seen.

        E is the number D of dimensions; with ``duration`` the observation stacks the D positions and
        the D velocities by time of a movement of so many seconds, and E = 2 D.

        Args:
            phase: Phase of the observation.
            value: (E,) observation.
            noise: (E, E) covariance; default: the model's own, for positions alone.
            duration: Duration of the movement in seconds, for observations with velocities.

        Returns:
            Log density of what was seen, given everything before.

        Raises:
            DataError: on a wrong shape or noise that is not positive definite.
        """
        # Copies: read-only arrays would make the compiler build a second version.
        covariance = np.array(observation_noise(self._prior.noise, noise, duration), dtype=float)
        observed = np.array(value, dtype=float)
        orders = 1 if duration is None else 2
        entries = orders * self._prior.dims
        if observed.shape != (entries,) or covariance.shape != (entries, entries):
            raise DataError(
                f"value {observed.shape}, noise {covariance.shape}",
                expected=f"shapes ({entries},) and ({entries}, {entries})",
            )
        basis_row(float(phase), self._centres, self._variance, self._rows[0])
        if duration is not None:
            slope_row(float(phase), self._centres, self._variance, self._rows[0], self._rows[1])
            self._rows[1] /= check_duration(duration)
        log_density = float(
            kalman_step(
                self._mean,
                self._covariance,
                self._rows[:orders],
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
