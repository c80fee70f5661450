"""Two arms that move as they are told, for tests."""

from __future__ import annotations

import numpy as np

from hri_prediction.geometry.minimum_jerk import minimum_jerk
from hri_prediction.tracks.track import ArmTrack

RATE_HZ = 250.0
_ARM = np.array([[0.0, 0.0, 0.4], [0.1, 0.0, 0.15], [0.3, 0.0, 0.1], [0.4, 0.0, 0.1]])


def arm_track(
    motions: list[tuple[float, float, float]],
    seconds: float,
    *,
    away: float = 0.0,
    noise: float = 0.0,
    name: str = "a",
    rate_hz: float = RATE_HZ,
) -> ArmTrack:
    """An arm that moves aside and back, shoulder and all.

    Args:
        motions: When each begins [s], how long it takes [s], and how far along y it goes [m].
        seconds: Of the track.
        away: Where it is along y [m].
        noise: Of each coordinate [m].
        name: Of the person.
        rate_hz: Of the samples.
    """
    time_s = np.arange(round(seconds * rate_hz) + 1) / rate_hz
    along = np.full(len(time_s), away)
    for begin, duration, way in motions:
        along = along + way * minimum_jerk((time_s - begin) / duration)
    points = np.tile(_ARM, (len(time_s), 1, 1))
    points[:, :, 1] += along[:, None]
    rng = np.random.default_rng(3)
    return ArmTrack(time_s, points + noise * rng.standard_normal(points.shape), subject=name)
