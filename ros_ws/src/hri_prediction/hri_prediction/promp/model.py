r"""The probabilistic movement primitive: a Gaussian over trajectories (thesis section 3.2).

.. math:: y_t = \Phi(z_t) \omega + \epsilon, \qquad
          \omega \sim N(\mu_\omega, \Sigma_\omega), \quad \epsilon \sim N(0, \Sigma_y)

One joint covariance spans all dimensions, so observing some dimensions improves the others.
Source: Paraschos et al., Autonomous Robots 42 (2018), doi:10.1007/s10514-017-9648-7.
"""

from __future__ import annotations

import json
import math
import zipfile
import zlib
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import scipy.linalg as sla
from numpy.typing import ArrayLike, NDArray

from hri_prediction.errors import DataError
from hri_prediction.promp.basis import PhaseBasis

Array = NDArray[np.float64]
FORMAT = "hri-promp-1"

# All that numpy and zipfile raise on files whose bits were changed at random.
_UNREADABLE = (
    OSError,
    ValueError,
    KeyError,
    EOFError,
    AttributeError,
    TypeError,
    MemoryError,
    OverflowError,
    RuntimeError,
    zipfile.BadZipFile,
    zlib.error,
)


def _frozen(array: ArrayLike) -> Array:
    copy = np.array(array, dtype=float)
    copy.setflags(write=False)
    return copy


def cholesky(matrix: Array, what: str) -> Array:
    """Lower Cholesky factor.

    Raises:
        DataError: naming ``what`` when the matrix is not positive definite.
    """
    try:
        factor: Array = sla.cholesky(matrix, lower=True)
    except (sla.LinAlgError, ValueError) as error:
        raise DataError(f"{what} is not positive definite", expected="a covariance") from error
    return factor


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
        weights = self.mean.reshape(self.dims, self.basis.count)
        mean: Array = self._rows(phases, order) @ weights.T
        return mean

    def trajectory_covariance(self, phases: ArrayLike, order: int = 0) -> Array:
        """Covariance (T, D, D) at each of ``phases`` (T,), without observation noise."""
        count = self.basis.count
        blocks = self.covariance.reshape(self.dims, count, self.dims, count)
        rows = self._rows(phases, order)
        half = np.einsum("tw,dwev->tdev", rows, blocks, optimize=True)
        covariance: Array = np.einsum("tdev,tv->tde", half, rows, optimize=True)
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
    ) -> ProMP:
        """The distribution given observations; a new object (thesis eqs. 3.6-3.7).

        Uses the square-root information form, which stays positive definite for any number of
        observations.

        Args:
            phases: (T,) phases of the observations.
            values: (T, D) observed values; NaN = not seen.
            mask: (T, D) or (D,) True where seen; default: everything finite.
            noise: (D, D) or (T, D, D) positive definite; default: the model's own noise.
            order: 0 for positions, 1 for derivatives by phase.

        Raises:
            DataError: on inconsistent shapes or noise that is not positive definite.
        """
        design, residual, _ = self._whitened(phases, values, mask, noise, order)
        if residual.size == 0:
            return self
        factor = cholesky(self.covariance, "weight covariance")
        scaled = design @ factor
        inner = np.eye(self.mean.size) + scaled.T @ scaled
        inner_factor = cholesky(inner, "conditioned precision")
        step = sla.cho_solve((inner_factor, True), scaled.T @ residual)
        root = sla.solve_triangular(inner_factor, factor.T, lower=True)
        return replace(self, mean=self.mean + factor @ step, covariance=root.T @ root)

    def log_likelihood(
        self,
        phases: ArrayLike,
        values: ArrayLike,
        *,
        mask: ArrayLike | None = None,
        noise: ArrayLike | None = None,
    ) -> float:
        """Log density of the seen entries of ``values``; arguments as in :meth:`condition`."""
        design, residual, log_scale = self._whitened(phases, values, mask, noise, 0)
        if residual.size == 0:
            return 0.0
        factor = cholesky(self.covariance, "weight covariance")
        scaled = design @ factor
        inner = cholesky(np.eye(self.mean.size) + scaled.T @ scaled, "conditioned precision")
        projected = sla.solve_triangular(inner, scaled.T @ residual, lower=True)
        log_det = 2.0 * float(np.sum(np.log(np.diag(inner)))) + log_scale
        square = float(residual @ residual - projected @ projected)
        return -0.5 * (square + log_det + residual.size * math.log(2.0 * math.pi))

    def kl_divergence(self, other: ProMP) -> float:
        """KL(self || other) of the weight distributions, in nats, at least 0."""
        if other.mean.shape != self.mean.shape:
            raise DataError(f"{other.mean.size} weights", expected=f"{self.mean.size} weights")
        own = cholesky(self.covariance, "weight covariance")
        reference = cholesky(other.covariance, "weight covariance")
        ratio = sla.solve_triangular(reference, own, lower=True)
        shift = sla.solve_triangular(reference, other.mean - self.mean, lower=True)
        log_det = 2.0 * float(np.sum(np.log(np.diag(reference)) - np.log(np.diag(own))))
        divergence = float(np.sum(ratio**2) + shift @ shift) - self.mean.size + log_det
        return max(0.0, 0.5 * divergence)

    def _rows(self, phases: ArrayLike, order: int) -> Array:
        if order not in (0, 1):
            raise DataError(f"order {order}", expected="0 (positions) or 1 (derivatives)")
        return self.basis.derivatives(phases) if order else self.basis.values(phases)

    def _whitened(
        self,
        phases: ArrayLike,
        values: ArrayLike,
        mask: ArrayLike | None,
        noise: ArrayLike | None,
        order: int,
    ) -> tuple[Array, Array, float]:
        """Design (M, D*W) and residual (M,) of the seen entries, noise whitened to identity.

        The third value is the log determinant of the noise of these entries.
        """
        times = np.atleast_1d(np.asarray(phases, dtype=float))
        observed = np.asarray(values, dtype=float)
        observed = observed[None, :] if observed.ndim == 1 else observed
        if observed.shape != (times.size, self.dims):
            raise DataError(f"values {observed.shape}", expected=f"shape {(times.size, self.dims)}")
        seen = np.isfinite(observed)
        if mask is not None:
            seen = seen & np.broadcast_to(np.asarray(mask, dtype=bool), observed.shape)
        covariances = np.broadcast_to(
            self.noise if noise is None else np.asarray(noise, dtype=float),
            (times.size, self.dims, self.dims),
        )
        count = self.basis.count
        rows = self._rows(times, order)
        error = observed - rows @ self.mean.reshape(self.dims, count).T
        designs, residuals, log_scale = [], [], 0.0
        for t in range(times.size):
            dims = np.flatnonzero(seen[t])
            if dims.size == 0:
                continue
            design = np.zeros((dims.size, self.dims, count))
            design[np.arange(dims.size), dims] = rows[t]
            factor = cholesky(covariances[t][np.ix_(dims, dims)], "observation noise")
            white = sla.solve_triangular(
                factor,
                np.column_stack([design.reshape(dims.size, -1), error[t, dims]]),
                lower=True,
            )
            designs.append(white[:, :-1])
            residuals.append(white[:, -1])
            log_scale += 2.0 * float(np.sum(np.log(np.diag(factor))))
        if not designs:
            return np.zeros((0, self.mean.size)), np.zeros(0), 0.0
        return np.concatenate(designs), np.concatenate(residuals), log_scale

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
        except (KeyError, TypeError, ValueError, IndexError) as error:
            raise DataError(f"a ProMP lacks or garbles {error}") from error
        cholesky(model.covariance, "stored weight covariance")
        cholesky(model.noise, "stored observation noise")
        return model


