"""Samples around a policy: smooth changes of the weights, so that motions stay as smooth as the mean."""

from __future__ import annotations

import functools

import numpy as np
from numpy.typing import NDArray

from hri_planner.dmp.basis import end_projector

FloatArray = NDArray[np.float64]

SMOOTH = 2.0
"""Distance over which changes of weights are alike, in basis functions."""


@functools.cache
def _root(count: int) -> FloatArray:
    """A square root of the covariance: squared exponential, without what the ends would feel."""
    centres = np.arange(count)
    covariance = np.exp(-0.5 * ((centres[:, None] - centres) / SMOOTH) ** 2)
    values, vectors = np.linalg.eigh(covariance)
    root: FloatArray = end_projector(count) @ (vectors * np.sqrt(np.maximum(values, 0.0)))
    return root


def exploration(rng: np.random.Generator, samples: int, count: int, sd: float) -> FloatArray:
    """Changes of weights.

    Args:
        rng: Draws them.
        samples: How many.
        count: Basis functions.
        sd: Standard deviation of a weight [m].

    Returns:
        Shape (samples, 3, count) [m].
    """
    drawn = rng.standard_normal((samples, 3, count))
    return sd * drawn @ _root(count).T
