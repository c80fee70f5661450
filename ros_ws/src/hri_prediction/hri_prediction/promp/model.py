r"""The probabilistic movement primitive: a Gaussian over trajectories (thesis section 3.2).

.. math:: y_t = \Phi(z_t) \omega + \epsilon, \qquad
          \omega \sim N(\mu_\omega, \Sigma_\omega), \quad \epsilon \sim N(0, \Sigma_y)

One joint covariance spans all dimensions, so observing some dimensions improves the others; an
observation may hold positions, velocities, or any part of both (:mod:`~hri_prediction.promp.observation`).
Source: Paraschos et al., Autonomous Robots 42 (2018), doi:10.1007/s10514-017-9648-7.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hri_prediction.errors import DataError
from hri_prediction.promp.basis import PhaseBasis
from hri_prediction.promp.linalg import cholesky, solve_cholesky, solve_lower
from hri_prediction.promp.observation import (
    Whitened,
    observation_noise,
    observation_rows,
    whiten,
)

Array = NDArray[np.float64]


def _frozen(array: ArrayLike) -> Array:
    copy = np.array(array, dtype=float)
    copy.setflags(write=False)
    return copy


@dataclass(frozen=True)
class ProMP:
    """Gaussian over D-dimensional trajectories, described by D * W weights.

    Weights are ordered by dimension: those of dimension d are ``mean[d * W:(d + 1) * W]``.

    Args:
        basis: Basis functions over the phase.
        mean: (D * W,) mean of the weights, in the unit of the trajectory.
        covariance: (D * W, D * W) symmetric positive definite.
        noise: (D, D) covariance of an observation about the trajectory.

    Raises:
        DataError: on inconsistent shapes or values that are not finite.
    """

    basis: PhaseBasis
    mean: Array
    covariance: Array
    noise: Array

    def __post_init__(self) -> None:
        for name in ("mean", "covariance", "noise"):
            object.__setattr__(self, name, _frozen(getattr(self, name)))
        size, dims = self.mean.shape[0], self.noise.shape[0]
        if (
            self.covariance.shape != (size, size)
            or self.noise.shape != (dims, dims)
            or size != dims * self.basis.count
        ):
            raise DataError(
                f"mean {self.mean.shape}, covariance {self.covariance.shape}, noise "
                f"{self.noise.shape} with {self.basis.count} weights a dimension",
                expected="shapes (D*W,), (D*W, D*W), (D, D)",
            )
        if not all(np.isfinite(a).all() for a in (self.mean, self.covariance, self.noise)):
            raise DataError("a ProMP parameter is not finite")

    @property
    def dims(self) -> int:
        """Number D of dimensions."""
        return int(self.noise.shape[0])

    # -- the distribution of the trajectory -------------------------------------------------

    def trajectory_mean(self, phases: ArrayLike, order: int = 0) -> Array:
        """Mean at ``phases`` (T,): (T, D); ``order`` 1 gives the derivative by phase."""
        rows = observation_rows(self.basis, phases, order)[0]
        mean: Array = rows @ self._by_dimension.T
        return mean

    def trajectory_covariance(self, phases: ArrayLike, order: int = 0) -> Array:
        """Covariance (T, D, D) at each of ``phases`` (T,), without observation noise."""
        return self._covariance(observation_rows(self.basis, phases, order))

    def state_mean(self, phases: ArrayLike, duration: float) -> Array:
        """Mean positions and velocities (T, 2 D) at ``phases`` (T,) of a movement of ``duration`` [s].

        Columns are the D positions, then the D velocities by time.
        """
        rows = observation_rows(self.basis, phases, duration=duration)
        mean = np.einsum("otw,dw->tod", rows, self._by_dimension)
        return mean.reshape(mean.shape[0], 2 * self.dims)

    def state_covariance(self, phases: ArrayLike, duration: float) -> Array:
        """Joint covariance (T, 2 D, 2 D) of what :meth:`state_mean` gives, without noise."""
        return self._covariance(observation_rows(self.basis, phases, duration=duration))

    @property
    def _by_dimension(self) -> Array:
        return self.mean.reshape(self.dims, self.basis.count)

    def _covariance(self, rows: Array) -> Array:
        """Covariance (T, O * D, O * D) of what ``rows`` (O, T, W) make of the weights."""
        count, size = self.basis.count, rows.shape[0] * self.dims
        blocks = self.covariance.reshape(self.dims, count, self.dims, count)
        half = np.einsum("otw,dwev->todev", rows, blocks, optimize=True)
        full = np.einsum("todev,ptv->todpe", half, rows, optimize=True)
        covariance: Array = full.reshape(-1, size, size)
        return 0.5 * (covariance + covariance.swapaxes(-1, -2))

    def sample_weights(self, rng: np.random.Generator, count: int) -> Array:
        """Draw weight vectors: (count, D * W)."""
        factor = cholesky(self.covariance, "weight covariance")
        draws: Array = self.mean + rng.standard_normal((count, self.mean.size)) @ factor.T
        return draws

    def sample(self, phases: ArrayLike, rng: np.random.Generator, count: int = 1) -> Array:
        """Draw trajectories without observation noise at ``phases`` (T,): (count, T, D)."""
        weights = self.sample_weights(rng, count).reshape(count, self.dims, self.basis.count)
        drawn: Array = np.einsum("tw,ndw->ntd", self.basis.values(phases), weights)
        return drawn

    # -- inference --------------------------------------------------------------------------

    def condition(
        self,
        phases: ArrayLike,
        values: ArrayLike,
        *,
        mask: ArrayLike | None = None,
        noise: ArrayLike | None = None,
        order: int = 0,
        duration: float | None = None,
    ) -> ProMP:
        """The distribution given observations; a new object (thesis eqs. 3.6-3.7).

        Uses the square-root information form, which stays positive definite for any number of
        observations.

        With ``duration`` an observation stacks the D positions and the D velocities by time, and E
        = 2 D; else E = D.

        Args:
            phases: (T,) phases of the observations.
            values: (T, E) observed values; NaN = not seen.
            mask: (T, E) or (E,) True where seen; default: everything finite.
            noise: (E, E) or (T, E, E) positive definite. Default: the model's own noise, which
                speaks of positions alone: velocities need a noise that is given.
            order: 0 for positions, 1 for derivatives by phase.
            duration: Duration of the movement in seconds, for observations with velocities.

        Raises:
            DataError: on inconsistent arguments or noise that is not positive definite.
        """
        seen = self._whitened(phases, values, mask, noise, order, duration)
        if seen.residual.size == 0:
            return self
        factor = cholesky(self.covariance, "weight covariance")
        scaled = seen.design @ factor
        inner = np.eye(self.mean.size) + scaled.T @ scaled
        inner_factor = cholesky(inner, "conditioned precision")
        step = solve_cholesky(inner_factor, scaled.T @ seen.residual)
        root = solve_lower(inner_factor, factor.T)
        return replace(self, mean=self.mean + factor @ step, covariance=root.T @ root)

    def log_likelihood(
        self,
        phases: ArrayLike,
        values: ArrayLike,
        *,
        mask: ArrayLike | None = None,
        noise: ArrayLike | None = None,
        duration: float | None = None,
    ) -> float:
        """Log density of the seen entries of ``values``; arguments as in :meth:`condition`."""
        seen = self._whitened(phases, values, mask, noise, 0, duration)
        if seen.residual.size == 0:
            return 0.0
        factor = cholesky(self.covariance, "weight covariance")
        scaled = seen.design @ factor
        inner = cholesky(np.eye(self.mean.size) + scaled.T @ scaled, "conditioned precision")
        projected = solve_lower(inner, scaled.T @ seen.residual)
        log_det = 2.0 * float(np.sum(np.log(np.diag(inner)))) + seen.log_det
        square = float(seen.residual @ seen.residual - projected @ projected)
        return -0.5 * (square + log_det + seen.residual.size * math.log(2.0 * math.pi))

    def kl_divergence(self, other: ProMP) -> float:
        """KL(self || other) of the weight distributions, in nats, at least 0."""
        if other.mean.shape != self.mean.shape:
            raise DataError(f"{other.mean.size} weights", expected=f"{self.mean.size} weights")
        own = cholesky(self.covariance, "weight covariance")
        reference = cholesky(other.covariance, "weight covariance")
        ratio = solve_lower(reference, own)
        shift = solve_lower(reference, other.mean - self.mean)
        log_det = 2.0 * float(np.sum(np.log(np.diag(reference)) - np.log(np.diag(own))))
        divergence = float(np.sum(ratio**2) + shift @ shift) - self.mean.size + log_det
        return max(0.0, 0.5 * divergence)

    def _whitened(
        self,
        phases: ArrayLike,
        values: ArrayLike,
        mask: ArrayLike | None,
        noise: ArrayLike | None,
        order: int,
        duration: float | None,
    ) -> Whitened:
        times = np.atleast_1d(np.asarray(phases, dtype=float))
        rows = observation_rows(self.basis, times, order, duration)
        spread = observation_noise(self.noise, noise, duration)
        return whiten(rows, self._by_dimension, values, mask, spread)

    # -- storage ----------------------------------------------------------------------------

    def to_arrays(self, prefix: str = "") -> tuple[dict[str, Array], dict[str, Any]]:
        """Arrays (named with ``prefix``) and a JSON-able header that together rebuild the model."""
        arrays = {
            f"{prefix}mean": np.asarray(self.mean),
            f"{prefix}covariance": np.asarray(self.covariance),
            f"{prefix}noise": np.asarray(self.noise),
        }
        return arrays, {"count": self.basis.count, "overlap": self.basis.overlap}

    @staticmethod
    def from_arrays(arrays: Any, header: dict[str, Any], prefix: str = "") -> ProMP:
        """Inverse of :meth:`to_arrays`.

        Raises:
            DataError: if something is missing or does not fit together.
        """
        try:
            model = ProMP(
                PhaseBasis(int(header["count"]), float(header["overlap"])),
                arrays[f"{prefix}mean"],
                arrays[f"{prefix}covariance"],
                arrays[f"{prefix}noise"],
            )
        except (ArithmeticError, LookupError, TypeError, ValueError) as error:
            raise DataError(f"a ProMP lacks or garbles {error}") from error
        cholesky(model.covariance, "stored weight covariance")
        cholesky(model.noise, "stored observation noise")
        return model
