r"""From when a hand is seen to move to when it moves: the bell-shaped speed of reaches.

Where a reach begins and ends can only be seen once the wrist is faster than the noise. The speed of
reaches is bell-shaped; along a minimum-jerk path (Flash & Hogan 1985) it is, as a share of its peak,

.. math:: v / v_{peak} = 16 \tau^2 (1 - \tau)^2

at the share :math:`\tau` of the duration. What lies outside of two crossings of a speed is hence known
from how that speed compares with the peak.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hri_prediction.tracks.rate import window_s
from hri_prediction.tracks.segmentation import Reach, SegmentationConfig
from hri_prediction.tracks.speed import regression_speed
from hri_prediction.tracks.track import ArmTrack

Array = NDArray[np.float64]
LARGEST_RATIO = 0.5
"""Larger ratios count as this one: so slow a movement has no bell to be seen."""
_STEP_S = 0.01


def share_outside(speed_ratio: ArrayLike) -> Array:
    """Share of the duration before the speed reaches ``speed_ratio`` (...) of its peak, as after it."""
    ratio = np.clip(np.asarray(speed_ratio, dtype=float), 0.0, LARGEST_RATIO)
    return np.asarray(0.5 * (1.0 - np.sqrt(1.0 - np.sqrt(ratio))))


def from_rest_to_rest(between_s: ArrayLike, speed_ratio: ArrayLike) -> Array:
    """Duration of a reach from rest to rest [s].

    Args:
        between_s: (...) from where it exceeds a speed to where it falls below it [s].
        speed_ratio: (...) that speed as a share of the peak speed.
    """
    return np.asarray(np.asarray(between_s, dtype=float) / (1.0 - 2.0 * share_outside(speed_ratio)))


def peak_speed(track: ArmTrack, reach: Reach, config: SegmentationConfig) -> float:
    """Largest speed of the wrist within a reach [m/s], as the segmentation sees it; NaN if not seen."""
    wrist = track.keypoints[:, 2]
    seen = np.isfinite(wrist).all(axis=1)
    times, points = np.array(track.time_s[seen]), np.array(wrist[seen])
    largest = float("nan")
    half = 0.5 * window_s(config.window, 1.0 / track.rate_hz)
    for middle in np.arange(reach.onset_s, reach.end_s + 0.5 * _STEP_S, _STEP_S):
        first, last = np.searchsorted(times, middle + np.array([-half, half]))
        largest = float(np.fmax(largest, regression_speed(times[first:last], points[first:last])))
    return largest
