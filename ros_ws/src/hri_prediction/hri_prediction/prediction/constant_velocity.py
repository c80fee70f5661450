"""A reach of which nothing is known goes on as it does."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from hri_prediction.prediction.config import PredictorConfig
from hri_prediction.prediction.library import DIMS

Array = NDArray[np.float64]

_LEAST = 3
"""Samples that a velocity is the slope of."""


def constant_velocity(
    recent: Sequence[tuple[float, Array]],
    elbow_wrist: Array,
    times_s: Array,
    config: PredictorConfig,
) -> tuple[Array, Array]:
    """Elbow and wrist that keep the velocity of late; one that was hardly seen stays.

    Args:
        recent: Times [s] and elbow and wrist (6,) [m] at these, NaN where not seen.
        elbow_wrist: Where they are (2, 3) [m].
        times_s: From now (K,) [s].
        config: Of the predictor.

    Returns:
        Mean (K, 2, 3) and covariance (K, 2, 3, 3).
    """
    velocity = np.zeros(DIMS)
    times = np.array([t for t, _ in recent])
    values = np.array([v for _, v in recent])
    for d in range(DIMS):
        seen = np.isfinite(values[:, d])
        centred = times[seen] - times[seen].mean() if seen.any() else times[:0]
        square = float(centred @ centred)
        if seen.sum() >= _LEAST and square > 0.0:
            velocity[d] = centred @ values[seen, d] / square
    mean = elbow_wrist + times_s[:, None, None] * velocity.reshape(2, 3)
    growth = 0.5 * config.velocity_acceleration_sd * times_s**2
    variance = config.idle_sd**2 + growth**2
    covariance = variance[:, None, None, None] * np.eye(3)
    return mean, np.broadcast_to(covariance, (len(times_s), 2, 3, 3)).copy()
