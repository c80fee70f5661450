"""How much of each keypoint a track holds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hri_prediction.arm.geometry import KEYPOINTS
from hri_prediction.tracks.track import ArmTrack


@dataclass(frozen=True)
class Gaps:
    """What is missing of one keypoint.

    Attributes:
        keypoint: Its name.
        share: Part of the samples, those of left-out frames included, in which it was seen.
        count: Times without a sample, those at the ends included.
        longest_s: Length of the longest [s].
        longest_at_s: When that one begins, from the first sample of the track [s].
    """

    keypoint: str
    share: float
    count: int
    longest_s: float
    longest_at_s: float


def gap_report(track: ArmTrack) -> tuple[Gaps, ...]:
    """Gaps of each keypoint, in the order of the keypoints."""
    period = 1.0 / track.rate_hz
    # Samples on a grid, so that frames that the file leaves out count as missing.
    grid = np.rint((track.time_s - track.time_s[0]) / period).astype(int)
    found = []
    for keypoint, name in enumerate(KEYPOINTS):
        seen = np.zeros(grid[-1] + 1, dtype=bool)
        seen[grid[track.valid[:, keypoint]]] = True
        edges = np.diff(np.concatenate(([False], ~seen, [False])).astype(int))
        starts, ends = np.flatnonzero(edges > 0), np.flatnonzero(edges < 0)
        longest = int(np.argmax(ends - starts)) if len(starts) else -1
        found.append(
            Gaps(
                keypoint=name,
                share=float(seen.mean()),
                count=len(starts),
                longest_s=float((ends - starts)[longest]) * period if len(starts) else 0.0,
                longest_at_s=float(starts[longest]) * period if len(starts) else 0.0,
            )
        )
    return tuple(found)
