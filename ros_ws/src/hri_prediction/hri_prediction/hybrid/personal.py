r"""What a person's own reaches add to a first guess: a Gaussian with a prior on its mean and its spread.

Deviations of reaches from the expected path, as weights of basis functions, are

.. math:: d_i \sim N(\mu, \Sigma), \qquad \mu \sim N(0, S_0), \qquad
          \Sigma \sim IW\ \text{with mean}\ \Lambda_0\ \text{that counts for}\ \nu_0\ \text{reaches}.

:math:`S_0` is how people stray from the optimum of a model, always in the same way (the seat of the
shoulder, the trunk that goes along, lengths, habits); :math:`\Lambda_0` is how reaches of one person
scatter. The two must not be one: after a few reaches the first is known, the second is not. Alternating

.. math:: S = S_0 - S_0 (S_0 + \Sigma / N)^{-1} S_0, \qquad
          \mu = S_0 (S_0 + \Sigma / N)^{-1} \bar d, \qquad
          \Sigma = \frac{\nu_0 \Lambda_0 + \sum_i (d_i - \mu)(d_i - \mu)^\top + N S}{\nu_0 + N}

takes for each the mean of what is known of the other: expectation and maximisation, with
:math:`\Sigma` by its posterior mean (Bishop, Pattern Recognition and Machine Learning, 2006, sections 2.3.6
and 9.4). The next reach has the mean :math:`\mu` and the covariance
:math:`\Sigma + S`. So the weight of the optimum fades as reaches come, and never all of it at once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hri_prediction.errors import DataError
from hri_prediction.hybrid.config import HybridConfig
from hri_prediction.prediction.library import DIMS
from hri_prediction.promp.basis import PhaseBasis
from hri_prediction.promp.learning import LearningConfig, smooth_covariance
from hri_prediction.promp.linalg import cholesky, solve_cholesky
from hri_prediction.promp.regression import fit_weights

Array = NDArray[np.float64]

_ITERATIONS = 50
_TOLERANCE = 1e-6


@dataclass(frozen=True, eq=False)
class PersonalPrior:
    """What is expected of deviations, as weights of all dimensions (n,).

    Attributes:
        systematic: S_0 (n, n).
        scatter: Lambda_0 (n, n).
        strength: nu_0, in reaches.
    """

    systematic: Array
    scatter: Array
    strength: float


@dataclass(frozen=True, eq=False)
class Personal:
    """What is known of deviations.

    Attributes:
        mean: mu (n,).
        systematic: What is still open of it, S (n, n).
        scatter: Sigma (n, n).
        reaches: N.
    """

    mean: Array
    systematic: Array
    scatter: Array
    reaches: int

    @property
    def covariance(self) -> Array:
        """Of the next reach (n, n)."""
        return self.systematic + self.scatter


def personal_prior(
    basis: PhaseBasis, expected: Array, config: HybridConfig, smoothness: float
) -> PersonalPrior:
    """What is expected before anything is seen.

    Args:
        basis: Of the phase.
        expected: Weights of the expected path (6 W,), from the shoulder: larger people reach further.
        config: How far people stray.
        smoothness: Phase over which deviations stay alike.
    """
    learning = LearningConfig(smoothness=smoothness)
    shape = _coupled(smooth_covariance(basis, DIMS, learning), basis.count, config.coupling)
    level = np.ones(basis.count)
    phases = np.linspace(0.0, 1.0, 101)
    drift = fit_weights(basis, phases, phases[:, None], 1e-9)
    common = np.kron(np.array([[1.0, config.coupling], [config.coupling, 1.0]]), np.eye(3))
    # Early or late on the way, not at its ends: along the path, as far as it is fast.
    rows = basis.derivatives(phases) @ expected.reshape(DIMS, -1).T
    late = fit_weights(basis, phases, rows * (4.0 * phases * (1.0 - phases))[:, None], 1e-9)
    pace = np.outer(late, late)
    systematic = (
        config.pace_sd**2 * pace
        + config.offset_sd**2 * np.kron(common, np.outer(level, level))
        + config.drift_sd**2 * np.kron(common, np.outer(drift, drift))
        + config.scale_sd**2 * np.outer(expected, expected)
        + config.detour_sd**2 * shape
    )
    scatter = config.variability_sd**2 * shape + config.pace_scatter_sd**2 * pace
    return PersonalPrior(systematic, scatter, config.variability_strength)


def _coupled(covariance: Array, width: int, coupling: float) -> Array:
    """A block-diagonal covariance with the axes of elbow and wrist correlated."""
    blocks = covariance.reshape(DIMS, width, DIMS, width).copy()
    for axis in range(3):
        blocks[axis, :, axis + 3] = blocks[axis + 3, :, axis] = coupling * blocks[axis, :, axis]
    return blocks.reshape(covariance.shape)


def learn_personal(prior: PersonalPrior, deviations: Array) -> Personal:
    """What deviations of reaches say.

    Args:
        prior: What was expected.
        deviations: d (N, n); N may be 0.

    Raises:
        DataError: on another shape, or what is not finite.
    """
    size = len(prior.scatter)
    if deviations.ndim != 2 or deviations.shape[1] != size or not np.isfinite(deviations).all():
        raise DataError(
            f"deviations of shape {deviations.shape}", expected=f"finite numbers (N, {size})"
        )
    count = len(deviations)
    if count == 0:
        return Personal(np.zeros(size), prior.systematic, prior.scatter, 0)
    middle = deviations.mean(axis=0)
    scatter, mean = prior.scatter, middle
    for _ in range(_ITERATIONS):
        factor = cholesky(prior.systematic + scatter / count, "spread of people and reaches")
        new = prior.systematic @ solve_cholesky(factor, middle)
        open_ = prior.systematic - prior.systematic @ solve_cholesky(factor, prior.systematic)
        open_ = 0.5 * (open_ + open_.T)
        apart = deviations - new
        scatter = prior.strength * prior.scatter + apart.T @ apart + count * open_
        scatter = scatter / (prior.strength + count)
        moved = float(np.abs(new - mean).max())
        mean = new
        if moved < _TOLERANCE:
            break
    return Personal(mean, open_, 0.5 * (scatter + scatter.T), count)
