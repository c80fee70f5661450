r"""What an observation says about the weights: positions, velocities, or any part of both.

An observation stacks positions and velocities of all dimensions (thesis eq. 3.1),

.. math:: y_t = \begin{bmatrix} \phi(z_t)^\top \\ \dot z \, \phi'(z_t)^\top \end{bmatrix}
          \otimes I_D \; \omega + \epsilon, \qquad \dot z = 1 / T

where T is the duration of the movement. Entry e of an observation belongs to dimension e mod D: the
first D are positions, the next D velocities.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hri_prediction.errors import DataError
from hri_prediction.promp.basis import PhaseBasis
from hri_prediction.promp.linalg import cholesky, solve_lower

Array = NDArray[np.float64]


def check_duration(duration: float) -> float:
    """The duration of a movement in seconds.

    Raises:
        DataError: unless it is positive and finite.
    """
    if not (np.isfinite(duration) and duration > 0.0):
        raise DataError(f"duration {duration}", expected="seconds, above 0")
    return float(duration)


def observation_rows(
    basis: PhaseBasis, phases: ArrayLike, order: int = 0, duration: float | None = None
) -> Array:
    """Rows (O, T, W) that turn the weights of one dimension into what is observed of it.

    O is 2 with a duration (positions, then velocities by time), else 1: positions (``order`` 0) or
    derivatives by phase (``order`` 1).

    Raises:
        DataError: on an order other than 0 and 1, a duration with order 1, or one that is not positive.
    """
    if order not in (0, 1):
        raise DataError(f"order {order}", expected="0 (positions) or 1 (derivatives)")
    if duration is None:
        rows = basis.derivatives(phases) if order else basis.values(phases)
        return rows[None]
    if order:
        raise DataError(
            "order 1 with a duration",
            expected="one of them: a duration brings the velocities along",
        )
    velocity = basis.derivatives(phases) / check_duration(duration)
    return np.stack([basis.values(phases), velocity])


def observation_noise(own: Array, noise: ArrayLike | None, duration: float | None) -> Array:
    """Covariance of an observation: ``noise``, or else the model's ``own``, which is of positions.

    Raises:
        DataError: for velocities without a noise.
    """
    if noise is not None:
        return np.asarray(noise, dtype=float)
    if duration is not None:
        size = 2 * own.shape[0]
        raise DataError("velocities without noise", expected=f"noise of shape ({size}, {size})")
    return own


@dataclass(frozen=True)
class Whitened:
    """Observations with their noise whitened to identity, only entries that were seen.

    Args:
        design: (M, D * W).
        residual: (M,) observation minus what the mean of the weights predicts.
        log_det: Log determinant of the noise of these entries.
    """

    design: Array
    residual: Array
    log_det: float


def whiten(
    rows: Array, mean: Array, values: ArrayLike, mask: ArrayLike | None, noise: ArrayLike
) -> Whitened:
    r"""Bring observations into the form :math:`r = A (\omega - \mu) + N(0, I)`.

    Args:
        rows: (O, T, W) of :func:`observation_rows`.
        mean: (D, W) mean of the weights.
        values: (T, O * D), or (O * D,) for T = 1; NaN = not seen.
        mask: (T, O * D) or (O * D,) True where seen; None: everything finite.
        noise: (O * D, O * D) or (T, O * D, O * D) covariance of an observation.

    Raises:
        DataError: on shapes that do not fit or noise that is not positive definite.
    """
    orders, times, width = rows.shape
    dims = mean.shape[0]
    entries = orders * dims
    observed = np.asarray(values, dtype=float)
    observed = observed[None, :] if observed.ndim == 1 else observed
    if observed.shape != (times, entries):
        raise DataError(f"values {observed.shape}", expected=f"shape {(times, entries)}")
    spread = np.asarray(noise, dtype=float)
    if spread.shape not in ((entries, entries), (times, entries, entries)):
        raise DataError(
            f"noise {spread.shape}",
            expected=f"shape {(entries, entries)} or {(times, entries, entries)}",
        )
    seen = np.isfinite(observed)
    if mask is not None:
        seen = seen & np.broadcast_to(np.asarray(mask, dtype=bool), observed.shape)
    error = observed - np.einsum("otw,dw->tod", rows, mean).reshape(times, entries)
    designs, residuals, log_det = [np.zeros((0, dims * width))], [np.zeros(0)], 0.0
    for chosen, index in _alike(seen, spread.ndim == 3):
        count, size = index.size, chosen.size
        # Whitening mixes the entries of one time: entries first, everything else in columns.
        design = np.zeros((size, count, dims, width))
        design[np.arange(size), :, chosen % dims] = rows[chosen // dims][:, index]
        own = spread[index[0]] if spread.ndim == 3 else spread
        factor = cholesky(own[np.ix_(chosen, chosen)], "observation noise")
        columns = np.hstack([design.reshape(size, -1), error[np.ix_(index, chosen)].T])
        white = solve_lower(factor, columns)
        designs.append(white[:, :-count].reshape(size * count, dims * width))
        residuals.append(white[:, -count:].ravel())
        log_det += 2.0 * count * float(np.sum(np.log(np.diag(factor))))
    return Whitened(np.concatenate(designs), np.concatenate(residuals), log_det)


def _alike(
    seen: NDArray[np.bool_], one_by_one: bool
) -> list[tuple[NDArray[np.int64], NDArray[np.int64]]]:
    """Times (T,) grouped by the entries (T, E) seen: pairs of entries and times, none empty."""
    times = np.arange(seen.shape[0])
    if seen.all() and not one_by_one:
        groups = [(np.arange(seen.shape[1]), times)] if times.size else []
    elif one_by_one:
        groups = [(np.flatnonzero(seen[t]), times[t : t + 1]) for t in times]
    else:
        keys = [row.tobytes() for row in seen]
        groups = [
            (np.flatnonzero(seen[keys.index(key)]), times[[own == key for own in keys]])
            for key in dict.fromkeys(keys)
        ]
    return [(chosen, index) for chosen, index in groups if chosen.size]
