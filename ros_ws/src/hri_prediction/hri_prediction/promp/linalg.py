"""Cholesky factors and solves with them: LAPACK without the checks that cost more than small matrices."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack

from hri_prediction.errors import DataError

Array = NDArray[np.float64]


def cholesky(matrix: Array, what: str) -> Array:
    """Lower Cholesky factor.

    Raises:
        DataError: naming ``what`` when the matrix is not square or not positive definite.
    """
    info = 1
    if matrix.ndim == 2 and matrix.shape[0] == matrix.shape[1]:
        factor, info = lapack.dpotrf(matrix, lower=1, clean=1)
    if info != 0:
        raise DataError(f"{what} is not positive definite", expected="a covariance")
    found: Array = factor
    return found


def solve_lower(factor: Array, right: Array) -> Array:
    """``L x = right`` for a lower triangular L with a positive diagonal."""
    found: Array = lapack.dtrtrs(factor, right, lower=1)[0]
    return found


def solve_cholesky(factor: Array, right: Array) -> Array:
    """``L L^T x = right``."""
    found: Array = lapack.dpotrs(factor, right, lower=1)[0]
    return found
