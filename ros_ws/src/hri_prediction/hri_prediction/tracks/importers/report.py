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
    # Samples on a grid, so that frames that the file leaves out count as missing. Only steps on it are
    # looked at: how long the grid is must not decide how much memory this takes.
    grid = np.rint((track.time_s - track.time_s[0]) / period)
    end = grid[-1] + 1.0
    found = []
    for keypoint, name in enumerate(KEYPOINTS):
        seen = np.unique(grid[track.valid[:, keypoint]])
        before = np.concatenate(([-1.0], seen))
        missing = np.concatenate((seen, [end])) - before - 1.0
        starts, lengths = before[missing > 0.0] + 1.0, missing[missing > 0.0]
        longest = int(np.argmax(lengths)) if len(lengths) else -1
        found.append(
            Gaps(
                keypoint=name,
                share=float(len(seen) / end),
                count=len(starts),
                longest_s=float(lengths[longest]) * period if len(starts) else 0.0,
                longest_at_s=float(starts[longest]) * period if len(starts) else 0.0,
            )
        )
    return tuple(found)
