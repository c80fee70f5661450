"""Which recorded trials are fit for training and for comparisons."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable

import numpy as np

from hri_prediction.tracks.track import ArmTrack

Condition = tuple[str, str, str]


def nominal_reaches(
    tracks: Iterable[ArmTrack], *, max_gap_s: float = 0.1, duration_factor: float = 1.5
) -> dict[Condition, list[ArmTrack]]:
    """Complete, ordinary trials, grouped by who did what with which arm.

    Args:
        tracks: Trials of any persons and tasks.
        max_gap_s: Gaps up to this length are filled [s]; trials with longer ones, or with a
            keypoint missing at an end, are left out.
        duration_factor: A trial is left out when it is more than this factor longer or shorter
            than the median of its group.

    Returns:
        (subject, task, side) to trials, in the order of ``tracks``; groups left empty are absent.
    """
    groups: dict[Condition, list[ArmTrack]] = defaultdict(list)
    for track in tracks:
        filled = track.filled(max_gap_s)
        if filled.valid.all():
            groups[track.subject, track.task, track.side].append(filled)
    chosen = {}
    for condition, group in groups.items():
        usual = float(np.median([track.duration for track in group]))
        chosen[condition] = [
            track
            for track in group
            if usual / duration_factor <= track.duration <= usual * duration_factor
        ]
    return {condition: group for condition, group in chosen.items() if group}
