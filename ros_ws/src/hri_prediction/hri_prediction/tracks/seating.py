"""Where a recorded person sits when the user does not say."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from hri_prediction.arm.geometry import FloatArray
from hri_prediction.errors import DataError
from hri_prediction.tracks.placement import Placement
from hri_prediction.tracks.track import ArmTrack

SEAT = (0.75, 0.0, 0.40)
"""Usual place of the shoulder across the table, world frame [m]."""
NEAREST_HAND = 0.30
"""The hand tip comes no nearer to the robot's base than this along x [m]; people who reach far, or
lean forward, are seated further away."""

_QUARTER = 0.5 * math.pi


def _lab_heading(tracks: Sequence[ArmTrack]) -> tuple[float, FloatArray]:
    """Heading in the laboratory [rad], and the keypoints (N, 4, 3) that it was taken from."""
    if not tracks:
        raise DataError("no track to place", expected="at least one")
    points = np.concatenate([track.keypoints for track in tracks])
    seen = points[np.isfinite(points[:, (0, 3), 0]).all(axis=1)]
    if not len(seen):
        raise DataError("shoulder and hand tip are never seen together", expected="a usable track")
    direction = (seen[:, 3] - seen[:, 0]).mean(axis=0)
    return _QUARTER * round(math.atan2(direction[1], direction[0]) / _QUARTER), seen


def facing_deg(tracks: ArmTrack | Sequence[ArmTrack], placement: Placement) -> float:
    """Where a placed person faces in the world [deg], from x towards y, in (-180, 180].

    Args:
        tracks: A recording in the axes of its laboratory, or several of one person and one seat.
        placement: Where it is put; its yaw is added to the heading in the laboratory, which is found
            as :func:`suggest_placement` finds it.

    Raises:
        DataError: when shoulder and hand tip are never seen together.
    """
    group = [tracks] if isinstance(tracks, ArmTrack) else list(tracks)
    turned = math.degrees(math.remainder(_lab_heading(group)[0] + placement.yaw, 2.0 * math.pi))
    return 180.0 if round(turned, 2) == -180.0 else round(turned, 2) + 0.0


def suggest_placement(
    tracks: ArmTrack | Sequence[ArmTrack],
    shoulder: tuple[float, float, float] = SEAT,
    facing: float = math.pi,
) -> Placement:
    """The placement that seats a recorded person across the table, facing the robot.

    Where the person faces in the laboratory is taken from the mean horizontal direction from the
    shoulder to the hand tip, rounded to a quarter turn: laboratories align their axes with the
    table. This is right for both data sets of :mod:`.adapters` (ADL faces +y: yaw 90 degrees; QTM
    faces -y: yaw -90 degrees) and wrong where someone sits askew: then place by hand.

    Args:
        tracks: One track, or several of one person and one seat, in the axes of the laboratory.
        shoulder: Where the median of the shoulders comes to lie [m], world frame; further along x
            when the hand would come nearer to the robot than :data:`NEAREST_HAND`.
        facing: Heading of the person in the world [rad], from x towards y; pi looks at the robot.

    Raises:
        DataError: when shoulder and hand tip are never seen together, or there is no track.
    """
    group = [tracks] if isinstance(tracks, ArmTrack) else list(tracks)
    heading, seen = _lab_heading(group)
    turn = math.remainder(facing - heading, 2.0 * math.pi)
    moved = Placement(yaw=turn).apply(np.median(seen[:, 0], axis=0))
    offset = np.subtract(shoulder, moved)
    nearest = float((Placement(yaw=turn).apply(seen[:, 3]) + offset)[:, 0].min())
    offset[0] += max(NEAREST_HAND - nearest, 0.0)
    return Placement(float(offset[0]), float(offset[1]), float(offset[2]), turn)