def write_npz(path: str | Path, arrays: dict[str, Any], header: dict[str, Any]) -> None:
    """Write arrays and a JSON header into one compressed .npz, without pickles."""
    np.savez_compressed(path, header=np.array(json.dumps(header)), **arrays)


def read_npz(path: str | Path, expected_format: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """Read what :func:`write_npz` wrote: (arrays, header).

    Raises:
        DataError: when the file is missing, damaged, or of another format.
    """
    try:
        with np.load(path, allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in archive.files}
        header = json.loads(str(arrays.pop("header")[()]))
    except _UNREADABLE as error:
        text = " ".join(str(error).split())
        raise DataError(
            f"cannot read {path}: {text}", expected=f"a .npz of format {expected_format}"
        ) from error
    found = header.get("format") if isinstance(header, dict) else None
    if found != expected_format:
        raise DataError(f"{path} has format {found!r}", expected=repr(expected_format))
    return arrays, header


def save_promp(path: str | Path, model: ProMP) -> None:
    """Save one model as .npz with a JSON header."""
    arrays, header = model.to_arrays()
    write_npz(path, arrays, {"format": FORMAT, **header})


def load_promp(path: str | Path) -> ProMP:
    """Load one model.

    Raises:
        DataError: on damaged or foreign files.
    """
    arrays, header = read_npz(path, FORMAT)
    return ProMP.from_arrays(arrays, header)
