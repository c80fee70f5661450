"""Which costs explain how people move beside each other: path-integral inverse reinforcement learning.

After Kalakrishnan, Pastor, Righetti and Schaal (2013), Learning objective functions for manipulation. The
cost of a movement is w·Φ, with Φ the features of :mod:`.costs`. Around each demonstration d others are
drawn that are nearly as smooth (:mod:`.sampling`), and the weights are those that make the demonstrations
likelier than these:

    w* = argmin  − Σ_d log [ e^{−w·Φ_d} / (e^{−w·Φ_d} + Σ_s e^{−w·Φ_{d,s}}) ] + λ |w|₁,   w ≥ 0.

(The thesis prints the sum over the samples alone, without which the objective has no bound.) The scale of
the weights says how much better demonstrations are than what was drawn around them, which is a matter of
how far it was drawn: directions are what is to be compared.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cholesky, solve_triangular
from scipy.optimize import nnls
from scipy.special import logsumexp

from hri_prediction.errors import ConfigError, DataError

FloatArray = NDArray[np.float64]

_FLAT = 1e-9
"""By so much may the objective still fall along a scaled weight, for each demonstration, at its minimum."""
_STEPS, _HALVINGS = 200, 50
_DAMPING = 1e-9
"""Of the curvature, beside its mean: costs that always go together leave a valley without any."""


@dataclass(frozen=True, eq=False)
class Learnt:
    """Weights that were learnt.

    Attributes:
        weights: Of the features, in their own units (m,).
        scale: Of the features: standard deviations between samples and their demonstrations (m,); the
            weights times these were penalised.
        objective: What was minimised, at its least.
        penalty: λ.
    """

    weights: FloatArray
    scale: FloatArray
    objective: float
    penalty: float

    @property
    def scaled(self) -> FloatArray:
        """Weights of the scaled features (m,): how much each counts among what was drawn."""
        return self.weights * self.scale


def negative_log_likelihood(
    weights: FloatArray, differences: Sequence[FloatArray]
) -> tuple[float, FloatArray]:
    """The objective without penalty, and its gradient.

    Args:
        weights: (m,).
        differences: Features of the samples of each demonstration less its own, each (s, m).

    Returns:
        The value and the gradient (m,).
    """
    value, gradient = 0.0, np.zeros_like(weights)
    for own in differences:
        # The demonstration itself is a difference of zero.
        exponents = np.concatenate(([0.0], -own @ weights))
        total = logsumexp(exponents)
        value += float(total)
        gradient -= np.exp(exponents[1:] - total) @ own
    return value, gradient


def likelihood_curvature(weights: FloatArray, differences: Sequence[FloatArray]) -> FloatArray:
    """Second derivatives (m, m) of :func:`negative_log_likelihood`: covariances of the features."""
    curvature = np.zeros((len(weights), len(weights)))
    for own in differences:
        exponents = np.concatenate(([0.0], -own @ weights))
        chances = np.exp(exponents - logsumexp(exponents))[1:]
        mean = chances @ own
        curvature += (own * chances[:, None]).T @ own - np.outer(mean, mean)
    return curvature


def learn(
    demonstrations: Sequence[FloatArray], samples: Sequence[FloatArray], penalty: float = 1.0
) -> Learnt:
    """Weights that make demonstrations likelier than what was drawn around them.

    Args:
        demonstrations: Features of each (m,).
        samples: Features of what was drawn around each (s, m).
        penalty: λ, of the weights of scaled features; features that tell nothing get none.

    Raises:
        ConfigError: without a penalty: where demonstrations are better than all that was drawn, weights
            would grow for ever.
        DataError: when shapes do not fit, there is nothing, something is not finite, or no minimum is
            found.
    """
    if not penalty > 0.0:
        raise ConfigError(f"penalty = {penalty}", expected="more than 0")
    if not demonstrations or len(demonstrations) != len(samples):
        raise DataError(
            f"{len(demonstrations)} demonstrations and {len(samples)} sets of samples",
            expected="as many of both, one at least",
        )
    count = len(demonstrations[0])
    differences = []
    for number, (own, drawn) in enumerate(zip(demonstrations, samples, strict=True)):
        if own.shape != (count,) or drawn.ndim != 2 or drawn.shape[1] != count or not len(drawn):
            raise DataError(
                f"features of demonstration {number} are {own.shape}, of its samples {drawn.shape}",
                expected=f"({count},) and (s, {count})",
            )
        differences.append(drawn - own)
    if not all(np.isfinite(part).all() for part in differences):
        raise DataError("features that are not finite", expected="finite features")
    spread = np.sqrt(np.mean(np.concatenate(differences) ** 2, axis=0))
    scale = np.where(spread > 0.0, spread, 1.0)
    scaled = [part / scale for part in differences]

    found, value = _minimise(scaled, penalty)
    return Learnt(found / scale, scale, value, penalty)


def _minimise(scaled: Sequence[FloatArray], penalty: float) -> tuple[FloatArray, float]:
    """Weights (m,) of scaled features at which the objective with its penalty is least, and the least.

    Newton steps within the bounds: each is a least-squares problem whose solution may not be negative,
    which :func:`scipy.optimize.nnls` solves to exact zeros. A quasi-Newton method creeps where costs go
    together, thousands of steps without end.

    Raises:
        DataError: when no minimum is found.
    """
    count = scaled[0].shape[1]
    weights, flat = np.zeros(count), _FLAT * len(scaled)

    def objective(at: FloatArray) -> tuple[float, FloatArray]:
        likelihood, slope = negative_log_likelihood(at, scaled)
        return likelihood + penalty * float(at.sum()), slope + penalty

    value, gradient = objective(weights)
    for _ in range(_STEPS):
        if _slope(weights, gradient) <= flat:
            return weights, value
        curvature = likelihood_curvature(weights, scaled)
        damping = _DAMPING * max(float(np.trace(curvature)) / count, 1.0)
        factor = cholesky(curvature + damping * np.eye(count))  # upper: curvature = Rᵀ R
        aim = factor @ weights - solve_triangular(factor, gradient, trans="T")
        try:
            step = nnls(factor, aim, maxiter=30 * count)[0] - weights
        except RuntimeError as error:
            raise DataError(f"no step of the search for weights: {error}") from error
        fall, share = float(gradient @ step), 1.0
        if -fall <= np.finfo(float).eps * max(abs(value), 1.0):
            return weights, value  # what a step promises is less than the value can tell
        for _ in range(_HALVINGS):
            tried = np.maximum(weights + share * step, 0.0)
            better, slope = objective(tried)
            if better <= value + 1e-4 * share * fall:
                break
            share /= 2.0
        else:  # by rounding alone nothing is better any more
            if -fall <= 1e-12 * max(abs(value), 1.0):
                return weights, value
            break
        weights, value, gradient = tried, better, slope
    raise DataError(
        f"no weights were found; the objective still falls by {_slope(weights, gradient):.2g} a unit",
        expected=f"at most {flat:.2g}",
        hint="a larger penalty makes it easier",
    )


def _slope(weights: FloatArray, gradient: FloatArray) -> float:
    """How much the objective still falls along a weight that may change so, at most."""
    inward = np.where(weights > 0.0, gradient, np.minimum(gradient, 0.0))
    return float(np.abs(inward).max())


def cosine(one: FloatArray, other: FloatArray) -> float:
    """Cosine of the angle between two sets of weights; 0 where one of them is nothing."""
    lengths = float(np.linalg.norm(one) * np.linalg.norm(other))
    return float(one @ other) / lengths if lengths > 0.0 else 0.0
