"""How sure a law is of the weights between two postures."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from hri_prediction.motor_control.costs import CHAPTER_2
from hri_prediction.motor_control.law import FEATURES, FittedLaw, WeightLaw, features

OUTPUTS = len(CHAPTER_2) - 1
SIZE = OUTPUTS * len(FEATURES)


def fitted(covariance: np.ndarray, theta: np.ndarray | None = None) -> FittedLaw:
    theta = np.zeros((OUTPUTS, len(FEATURES))) if theta is None else theta
    sd = np.sqrt(np.maximum(np.diag(covariance), 0.0)).reshape(OUTPUTS, -1)
    return FittedLaw(WeightLaw(CHAPTER_2, theta), 0.0, 1, sd, covariance)


@given(st.integers(0, 10**6))
def test_errors_of_logarithms_are_those_of_theta_carried_over(seed: int) -> None:
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(SIZE, SIZE)) / SIZE
    law = fitted(root @ root.T)
    q_start, q_end = rng.uniform(-1.0, 1.5, (2, 5, 3))
    at = features(q_start, q_end)
    # A linear map of theta, one row for each cost and pair of postures.
    carried = np.einsum("po,qf->pqof", np.eye(OUTPUTS), at).reshape(OUTPUTS, 5, -1)
    expected = np.stack([np.linalg.norm(each @ root, axis=-1) for each in carried], axis=-1)
    np.testing.assert_allclose(law.log_sd(q_start, q_end), expected, rtol=1e-9)


@given(st.integers(0, 10**6))
def test_rounding_beside_a_large_variance_is_no_nan(seed: int) -> None:
    """Where reaches say nothing of a direction, its variance is huge; across it rounding is left."""
    rng = np.random.default_rng(seed)
    unknown = rng.normal(size=SIZE)
    law = fitted(1e14 * np.outer(unknown, unknown))
    for _ in range(10):
        found = law.log_sd(*rng.uniform(-1.0, 1.5, (2, 3)))
        assert np.isfinite(found).all()
        assert (found >= 0.0).all()
