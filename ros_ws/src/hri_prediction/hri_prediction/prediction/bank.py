r"""A bank of hypotheses (task, duration), each a Kalman filter over ProMP weights.

Each observation multiplies a hypothesis' weight by its likelihood (in log space; ``evidence_weight``
below 1 tempers it), and a little of every weight returns to the prior. The output is the first two
moments of the mixture.

One more task, "unknown" (:mod:`.unknown`), is a wide minimum-jerk reach to anywhere: it wins once nothing
in the library explains what is seen, which takes up to half of a reach. That a reach was re-aimed on the
way is the matter of :mod:`.reaim`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hri_prediction.compiled import njit
from hri_prediction.prediction.config import PredictorConfig
from hri_prediction.prediction.library import DIMS, TaskModel
from hri_prediction.prediction.reaim import Aims, ReaimBank, aims_of
from hri_prediction.prediction.unknown import UNKNOWN, unknown_task
from hri_prediction.promp.basis import PhaseBasis, basis_row
from hri_prediction.promp.filtering import kalman_step, support
from hri_prediction.promp.model import ProMP
from hri_prediction.tracks.bell import from_rest_to_rest

Array = NDArray[np.float64]
NEGLIGIBLE = 1e-3
"""Hypotheses below this share of the largest weight are left out of the output."""


@njit
def update_bank(
    means: Array,
    covariances: Array,
    log_weights: Array,
    log_prior: Array,
    inverse_durations: Array,
    noises: Array,
    elapsed: float,
    value: Array,
    seen: Array,
    centres: Array,
    variance: float,
    evidence_weight: float,
    switching: float,
    gain: Array,
    rows: Array,
) -> tuple[int, float]:
    """Condition all hypotheses on one observation, in place; weights stay normalised.

    Returns:
        Number of hypotheses that could not be updated, and log density of the observation.
    """
    failed = 0
    count = log_weights.shape[0]
    largest = -1e300
    for h in range(count):
        phase = min(1.0, max(0.0, elapsed * inverse_durations[h]))
        basis_row(phase, centres, variance, rows[0])
        density = kalman_step(means[h], covariances[h], rows, value, seen, noises[h], gain)
        if math.isnan(density):
            failed += 1
            density = -1e3
        log_weights[h] += evidence_weight * density
        largest = max(largest, log_weights[h])
    total = 0.0
    for h in range(count):
        total += math.exp(log_weights[h] - largest)
    shift = largest + math.log(total)
    for h in range(count):
        weight = math.exp(log_weights[h] - shift)
        weight = (1.0 - switching) * weight + switching * math.exp(log_prior[h])
        log_weights[h] = math.log(max(weight, 1e-300))
    return failed, shift


@njit
def position_moments(
    mean: Array, covariance: Array, row: Array, half: Array, out_mean: Array, out_cov: Array
) -> None:
    """Mean (6,) and the two diagonal 3 x 3 blocks (2, 3, 3) of one hypothesis at one phase.

    ``half`` is scratch of 3 W numbers.
    """
    width = row.shape[0]
    first, last = support(row, 1e-12)
    for d in range(6):
        total = 0.0
        for w in range(first, last):
            total += row[w] * mean[d * width + w]
        out_mean[d] = total
    for block in range(2):
        start = 3 * block * width
        for i in range(3):
            # Along whole rows, so that the inner loop is contiguous; up to the diagonal block.
            stop = (i + 1) * width
            for j in range(stop):
                half[j] = 0.0
            for w in range(first, last):
                factor = row[w]
                source = covariance[start + i * width + w, start : start + stop]
                for j in range(stop):
                    half[j] += factor * source[j]
            for j in range(i + 1):
                total = 0.0
                for w in range(first, last):
                    total += row[w] * half[j * width + w]
                out_cov[block, i, j] = total
                out_cov[block, j, i] = total


@njit
def mix_bank(
    means: Array,
    covariances: Array,
    weights: Array,
    inverse_durations: Array,
    elapsed: float,
    step: float,
    centres: Array,
    variance: float,
    out_mean: Array,
    out_cov: Array,
) -> None:
    """Moments of the mixture at ``elapsed + k step``.

    ``weights`` (H,) are normalised, and zero leaves a hypothesis out; written are ``out_mean``
    (K, 6) and ``out_cov`` (K, 2, 3, 3).
    """
    points = out_mean.shape[0]
    row = np.empty(centres.shape[0])
    half = np.empty(3 * centres.shape[0])
    mean = np.empty(6)
    cov = np.empty((2, 3, 3))
    out_mean[:] = 0.0
    out_cov[:] = 0.0
    for h in range(weights.shape[0]):
        if weights[h] <= 0.0:
            continue
        ended = False
        for k in range(points):
            if not ended:
                phase = (elapsed + k * step) * inverse_durations[h]
                ended = phase >= 1.0  # from here on it rests at its end point
                basis_row(min(1.0, max(0.0, phase)), centres, variance, row)
                position_moments(means[h], covariances[h], row, half, mean, cov)
            for d in range(6):
                out_mean[k, d] += weights[h] * mean[d]
            for b in range(2):
                for i in range(3):
                    for j in range(3):
                        out_cov[k, b, i, j] += weights[h] * (
                            cov[b, i, j] + mean[3 * b + i] * mean[3 * b + j]
                        )
    for k in range(points):
        for b in range(2):
            for i in range(3):
                for j in range(3):
                    out_cov[k, b, i, j] -= out_mean[k, 3 * b + i] * out_mean[k, 3 * b + j]


@dataclass(frozen=True)
class BankPrior:
    """What a bank starts from; computed once for a library and side.

    Args:
        names: Task names, the last one "unknown".
        tasks: (H,) index of each hypothesis' task.
        durations: (H,) seconds between the crossings of the onset speed, as the segmentation cuts.
        whole_durations: (H,) seconds from rest to rest, see :mod:`hri_prediction.tracks.bell`.
        log_prior: (H,) normalised log weights.
        means: (H, n).
        covariances: (H, n, n).
        noises: (H, 6, 6).
        basis: Common basis.
        aims: Where a reach may be re-aimed to.
    """

    names: tuple[str, ...]
    tasks: NDArray[np.int64]
    durations: Array
    whole_durations: Array
    log_prior: Array
    means: Array
    covariances: Array
    noises: Array
    basis: PhaseBasis
    aims: Aims

    @property
    def lead_s(self) -> float:
        """Expected time from rest to the crossing of the onset speed, seconds."""
        return float(np.exp(self.log_prior) @ (self.whole_durations - self.durations)) / 2.0


def _path_speed(promp: ProMP) -> float:
    """Largest root mean square speed of the wrist over the phase, metres per phase."""
    slopes = promp.basis.derivatives(np.linspace(0.0, 1.0, 101))
    width = promp.basis.count
    square = np.zeros(len(slopes))
    for d in range(3, DIMS):
        own = slice(d * width, (d + 1) * width)
        square += (slopes @ promp.mean[own]) ** 2
        square += np.einsum("kw,wv,kv->k", slopes, promp.covariance[own, own], slopes)
    return math.sqrt(float(square.max()))


def _no_less(noise: Array, variance: float) -> Array:
    """Noise (6, 6) with variances raised to at least ``variance``; correlations only become weaker."""
    return noise + np.diag(np.maximum(variance - np.diag(noise), 0.0))


def bank_prior(tasks: tuple[TaskModel, ...], config: PredictorConfig) -> BankPrior:
    """Spread every task, and "unknown", over a log-normal grid of durations."""
    basis = tasks[0].promp.basis
    models = (*tasks, unknown_task(tasks, config))
    scale = np.linspace(-config.duration_range, config.duration_range, config.durations)
    scale = scale if config.durations > 1 else np.zeros(1)
    share = np.exp(-0.5 * scale**2)
    share /= share.sum()
    known = (1.0 - config.unknown_probability) / len(tasks)
    indices, durations, priors = [], [], []
    for i, model in enumerate(models):
        probability = known if model.name != UNKNOWN else config.unknown_probability
        indices.append(np.full(scale.size, i))
        durations.append(model.duration_mean_s * np.exp(scale * model.duration_log_sd))
        priors.append(probability * share)
    index = np.concatenate(indices)
    noises = np.stack([_no_less(m.promp.noise, config.noise_sd**2) for m in models])
    between = np.concatenate(durations)
    speeds = np.array([_path_speed(m.promp) for m in models])[index] / between
    return BankPrior(
        names=tuple(m.name for m in models),
        tasks=index,
        durations=between,
        whole_durations=from_rest_to_rest(between, config.onset_speed / speeds),
        log_prior=np.log(np.concatenate(priors)),
        means=np.stack([m.promp.mean for m in models])[index],
        covariances=np.stack([m.promp.covariance for m in models])[index],
        noises=noises[index],
        basis=basis,
        aims=aims_of(tasks, config.reaim_sd),
    )


class HypothesisBank:
    """The running belief over (task, duration, weights) of one reach.

    Args:
        prior: Belief at onset.
        config: Settings.
    """

    def __init__(self, prior: BankPrior, config: PredictorConfig) -> None:
        self.prior = prior
        self.config = config
        self.means = prior.means.copy()
        self.covariances = prior.covariances.copy()
        self.log_weights = prior.log_prior.copy()
        self._inverse_durations = 1.0 / prior.durations
        self._centres = prior.basis.centres
        self._reaim = ReaimBank(prior.aims, config.change_rate, config.noise_sd, config.reaim_sd)
        self._gain = np.zeros((DIMS, prior.means.shape[1]))
        self._rows = np.zeros((1, prior.basis.count))

    def restart(self) -> None:
        """Return to the prior: a new reach begins."""
        np.copyto(self.means, self.prior.means)
        np.copyto(self.covariances, self.prior.covariances)
        np.copyto(self.log_weights, self.prior.log_prior)
        self._reaim.restart()

    def observe(self, elapsed_s: float, value: Array, seen: NDArray[np.bool_]) -> int:
        """Condition on (elbow, wrist) (6,), relative to the shoulder at onset.

        Args:
            elapsed_s: Time since onset.
            value: (6,) metres; entries not seen are ignored.
            seen: (6,) bool.

        Returns:
            Number of hypotheses that failed numerically (0 in sound use).
        """
        failed, evidence = update_bank(
            self.means,
            self.covariances,
            self.log_weights,
            self.prior.log_prior,
            self._inverse_durations,
            self.prior.noises,
            elapsed_s,
            value,
            seen,
            self._centres,
            self.prior.basis.variance,
            self.config.evidence_weight,
            self.config.switching,
            self._gain,
            self._rows,
        )
        if self.config.change_rate > 0.0:
            self._reaim.observe(elapsed_s, value, seen, evidence)
        return int(failed)

    @property
    def weights(self) -> Array:
        """(H,) normalised probabilities of the hypotheses, if the reach goes on as begun."""
        weight = np.exp(self.log_weights - self.log_weights.max())
        normalised: Array = weight / weight.sum()
        return normalised

    def task_probabilities(self) -> Array:
        """(tasks,) probabilities in the order of ``prior.names``."""
        count = len(self.prior.names)
        begun, changed = self._reaim.shares()
        shares = begun * np.bincount(self.prior.tasks, self.weights, minlength=count)
        shares += np.bincount(self.prior.aims.tasks, changed.sum(axis=0), minlength=count)
        return np.asarray(shares, dtype=float)

    def duration(self) -> tuple[float, float]:
        """Posterior mean and standard deviation of the duration from rest to rest, seconds."""
        begun, changed = self._reaim.shares()
        durations = np.r_[
            self.prior.whole_durations, self.prior.lead_s + self._reaim.durations().ravel()
        ]
        weights = np.r_[begun * self.weights, changed.ravel()]
        mean = float(weights @ durations)
        square = float(weights @ (durations - mean) ** 2)
        return mean, math.sqrt(max(0.0, square))

    def moments(self, elapsed_s: float, step_s: float, points: int) -> tuple[Array, Array]:
        """Mixture at ``elapsed_s + k step_s``.

        Returns:
            mean (K, 2, 3) and covariance (K, 2, 3, 3) of elbow and wrist, relative to the
            shoulder at onset.
        """
        weights = self.weights
        begun, changed = self._reaim.shares()
        if self.config.output == "likeliest":
            best = int(np.argmax(self.task_probabilities()))
            weights = np.where(self.prior.tasks == best, weights, 0.0)
            changed = np.where(self.prior.aims.tasks == best, changed, 0.0)
        weights = begun * weights
        least = NEGLIGIBLE * max(float(weights.max()), float(changed.max()))
        weights[weights < least] = 0.0
        changed[changed < least] = 0.0
        total = float(weights.sum() + changed.sum())
        share = float(weights.sum()) / total
        mean = np.zeros((points, DIMS))
        covariance = np.zeros((points, 2, 3, 3))
        if share > 0.0:
            mix_bank(
                self.means,
                self.covariances,
                weights / (share * total),
                self._inverse_durations,
                elapsed_s,
                step_s,
                self._centres,
                self.prior.basis.variance,
                mean,
                covariance,
            )
        if share < 1.0:
            first, second = self._reaim.moments(changed / total, elapsed_s, step_s, points)
            parts = mean.reshape(points, 2, 3)
            second += share * (covariance + parts[..., :, None] * parts[..., None, :])
            mean = share * mean + first
            parts = mean.reshape(points, 2, 3)
            covariance = second - parts[..., :, None] * parts[..., None, :]
        return mean.reshape(points, 2, 3), covariance
