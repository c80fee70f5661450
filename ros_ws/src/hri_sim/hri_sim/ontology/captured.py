"""Movements as motion capture would have seen them, and as they are reckoned from what it saw."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from hri_prediction.ontology.config import WatchConfig
from hri_prediction.ontology.movements import SMOOTHING_S, Movement
from hri_prediction.ontology.smoothing import smoothed_track
from hri_prediction.ontology.upper_body import joints_of
from hri_sim.dyads.hands import STEP_S

FloatArray = NDArray[np.float64]


def captured(movement: Movement, noise: float, rng: np.random.Generator) -> Movement:
    """A movement whose joints are reckoned from keypoints that were seen, and smoothed as recordings are.

    Args:
        movement: With its true joints. The lengths of its body are taken as known.
        noise: Of each coordinate [m], of both people.
        rng: Draws it.
    """
    count = len(movement.joints)
    times: FloatArray = movement.step_s * np.arange(count, dtype=float)
    # Both rest before and after.
    seen: FloatArray = np.arange(-2.0 * SMOOTHING_S, times[-1] + 2.0 * SMOOTHING_S, STEP_S)
    within = np.clip(seen, 0.0, times[-1])
    joints = CubicSpline(times, movement.joints, bc_type="clamped")(within)
    partner = CubicSpline(times, movement.partner, bc_type="clamped")(within)
    own, other = (
        smoothed_track(
            seen,
            points + noise * rng.standard_normal(points.shape),
            times,
            SMOOTHING_S,
            WatchConfig().max_gap,
        )
        for points in (movement.body.keypoints(joints), partner)
    )
    return replace(movement, joints=joints_of(movement.body, own), partner=other)
