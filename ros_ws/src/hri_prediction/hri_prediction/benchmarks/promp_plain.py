"""The same ProMP and the same bank in plain NumPy, written as the formulas stand in the book.

What the compiled core is measured against, and checked against: it shares no code with it but the
definition of the prior and the settings.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from hri_prediction.prediction.bank import NEGLIGIBLE, BankPrior
from hri_prediction.prediction.config import PredictorConfig
from hri_prediction.promp.basis import PhaseBasis
from hri_prediction.promp.learning import LearningConfig, default_prior
from hri_prediction.promp.regression import Demonstration

Array = NDArray[np.float64]


def plain_rows(phases: Array, count: int, overlap: float) -> Array:
    """Normalised Gaussian basis at ``phases`` (...,): (..., W)."""
    width = -1.0 / (8.0 * count**2 * math.log(overlap))
    activation = np.exp(-((phases[..., None] - np.linspace(0.0, 1.0, count)) ** 2) / (2.0 * width))
    rows: Array = activation / activation.sum(axis=-1, keepdims=True)
    return rows


class PlainProMP:
    """Weights conditioned on one observation at a time by the textbook Kalman step.

    Args:
        mean: (D * W,) of the weights.
        covariance: (D * W, D * W) of the weights.
        noise: (D, D) of an observation.
        count: Number W of basis functions.
        overlap: Of the basis functions.
    """

    def __init__(
        self, mean: Array, covariance: Array, noise: Array, count: int, overlap: float
    ) -> None:
        self.mean, self.covariance = np.array(mean), np.array(covariance)
        self.noise, self.count, self.overlap = noise, count, overlap

    def observe(self, phase: float, value: Array) -> None:
        """Condition on a position (D,), in place."""
        row = plain_rows(np.array(phase), self.count, self.overlap)
        design = np.kron(np.eye(value.size), row)
        across = design @ self.covariance
        gain = np.linalg.solve(across @ design.T + self.noise, across).T
        self.mean = self.mean + gain @ (value - design @ self.mean)
        self.covariance = self.covariance - gain @ across

    def trajectory_mean(self, phases: Array) -> Array:
        """Mean positions (T, D) at ``phases`` (T,)."""
        rows = plain_rows(phases, self.count, self.overlap)
        mean: Array = rows @ self.mean.reshape(-1, self.count).T
        return mean


def plain_learn(demonstrations: Sequence[Demonstration], config: LearningConfig) -> PlainProMP:
    """EM with the conjugate prior, demonstration by demonstration; all values seen, equal weights."""
    count, number = config.weights_per_dim, len(demonstrations)
    dims = demonstrations[0].values.shape[1]
    designs, fitted = [], np.empty((number, dims * count))
    for i, demo in enumerate(demonstrations):
        rows = plain_rows(demo.phases, count, config.overlap)
        level = demo.values.mean(axis=0)
        gram = rows.T @ rows + max(config.ridge, 1e-12) * np.eye(count)
        fitted[i] = (np.linalg.solve(gram, rows.T @ (demo.values - level)) + level).T.ravel()
        designs.append(np.kron(np.eye(dims), rows))
    observed = [demo.values.T.ravel() for demo in demonstrations]
    prior = default_prior(fitted, PhaseBasis(count, config.overlap), config)

    def moments(means: Array, spread: Array) -> tuple[Array, Array]:
        mean = means.mean(axis=0)
        scatter = (means - mean).T @ (means - mean) + spread + prior.strength * prior.covariance
        return mean, scatter / (prior.strength + number)

    def variances(means: Array, spreads: Array) -> Array:
        total = np.zeros(dims)
        for design, values, m, c in zip(designs, observed, means, spreads, strict=True):
            expected = (values - design @ m) ** 2 + np.sum((design @ c) * design, axis=1)
            total += expected.reshape(dims, -1).sum(axis=1)
        seen = sum(values.size for values in observed) / dims
        return np.maximum(total / seen, config.noise_floor**2)

    nothing = np.zeros((number, fitted.shape[1], fitted.shape[1]))
    mean, covariance = moments(fitted, nothing[0])
    noise = variances(fitted, nothing)
    for _ in range(config.iterations):
        means, spreads = np.empty_like(fitted), np.empty_like(nothing)
        for i, (design, values) in enumerate(zip(designs, observed, strict=True)):
            weighted = design.T / np.repeat(noise, values.size // dims)
            inner = np.eye(mean.size) + covariance @ (weighted @ design)
            spreads[i] = np.linalg.solve(inner, covariance)
            means[i] = mean + spreads[i] @ (weighted @ (values - design @ mean))
        updated, covariance = moments(means, spreads.sum(axis=0))
        noise = variances(means, spreads)
        moved = math.sqrt(np.mean((updated - mean) ** 2))
        mean = updated
        if moved < config.tolerance:
            break
    predictive = covariance * (1.0 + 1.0 / number)
    return PlainProMP(mean, predictive, np.diag(noise), count, config.overlap)


class PlainBank:
    """The bank of (task, duration) hypotheses, all of them at once in NumPy; everything is seen.

    Args:
        prior: Belief at onset.
        config: Settings.
    """

    def __init__(self, prior: BankPrior, config: PredictorConfig) -> None:
        self.prior, self.config = prior, config
        self.restart()

    def restart(self) -> None:
        """Return to the prior."""
        self.means, self.covariances = self.prior.means.copy(), self.prior.covariances.copy()
        self.log_weights = self.prior.log_prior.copy()

    def observe(self, elapsed_s: float, value: Array) -> None:
        """Condition on (elbow, wrist) (6,) at a time since onset."""
        phases = np.clip(elapsed_s / self.prior.durations, 0.0, 1.0)
        rows = plain_rows(phases, self.prior.basis.count, self.prior.basis.overlap)
        count, dims = phases.size, value.size
        blocks = self.covariances.reshape(count, dims, -1, self.means.shape[1])
        across = np.matmul(rows[:, None, None, :], blocks)[:, :, 0]
        spread = np.matmul(across.reshape(count, dims, dims, -1), rows[:, None, :, None])[..., 0]
        spread += self.prior.noises
        error = value - np.matmul(self.means.reshape(count, dims, -1), rows[:, :, None])[..., 0]
        square = np.sum(error * np.linalg.solve(spread, error[..., None])[..., 0], axis=1)
        log_det = np.linalg.slogdet(spread)[1]
        self.condition(phases, value, error, across, spread)
        density = -0.5 * (square + log_det + dims * math.log(2.0 * math.pi))
        log_weights = self.log_weights + self.config.evidence_weight * density
        weights = np.exp(log_weights - log_weights.max())
        kept = (1.0 - self.config.switching) * weights / weights.sum()
        fresh = self.config.switching * np.exp(self.prior.log_prior)
        self.log_weights = np.log(np.maximum(kept + fresh, 1e-300))

    def condition(
        self, phases: Array, value: Array, error: Array, across: Array, spread: Array
    ) -> None:
        """Update means and covariances, given H P (H, D, n) and the innovation's covariance."""
        factor = np.linalg.cholesky(spread)
        scaled = np.linalg.solve(factor, np.concatenate([across, error[..., None]], axis=2))
        gain, shift = scaled[..., :-1], scaled[..., -1:]
        self.means += np.matmul(gain.swapaxes(1, 2), shift)[..., 0]
        self.covariances -= np.matmul(gain.swapaxes(1, 2), gain)

    def moments(self, elapsed_s: float, step_s: float, points: int) -> tuple[Array, Array]:
        """Mean (K, 2, 3) and covariance (K, 2, 3, 3) of the mixture at ``elapsed_s + k step_s``."""
        weights = np.exp(self.log_weights - self.log_weights.max())
        chosen = np.flatnonzero(weights >= NEGLIGIBLE * weights.max())
        weights = weights[chosen] / weights[chosen].sum()
        count, width = chosen.size, self.prior.basis.count
        times = elapsed_s + step_s * np.arange(points)
        phases = np.clip(times / self.prior.durations[chosen, None], 0.0, 1.0)
        rows = plain_rows(phases, width, self.prior.basis.overlap)
        means = np.matmul(rows, self.means[chosen].reshape(count, 6, width).swapaxes(1, 2))
        means = means.reshape(count, points, 2, 3)
        blocks = self.covariances[chosen].reshape(count, 2, 3, width, 2, 3, width)
        second = np.empty((count, points, 2, 3, 3))
        for b in range(2):
            own = blocks[:, b, :, :, b].transpose(0, 2, 1, 3, 4).reshape(count, width, -1)
            half = np.matmul(rows, own).reshape(count, points, 9, width)
            spread = np.matmul(half, rows[..., None])[..., 0]
            second[:, :, b] = spread.reshape(count, points, 3, 3)
        second += means[..., :, None] * means[..., None, :]
        mean = np.tensordot(weights, means, 1)
        covariance = np.tensordot(weights, second, 1) - mean[..., :, None] * mean[..., None, :]
        return mean, covariance
