"""What is predicted of people, and whether they are seen to do it: else it says nothing."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hri_planner.separation.config import ProtectiveDistanceConfig
from hri_planner.separation.parts import Part
from hri_planner.separation.travel import HUMAN_ACCELERATION, SIGMAS, instant_of
from hri_prediction.compiled import njit

FloatArray = NDArray[np.float64]
NOISE_SIGMAS = 3.0
"""Standard deviations of noise that are reckoned with, in a measured speed and in a place."""


@dataclass(frozen=True, eq=False)
class ArmPrediction:
    """Where an arm is predicted to be.

    Attributes:
        age_s: How long ago the newest sample behind it was taken [s].
        times_s: Predicted instants from then on (k,) [s].
        mean: Shoulder, elbow, wrist, hand tip (k, 4, 3) [m].
        covariance: (k, 4, 3, 3) [m²].
    """

    age_s: float
    times_s: FloatArray
    mean: FloatArray
    covariance: FloatArray


def believed(
    parts: Sequence[Part],
    predictions: Mapping[tuple[str, str], ArmPrediction],
    config: ProtectiveDistanceConfig,
    par: FloatArray,
) -> tuple[dict[int, ArmPrediction], frozenset[tuple[str, str]]]:
    """What is predicted of parts of people, but for arms that are seen elsewhere.

    Args:
        parts: Of people.
        predictions: By body id and side.
        config: What predictions are held against.
        par: The same as the kernels take it.

    Returns:
        Predictions by the index of the part, and the arms that are elsewhere than they are predicted to be
        by now, all of whose parts count as not predicted, by body id and side.
    """
    error = config.sensor_error + NOISE_SIGMAS * config.sample_noise
    used: dict[int, ArmPrediction] = {}
    elsewhere = set()
    for index, part in enumerate(parts):
        found = predictions.get((part.body_id, part.side)) if part.side else None
        if found is None:
            continue
        used[index] = found
        ends = slice(part.limb, part.limb + 2)
        off = stray(
            part.ends,
            part.age_s,
            part.half_window_s,
            config.arm_speed,
            found.times_s,
            found.mean[:, ends],
            found.covariance[:, ends],
            found.age_s,
            error,
            par,
        )
        if not off <= 0.0:
            elsewhere.add((part.body_id, part.side))
    kept = {k: one for k, one in used.items() if (parts[k].body_id, parts[k].side) not in elsewhere}
    return kept, frozenset(elsewhere)


@njit
def stray(
    ends: Any,
    ages: Any,
    half_window: float,
    fastest: float,
    times: Any,
    mean: Any,
    covariance: Any,
    age: float,
    error: float,
    par: Any,
) -> float:
    """By how much a part is farther from where it is predicted than can be, if the prediction is true [m].

    That is told at the time of each end's newest sample. There may be between them what S_h has for people
    who do otherwise than predicted, and the errors of the sample; what was not seen since the prediction's
    own sample may have gone anywhere.

    Args:
        ends: As seen last (2, 3) [m].
        ages: How long ago that was (2,) [s].
        half_window: How much older than the places the velocities are [s].
        fastest: Speed that is assumed [m/s].
        times: Of the predicted instants, from its newest sample on (k,) [s].
        mean: Predicted places of the ends (k, 2, 3) [m].
        covariance: Of these (k, 2, 3, 3) [m²].
        age: How long ago the prediction's newest sample was taken [s].
        error: Largest error of a sample [m].
        par: Parameters.

    Returns:
        Of the end for which it is more; not above 0 where both may be; infinite where nothing is predicted
        for so late.
    """
    most = -np.inf
    off = np.empty(3)
    for end in range(2):
        ahead = age - ages[end]
        if len(times) < 2 or ahead > times[-1]:
            return np.inf
        index, share = instant_of(times, ahead)
        squares, spread = 0.0, 0.0
        for k in range(3):
            before, after = mean[index, end, k], mean[index + 1, end, k]
            off[k] = ends[end, k] - before - share * (after - before)
            squares += off[k] * off[k]
        for k in range(3):
            for m in range(3):
                before, after = covariance[index, end, k, m], covariance[index + 1, end, k, m]
                spread += off[k] * off[m] * (before + share * (after - before))
        distance = math.sqrt(squares)
        sigma = math.sqrt(max(spread, 0.0)) / max(distance, 1e-12)
        since, unseen = max(ahead, 0.0), max(-ahead, 0.0)
        own = par[HUMAN_ACCELERATION] * since * (half_window + 0.5 * since) + fastest * unseen
        excess = distance - par[SIGMAS] * sigma - own - error
        if not excess <= most:  # NaN stays
            most = excess
    return most
