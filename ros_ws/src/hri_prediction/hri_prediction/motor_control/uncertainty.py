r"""How surely the weights of a reach are known: Fisher's information (Cramer-Rao) on the simplex.

With independent errors of standard deviation :math:`\sigma` in each coordinate of each sample, weights
that lie within the simplex have the covariance :math:`Z (Z^\top P^\top P Z)^{-1} Z^\top \sigma^2`, where
P is the derivative of the path by the weights and Z spans the directions in which their sum stays 1. One
reach tells little: some millimetres for each unit along the best known direction, half of one along the
worst.

A weight that is 0 is held there by its bound: its estimate does not scatter, but it may be more. How much
more is told by the likelihood of the path, with all free weights making the best of it: the rise after
which its logarithm has lost 1/2 (one standard deviation, where the peak is at the bound).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import null_space

from hri_prediction.motor_control.ioc import Explanation
from hri_prediction.motor_control.observed import ObservedReach

Array = NDArray[np.float64]

_AT_BOUND = 1e-6
_GONE = 1e-12
"""What is left by rounding of a weight that got to 0."""
_LEAST_M = 1e-6
"""What a path moves by for a unit of alpha in a direction that says nothing about alpha [m]."""
_NOTHING = 1e-300
"""Added to what is divided by, where there is neither noise nor slope."""
_WHOLE = 1.0
"""Standard deviation of a weight of which nothing is known: the simplex is no wider."""


@dataclass(frozen=True, eq=False)
class Certainty:
    """What a reach says about its weights.

    Attributes:
        sd: Standard deviation of each weight (n,), 1 at most; of weights that are 0, how much more they may
            be.
        covariance: Of all (n, n); the sum of weights is known.
        axes_m: How far the path moves (root mean square over the samples) for a unit of alpha along each
            principal axis, the longest first (n - 1 or fewer,) [m].
        noise_m: Standard deviation of one coordinate of a sample about the optimum.
    """

    sd: Array
    covariance: Array
    axes_m: Array
    noise_m: float


def certainty(
    explanation: Explanation,
    observed: ObservedReach,
    noise_m: float | None = None,
    correlated: float = 1.0,
) -> Certainty:
    """How surely weights are known.

    Args:
        explanation: What was found.
        observed: What it explains.
        noise_m: Standard deviation of a coordinate, if it is known; none: from what is left over.
        correlated: So many samples in a row share an error (those of a filtered recording); they count
            for one.
    """
    residual = explanation.path - observed.hand
    free = explanation.alpha > _AT_BOUND
    size = len(explanation.alpha)
    count = residual.size / correlated
    if noise_m is None:
        noise_m = float(
            np.sqrt((residual**2).sum() / correlated / max(count - free.sum() + 1.0, 1.0))
        )
    covariance, axes = np.zeros((size, size)), np.zeros(0)
    tangent = np.zeros((size, max(int(free.sum()) - 1, 0)))
    if free.sum() > 1:
        tangent[free] = null_space(np.ones((1, int(free.sum()))))
        slopes = explanation.jacobian.reshape(-1, size) @ tangent
        information = slopes.T @ slopes
        values, vectors = np.linalg.eigh(information)
        axes = np.sqrt(np.maximum(values[::-1], 0.0) / len(observed.phases))
        least = len(observed.phases) * _LEAST_M**2
        spread = np.minimum(noise_m**2 * correlated / np.maximum(values, least), _WHOLE**2)
        directions = tangent @ vectors
        covariance = (directions * spread) @ directions.T
    for index in np.flatnonzero(~free):
        rise = _rise(explanation, residual, free, int(index), noise_m**2 * correlated)
        covariance = covariance + np.outer(rise, rise)
    sd = np.minimum(np.sqrt(np.diag(covariance)), _WHOLE)
    return Certainty(sd, covariance, axes, noise_m)


def _rise(
    explanation: Explanation,
    residual: Array,
    free: NDArray[np.bool_],
    index: int,
    variance: float,
) -> Array:
    """How weights change when one that is 0 rises until the logarithm of the likelihood has lost 1/2 (n,).

    Free ones make the best of it, as far down as to 0; whichever gets there stays there, and the others go
    on. It ends at the latest where the one weight has all.

    Args:
        explanation: What was found.
        residual: Its path less that which was seen (N, 3) [m].
        free: Weights that are not 0 (n,).
        index: Of the weight that rises.
        variance: Of a coordinate of a sample, as they are counted [m^2].
    """
    size = len(explanation.alpha)
    slopes = explanation.jacobian.reshape(-1, size)
    giving, moved = free.copy(), np.zeros(size)
    while giving.any():
        left = explanation.alpha + moved
        # All that give shrink alike, and then make the best of it.
        toward = np.where(giving, -left, 0.0) / left[giving].sum()
        toward[index] = 1.0
        if giving.sum() > 1:
            tangent = np.zeros((size, int(giving.sum()) - 1))
            tangent[giving] = null_space(np.ones((1, int(giving.sum()))))
            best = np.linalg.lstsq(slopes @ tangent, slopes @ toward, rcond=None)[0]
            toward = toward - tangent @ best
        path, so_far = slopes @ toward, slopes @ moved
        unspent = variance - float(so_far @ (so_far + 2.0 * residual.ravel()))
        slope = max(float(path @ (so_far + residual.ravel())), 0.0)
        curvature = float(path @ path)
        rise = _WHOLE
        if curvature > len(residual) * _LEAST_M**2:
            unspent = max(unspent, 0.0)
            rise = unspent / (slope + math.sqrt(slope**2 + curvature * unspent) + _NOTHING)
        falling = giving & (toward < 0.0)
        room = float((left[falling] / -toward[falling]).min())
        moved = moved + min(rise, room) * toward
        if rise <= room:
            break
        giving = giving & (explanation.alpha + moved > _GONE)
    return moved
