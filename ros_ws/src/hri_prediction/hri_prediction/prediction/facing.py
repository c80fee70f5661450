"""Whether people face as those did that a task library was learnt from.

A library's tasks are relative to the shoulder at the onset of the reach, but along the world's axes:
where a person sits (X, Y, Z of a placement) does not matter to it, which way they face (YAW) does.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from hri_prediction.arm.geometry import FloatArray
from hri_prediction.prediction.library import TaskLibrary
from hri_prediction.tracks.track import ArmSample

TOLERANCE_DEG = 10.0
"""Reaches of half a metre that are turned by this miss by 9 cm."""
FAR_DEG = 75.0
"""An arm whose mean direction is so far off was turned, and is not only used for other things [deg]."""
WATCH_S = 5.0
"""How long an arm is looked at before its mean direction counts [s]."""
_WHY = (
    "its tasks are relative to the shoulder but along the world's axes: these reaches will not be "
    "recognised, whatever X, Y and Z are"
)


def _apart(one_deg: float, other_deg: float) -> float:
    return abs(math.remainder(one_deg - other_deg, 360.0))


def facing_warning(library: TaskLibrary, facing_deg: float) -> str:
    """Why a placed recording does not suit a library, or nothing.

    Args:
        library: The library that is to recognise its reaches.
        facing_deg: Where its person faces in the world (:func:`.seating.facing_deg`).

    Returns:
        One line; empty when the directions agree, or the library's are not known.
    """
    known = library.facing_deg
    if not known or min(_apart(facing_deg, other) for other in known) <= TOLERANCE_DEG:
        return ""
    return (
        f"the person of the recording faces {facing_deg:g} degrees, the library was "
        f"{library.placed}; {_WHY}; place the recording with another YAW, or train with the "
        "--place of the replay"
    )


class FacingWatch:
    """Looks where a tracked arm points, beside the reaches of a library.

    Args:
        library: What the reaches are compared with.
    """

    def __init__(self, library: TaskLibrary) -> None:
        paths = [task.promp.trajectory_mean(np.linspace(0.0, 1.0, 11)) for task in library.tasks]
        self._library = [_heading(path[:, 3:5]) for path in paths]
        self._placed = library.placed
        self._sum = np.zeros(2)
        self._begin_ns: int | None = None
        self._over = False

    def observe(self, samples: Iterable[ArmSample]) -> str:
        """Take samples in; once, a line that says that the arm is turned, else nothing."""
        for sample in samples:
            if self._over or not sample.valid[[0, 2]].all():
                continue
            if self._begin_ns is None:
                self._begin_ns = sample.stamp_ns
            self._sum += (sample.keypoints[2] - sample.keypoints[0])[:2]
            if sample.stamp_ns - self._begin_ns < WATCH_S * 1e9:
                continue
            self._over = True
            heading = _heading(self._sum[None])
            off = min(_apart(heading, own) for own in self._library)
            if off > FAR_DEG:
                return (
                    f"the arm points {off:.0f} degrees away from the library's reaches "
                    f"({self._placed}); {_WHY}; a recording needs another YAW in its --place"
                )
        return ""


def _heading(offsets: FloatArray) -> float:
    """Mean horizontal direction of shoulder-to-wrist offsets (N, 2) [deg]."""
    x, y = offsets.sum(axis=0)
    return math.degrees(math.atan2(y, x))
