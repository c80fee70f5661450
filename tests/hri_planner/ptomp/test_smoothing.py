"""Noise with covariance R^-1."""

import numpy as np
import pytest

from hri_planner.ptomp.smoothing import add_smooth_noise, banded_cholesky, smoothing_factors


def _matrix(size):
    """A'A of the second difference of sequences that are zero outside."""
    a = np.zeros((size + 2, size))
    for i in range(size):
        a[i : i + 3, i] = [1, -2, 1]
    return a.T @ a


@pytest.mark.parametrize("size", [1, 2, 3, 10, 60])
def test_factor_is_that_of_r(size):
    band = banded_cholesky(size)
    factor = np.diag(band[0])
    factor += np.diag(band[1, : size - 1], -1)
    if size > 2:
        factor += np.diag(band[2, : size - 2], -2)
    np.testing.assert_allclose(factor @ factor.T, _matrix(size), atol=1e-9)


@pytest.mark.parametrize("size", [5, 20, 43])
def test_draws_are_those_of_the_inverse(size):
    scaled, normalise = smoothing_factors()
    dense = np.linalg.cholesky(_matrix(size))
    normals = np.random.default_rng(0).standard_normal(3 * size)
    rows = np.ones((3, size))
    add_smooth_noise(scaled, normals, size, 2.0, rows)
    draws = np.linalg.solve(dense.T, normals.reshape(3, size).T).T
    np.testing.assert_allclose(rows, 1 + 2 * draws, rtol=1e-7)
    largest = np.sqrt(np.linalg.inv(_matrix(size)).diagonal().max())
    assert normalise[size] * largest == pytest.approx(1.0)
