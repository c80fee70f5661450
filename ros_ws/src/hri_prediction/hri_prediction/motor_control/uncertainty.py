r"""How surely the weights of a reach are known: Fisher's information (Cramer-Rao) on the simplex.

With independent errors of standard deviation :math:`\sigma` in each coordinate of each sample, weights
that lie within the simplex have the covariance :math:`Z (Z^\top P^\top P Z)^{-1} Z^\top \sigma^2`, where
P is the derivative of the path by the weights and Z spans the directions in which their sum stays 1. One
reach tells little: some millimetres for each unit along the best known direction, half of one along the
worst.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import null_space

from hri_prediction.motor_control.ioc import Explanation
from hri_prediction.motor_control.observed import ObservedReach

Array = NDArray[np.float64]

_AT_BOUND = 1e-6
_LEAST_M = 1e-6
"""What a path moves by for a unit of alpha in a direction that says nothing about alpha [m]."""
_WHOLE = 1.0
"""Standard deviation of a weight of which nothing is known: the simplex is no wider."""


@dataclass(frozen=True, eq=False)
class Certainty:
    """What a reach says about its weights.

    Attributes:
        sd: Standard deviation of each weight (n,), 1 at most; 0 of weights that are 0.
        covariance: Of all (n, n).
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
    if free.sum() > 1:
        tangent = np.zeros((size, int(free.sum()) - 1))
        tangent[free] = null_space(np.ones((1, int(free.sum()))))
        slopes = explanation.jacobian.reshape(-1, size) @ tangent
        information = slopes.T @ slopes
        values, vectors = np.linalg.eigh(information)
        axes = np.sqrt(np.maximum(values[::-1], 0.0) / len(observed.phases))
        least = len(observed.phases) * _LEAST_M**2
        spread = np.minimum(noise_m**2 * correlated / np.maximum(values, least), _WHOLE**2)
        directions = tangent @ vectors
        covariance = (directions * spread) @ directions.T
    sd = np.minimum(np.sqrt(np.diag(covariance)), _WHOLE)
    return Certainty(sd, covariance, axes, noise_m)
