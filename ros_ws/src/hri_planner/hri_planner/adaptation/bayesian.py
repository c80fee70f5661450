"""Bayesian regressions on quadratic features: few parameters, fitted in milliseconds, with their doubt."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hri_prediction.errors import DataError

FloatArray = NDArray[np.float64]

PRECISIONS = tuple(10.0 ** np.arange(-1.0, 3.5, 0.5))
"""Of the prior of the weights; the one of the largest evidence is taken."""

_STEPS = 100
_TOLERANCE = 1e-9
_FREE = 1e-6  # precision of the prior of the constant


def quadratic(inputs: FloatArray) -> FloatArray:
    """1, all inputs (n, d) and all products of two of them: (n, 1 + d + d (d + 1) / 2)."""
    rows, columns = np.triu_indices(inputs.shape[1])
    one = np.ones((len(inputs), 1))
    return np.concatenate((one, inputs, inputs[:, rows] * inputs[:, columns]), axis=1)


@dataclass(frozen=True)
class LogisticModel:
    """Log-odds linear in features, with a normal distribution of the weights (Laplace's approximation).

    Attributes:
        weights: Mean (p,).
        factor: Lower Cholesky factor (p, p) of their precision.
    """

    weights: FloatArray
    factor: FloatArray

    def log_odds(self, features: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Mean and standard deviation (n,) of the log-odds for features (n, p)."""
        spread = np.linalg.solve(self.factor, features.T)
        return features @ self.weights, np.sqrt((spread**2).sum(axis=0))


def sigmoid(log_odds: FloatArray) -> FloatArray:
    """Probabilities of log-odds; does not overflow."""
    return np.asarray(np.exp(-np.logaddexp(0.0, -log_odds)))


def fit_logistic(features: FloatArray, success: FloatArray) -> LogisticModel:
    """Fit to outcomes; the prior is chosen by its evidence.

    Args:
        features: (n, p), a constant first.
        success: 0 or 1 (n,).

    Raises:
        DataError: on no or unusable data.
    """
    _check(features, success)
    fits = [_maximise(features, success, precision) for precision in PRECISIONS]
    return max(fits, key=lambda fit: fit[0])[1]


def _prior(count: int, precision: float) -> FloatArray:
    return np.concatenate(([_FREE], np.full(count - 1, precision)))


def _log_posterior(
    features: FloatArray, success: FloatArray, prior: FloatArray, weights: FloatArray
) -> float:
    odds = features @ weights
    return float(
        (success * odds - np.logaddexp(0.0, odds)).sum() - 0.5 * (prior * weights**2).sum()
    )


def _maximise(
    features: FloatArray, success: FloatArray, precision: float
) -> tuple[float, LogisticModel]:
    """Newton's method with halved steps. Returns the log evidence and the model."""
    prior = _prior(features.shape[1], precision)
    weights = np.zeros(features.shape[1])
    value = _log_posterior(features, success, prior, weights)
    for _ in range(_STEPS):
        chance = sigmoid(features @ weights)
        slope = features.T @ (success - chance) - prior * weights
        step = np.linalg.solve(_curvature(features, chance, prior), slope)
        share = 1.0
        after = _log_posterior(features, success, prior, weights + step)
        while after < value and share > 1e-6:
            share *= 0.5
            after = _log_posterior(features, success, prior, weights + share * step)
        if after <= value + _TOLERANCE:
            break
        weights, value = weights + share * step, after
    curvature = _curvature(features, sigmoid(features @ weights), prior)
    factor = np.asarray(np.linalg.cholesky(curvature), dtype=np.float64)
    evidence = value + 0.5 * np.log(prior).sum() - np.log(np.diag(factor)).sum()
    return float(evidence), LogisticModel(weights, factor)


def _curvature(features: FloatArray, chance: FloatArray, prior: FloatArray) -> FloatArray:
    return np.asarray((features.T * (chance * (1.0 - chance))) @ features + np.diag(prior))


def fit_ridge(features: FloatArray, values: FloatArray, precision: float = 1.0) -> FloatArray:
    """Weights (p,) of a linear regression of values (n,), with a normal prior but for the constant.

    Raises:
        DataError: on no or unusable data.
    """
    _check(features, values)
    normal = features.T @ features + np.diag(_prior(features.shape[1], precision))
    return np.asarray(np.linalg.solve(normal, features.T @ values))


def _check(features: FloatArray, values: FloatArray) -> None:
    if features.ndim != 2 or values.shape != (len(features),) or not len(features):
        raise DataError(
            f"features of shape {features.shape} and {values.shape} values", expected="(n, p), (n,)"
        )
    if not (np.all(np.isfinite(features)) and np.all(np.isfinite(values))):
        raise DataError("training data hold NaN or infinity")
