"""What predictors beside ours are given: an observed beginning, and reaches to learn from."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hri_prediction.evaluation.recordings import Recording
from hri_prediction.prediction.library import demonstration
from hri_prediction.tracks.track import ArmTrack

Array = NDArray[np.float64]
POINTS = 31
"""Points of a training reach over its phase."""
SPACING_S = 0.02
"""Time between the samples that are fitted; neighbouring ones share their errors [s]."""


@dataclass(frozen=True, eq=False)
class Example:
    """A reach to learn from.

    Args:
        values: (POINTS, 6) elbow and wrist over the phase, relative to the shoulder at onset [m].
        duration_s: How long it took.
        task: Its name.
        side: Which arm.
    """

    values: Array
    duration_s: float
    task: str
    side: str


def examples(recordings: Sequence[Recording], *, labelled: bool) -> list[Example]:
    """The reaches of recordings, cut where they are labelled or where the segmentation cuts them."""
    result = []
    for recording in recordings:
        track = recording.track
        for reach in recording.reaches if labelled else recording.found:
            demo = demonstration(track, reach.onset_s, reach.end_s, POINTS)
            result.append(Example(demo.values, reach.duration_s, track.task, track.side))
    return result


def fitting(known: Sequence[Example], side: str, task: str | None) -> list[Example]:
    """Examples of one arm (all, if there are none) and, if it is told, of one task (likewise)."""
    own = [e for e in known if e.side == side] or list(known)
    return [e for e in own if e.task == task] or own if task is not None else own


@dataclass(frozen=True, eq=False)
class Observation:
    """The beginning of a reach and nothing after it.

    Args:
        track: Rows up to now.
        onset_s: When the reach began, on the clock of the track.
        duration_s: How long it will take, when the predictor is told; else none.
    """

    track: ArmTrack
    onset_s: float
    duration_s: float | None

    @property
    def now_s(self) -> float:
        """Time of the newest sample."""
        return float(self.track.time_s[-1])

    @property
    def shoulder(self) -> Array:
        """Shoulder at the onset (3,) [m]: where it was last seen by then, or first seen after."""
        return self._at_onset(0)

    @property
    def start(self) -> Array:
        """Wrist at the onset (3,) [m], likewise."""
        return self._at_onset(2)

    def _at_onset(self, keypoint: int) -> Array:
        seen = np.flatnonzero(self.track.valid[:, keypoint])
        if not seen.size:
            return np.full(3, math.nan)
        before = seen[self.track.time_s[seen] <= self.onset_s + 5e-7]
        return np.array(self.track.keypoints[before[-1] if before.size else seen[0], keypoint])

    def samples(self) -> tuple[Array, Array]:
        """Times (n,) [s] and elbow and wrist (n, 6) [m] since the onset, the newest one among them.

        World axes; samples without elbow or wrist are left out.
        """
        usable = self.track.valid[:, 1] & self.track.valid[:, 2]
        rows, due = [], math.inf
        for row in np.flatnonzero(usable)[::-1]:
            time = float(self.track.time_s[row])
            if time < self.onset_s - 5e-7:
                break
            if time <= due + 5e-7:
                rows.append(row)
                due = time - SPACING_S
        chosen = np.array(rows[::-1], dtype=int)
        return self.track.time_s[chosen], self.track.keypoints[chosen, 1:3].reshape(-1, 6)
