r"""Learning a ProMP from few demonstrations: ridge regression, then EM with a conjugate prior.

With fewer demonstrations than weights the maximum-likelihood covariance is singular. A
normal-inverse-Wishart prior on :math:`(\mu_\omega, \Sigma_\omega)` keeps it positive definite:

.. math:: \mu = \frac{\kappa_0 \mu_0 + \sum_i m_i}{\kappa_0 + N}, \qquad
   \Sigma = \frac{\nu_0 \Lambda_0 + \kappa_0 (\mu - \mu_0)(\mu - \mu_0)^\top
            + \sum_i C_i + (m_i - \mu)(m_i - \mu)^\top}{\nu_0 + N}

with :math:`m_i, C_i` the posterior of demonstration i's weights (E step). :math:`\Lambda_0` is
smooth over the phase (a squared-exponential kernel between basis centres): what varies at one
phase varies alike nearby, which is what lets the start of a reach speak about its end.
Source: Lazaric & Ghavamzadeh, ICML 2010; thesis eqs. 3.3-3.5.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hri_prediction.config import parameter, validate
from hri_prediction.errors import DataError
from hri_prediction.promp.basis import PhaseBasis
from hri_prediction.promp.linalg import cholesky, solve_lower
from hri_prediction.promp.model import ProMP
from hri_prediction.promp.regression import Demonstration, Evidence, gather_evidence

Array = NDArray[np.float64]


@dataclass(frozen=True)
class LearningConfig:
    """Settings of the learner."""

    weights_per_dim: int = parameter(8, "basis functions a dimension", low=2, high=60)
    overlap: float = parameter(0.7, "overlap of neighbouring basis functions", low=0.05, high=0.98)
    ridge: float = parameter(1e-6, "ridge of the per-demonstration regression", low=0.0)
    iterations: int = parameter(20, "largest number of EM iterations", low=1)
    tolerance: float = parameter(1e-5, "stop when the mean moves less (root mean square)", low=0.0)
    prior_strength: float = parameter(
        4.0,
        "demonstrations that the prior covariance counts for; more = wider, rounder regions",
        low=1e-3,
    )
    prior_sd: float = parameter(
        0.03,
        "standard deviation between demonstrations expected before any is seen",
        unit="m",
        low=1e-5,
    )
    prior_sd_strength: float = parameter(
        2.0, "demonstrations that prior_sd counts for against the spread seen", low=0.0
    )
    smoothness: float = parameter(
        0.4, "phase over which the prior's deviations stay alike", low=0.01, high=10.0
    )
    independent_fraction: float = parameter(
        0.02,
        "share of the prior's variance that is independent from weight to weight",
        low=1e-6,
        high=1.0,
    )
    noise_floor: float = parameter(
        0.002, "smallest observation noise (standard deviation)", unit="m", low=1e-6
    )

    def __post_init__(self) -> None:
        validate(self)


@dataclass(frozen=True)
class WeightPrior:
    """Normal-inverse-Wishart prior of the weights.

    Args:
        mean: (D * W,) prior mean, or None: no opinion.
        mean_strength: Demonstrations that the mean counts for.
        covariance: (D * W, D * W) expected covariance, positive definite.
        strength: Demonstrations that the covariance counts for, above 0.
    """

    mean: Array | None
    mean_strength: float
    covariance: Array
    strength: float


def smooth_covariance(basis: PhaseBasis, dims: int, config: LearningConfig) -> Array:
    """Unit-variance prior covariance of the weights (D * W, D * W), smooth over the phase."""
    gap = basis.centres[:, None] - basis.centres[None, :]
    smooth = np.exp(-0.5 * (gap / config.smoothness) ** 2)
    share = config.independent_fraction
    block = (1.0 - share) * smooth + share * np.eye(basis.count)
    full = np.zeros((dims, basis.count, dims, basis.count))
    for d in range(dims):
        full[d, :, d] = block
    return full.reshape(dims * basis.count, -1)


def default_prior(fitted: Array, basis: PhaseBasis, config: LearningConfig) -> WeightPrior:
    """Prior whose spread is that of the ``fitted`` weights (N, D * W).

    Hierarchical: the spread itself is shrunk towards ``prior_sd`` while demonstrations are few.
    """
    count, size = fitted.shape
    spread = float(np.mean(np.var(fitted, axis=0))) * count if count > 1 else 0.0
    seen = count - 1 if count > 1 else 0
    variance = (spread + config.prior_sd_strength * config.prior_sd**2) / (
        seen + config.prior_sd_strength
    )
    shape = smooth_covariance(basis, size // basis.count, config)
    return WeightPrior(None, 0.0, max(variance, 1e-10) * shape, config.prior_strength)


def learn(
    demonstrations: Sequence[Demonstration],
    config: LearningConfig | None = None,
    prior: WeightPrior | None = None,
) -> ProMP:
    r"""Learn the weight distribution by EM.

    The returned covariance is that of the *next* demonstration: it includes what a mean of N
    demonstrations leaves open, :math:`\Sigma (1 + 1/(\kappa_0 + N))`.

    Args:
        demonstrations: At least one.
        config: Settings.
        prior: Prior of the weights; default: :func:`default_prior`.

    Raises:
        DataError: without demonstrations or with inconsistent ones.
    """
    settings = config or LearningConfig()
    if not demonstrations:
        raise DataError("no demonstrations", expected="at least one")
    dims = demonstrations[0].values.shape[1]
    for demo in demonstrations:
        if demo.values.shape != (demo.phases.size, dims) or demo.weight <= 0.0:
            raise DataError(
                f"demonstration with values {demo.values.shape}, weight {demo.weight}",
                expected=f"shape ({demo.phases.size}, {dims}) and a positive weight",
            )
    basis = PhaseBasis(settings.weights_per_dim, settings.overlap)
    evidence = gather_evidence(basis, demonstrations, settings.ridge)
    share = np.concatenate([part.share for part in evidence])
    fitted = np.concatenate([part.fitted for part in evidence]).reshape(share.size, -1)
    belief = prior or default_prior(fitted, basis, settings)
    mean = _posterior_mean(fitted, share, belief)
    covariance = _posterior_covariance(fitted, None, share, mean, belief)
    noise = _noise(evidence, None, settings)
    for _ in range(settings.iterations):
        posteriors = _expected_weights(evidence, mean, covariance, noise)
        means = np.concatenate([m for m, _ in posteriors]).reshape(share.size, -1)
        spread = sum(
            (part.share.sum() * own for part, (_, own) in zip(evidence, posteriors, strict=True)),
            np.zeros_like(covariance),
        )
        updated = _posterior_mean(means, share, belief)
        covariance = _posterior_covariance(means, spread, share, updated, belief)
        noise = _noise(evidence, posteriors, settings)
        moved = float(np.sqrt(np.mean((updated - mean) ** 2)))
        mean = updated
        if moved < settings.tolerance:
            break
    total = float(share.sum()) + belief.mean_strength
    predictive = covariance * (1.0 + 1.0 / total)
    cholesky(predictive, "learnt weight covariance")
    return ProMP(basis, mean, predictive, np.diag(noise))


def _expected_weights(
    evidence: Sequence[Evidence], mean: Array, covariance: Array, noise: Array
) -> list[tuple[Array, Array]]:
    """E step: means (N, D, W) and common covariance (D * W, D * W) of the weights behind the evidence.

    Square-root information form, as in :meth:`ProMP.condition`.
    """
    factor = cholesky(covariance, "weight covariance")
    size = mean.size
    found = []
    for part in evidence:
        dims, width, _ = part.gram.shape
        weighted = part.gram / noise[:, None, None]
        information = (weighted @ factor.reshape(dims, width, size)).reshape(size, size)
        inner = cholesky(np.eye(size) + factor.T @ information, "conditioned precision")
        root = solve_lower(inner, factor.T)
        shift = part.fitted - mean.reshape(dims, width)
        pull = _times(shift, weighted) + part.cross / noise[:, None]
        step = (pull.reshape(-1, size) @ root.T) @ root
        found.append(((mean + step).reshape(part.fitted.shape), root.T @ root))
    return found


def _posterior_mean(means: Array, share: Array, prior: WeightPrior) -> Array:
    total = share @ means
    strength = prior.mean_strength if prior.mean is not None else 0.0
    if prior.mean is not None:
        total = total + strength * prior.mean
    mean: Array = total / (share.sum() + strength)
    return mean


def _posterior_covariance(
    means: Array, spread: Array | None, share: Array, mean: Array, prior: WeightPrior
) -> Array:
    """M step; ``spread`` is the sum of the covariances of the demonstrations' weights."""
    centred = means - mean
    scatter = (share[:, None] * centred).T @ centred + prior.strength * prior.covariance
    if spread is not None:
        scatter = scatter + spread
    if prior.mean is not None:
        shift = mean - prior.mean
        scatter = scatter + prior.mean_strength * np.outer(shift, shift)
    covariance: Array = 0.5 * (scatter + scatter.T) / (prior.strength + share.sum())
    return covariance


def _times(weights: Array, gram: Array) -> Array:
    """Weights (N, D, W) times the symmetric matrix (D, W, W) of their dimension."""
    product: Array = np.matmul(weights.swapaxes(0, 1), gram).swapaxes(0, 1)
    return product


def _noise(
    evidence: Sequence[Evidence],
    posteriors: Sequence[tuple[Array, Array]] | None,
    config: LearningConfig,
) -> Array:
    """Variances (D,) of the observation noise: expected squared residuals, not below the floor.

    Without ``posteriors`` the residuals are those of the ridge regression.
    """
    dims, width, _ = evidence[0].gram.shape
    square, number = np.zeros(dims), np.full(dims, 1e-12)
    for i, part in enumerate(evidence):
        total = part.share.sum()
        square += part.share @ part.square
        number += total * part.number
        if posteriors is not None:
            means, spread = posteriors[i]
            gap = means - part.fitted
            square += part.share @ np.sum(gap * (_times(gap, part.gram) - 2.0 * part.cross), axis=2)
            blocks = spread.reshape(dims, width, dims, width)
            square += total * np.einsum("dij,didj->d", part.gram, blocks)
    return np.maximum(square / number, config.noise_floor**2)
