r"""What demonstrations say about weights, in numbers that do not grow with their length.

With y the values of one dimension of a demonstration, R its basis values (T, W), and
:math:`e = y - R \hat w` what the ridge regression leaves, all that learning needs is

.. math:: G = R^\top R, \quad \hat w, \quad R^\top e, \quad e^\top e, \quad T

since :math:`\lVert y - R w\rVert^2 = e^\top e - 2 (w - \hat w)^\top R^\top e
+ (w - \hat w)^\top G (w - \hat w)`, without cancellation of large numbers. Demonstrations with the
same phases and the same missing values share one G.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hri_prediction.errors import DataError
from hri_prediction.promp.basis import PhaseBasis
from hri_prediction.promp.linalg import cholesky, solve_cholesky

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Demonstration:
    """One movement over its phase.

    Args:
        phases: (T,) in [0, 1].
        values: (T, D); NaN where not seen.
        weight: Share of one demonstration that it counts for, above 0.
    """

    phases: Array
    values: Array
    weight: float = 1.0


@dataclass(frozen=True)
class Evidence:
    """Sufficient statistics of N demonstrations that share phases and missing values.

    Args:
        gram: (D, W, W) G of each dimension.
        fitted: (N, D, W) ridge regression.
        cross: (N, D, W) products of the basis with what the regression leaves.
        square: (N, D) sum of squares of what it leaves.
        number: (D,) values seen.
        share: (N,) weights of the demonstrations.
    """

    gram: Array
    fitted: Array
    cross: Array
    square: Array
    number: Array
    share: Array


def fit_weights(basis: PhaseBasis, phases: Array, values: Array, ridge: float) -> Array:
    """Ridge regression of one trajectory (T, D): weights (D * W,).

    Entries that are NaN are left out, dimension by dimension.

    Raises:
        DataError: if a dimension has no finite value.
    """
    seen = np.isfinite(values)
    rows = basis.values(phases)
    return np.concatenate(
        [
            _regress(rows, values[:, d : d + 1], seen[:, d], ridge)[1].ravel()
            for d in range(values.shape[1])
        ]
    )


def gather_evidence(
    basis: PhaseBasis, demonstrations: Sequence[Demonstration], ridge: float
) -> list[Evidence]:
    """Statistics of demonstrations, one entry for each set of phases and missing values.

    Raises:
        DataError: if a dimension of a demonstration has no finite value.
    """
    found = []
    for members, values in _alike(demonstrations):
        rows = basis.values(members[0].phases)
        seen = np.isfinite(values[:, 0])
        dims, width, count = values.shape[2], basis.count, len(members)
        if seen.all():
            gram, *parts = _regress(rows, values.reshape(seen.shape[0], -1), seen[:, 0], ridge)
            grams = np.broadcast_to(gram, (dims, width, width))
            fitted, cross, square = (part.reshape(count, dims, -1) for part in parts)
        else:
            each = [_regress(rows, values[:, :, d], seen[:, d], ridge) for d in range(dims)]
            grams = np.stack([part[0] for part in each])
            fitted, cross, square = (
                np.stack([part[k].reshape(count, -1) for part in each], axis=1) for k in (1, 2, 3)
            )
        share = np.array([demo.weight for demo in members], dtype=float)
        number = seen.sum(axis=0).astype(float)
        found.append(Evidence(grams, fitted, cross, square[..., 0], number, share))
    return found


def _alike(
    demonstrations: Sequence[Demonstration],
) -> list[tuple[list[Demonstration], Array]]:
    """Demonstrations with the same phases and missing values, and their values (T, N, D)."""
    by_phases: dict[bytes, list[Demonstration]] = {}
    for demo in demonstrations:
        by_phases.setdefault(demo.phases.tobytes(), []).append(demo)
    groups = []
    for members in by_phases.values():
        values = np.array([demo.values for demo in members], dtype=float)
        seen = np.isfinite(values)
        by_mask: dict[bytes, list[int]] = {}
        if not seen.all():
            for i in range(len(members)):
                by_mask.setdefault(seen[i].tobytes(), []).append(i)
        for index in by_mask.values() or (range(len(members)),):
            chosen = values[list(index)] if by_mask else values
            groups.append(([members[i] for i in index], chosen.swapaxes(0, 1)))
    return groups


def _regress(
    rows: Array, values: Array, seen: NDArray[np.bool_], ridge: float
) -> tuple[Array, Array, Array, Array]:
    """Ridge regression of the columns of ``values`` (T, K) at the times ``seen`` (T,).

    Returns:
        G (W, W); and of each column the weights (K, W), the products (K, W) of the basis with what they
        leave, and the sum of squares (K,) of that.
    """
    if not seen.any():
        raise DataError("a dimension of a demonstration was never seen")
    if not seen.all():
        rows, values = rows[seen], values[seen]
    gram = rows.T @ rows
    # Towards a constant, not towards zero: the origin has no meaning for a position.
    level = values.mean(axis=0)
    ridge = max(ridge, 1e-12)
    ridged = gram + ridge * np.eye(gram.shape[0])
    centred = values - level
    relative = solve_cholesky(cholesky(ridged, "regression"), rows.T @ centred)
    left = centred - rows @ relative
    # The basis sums to one, so adding a constant to all weights adds it to the trajectory.
    # By the normal equations, R^T e = ridge w.
    return gram, (relative + level).T, ridge * relative.T, np.einsum("tk,tk->k", left, left)
