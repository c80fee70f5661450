"""Recordings to evaluate on: tracks, and the reaches in them that predictions are judged by."""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hri_prediction.errors import DataError
from hri_prediction.prediction.library import demonstration
from hri_prediction.prediction.training import read_tracks
from hri_prediction.tracks.bell import from_rest_to_rest, peak_speed
from hri_prediction.tracks.labels import ONSET_LABEL_SPEED, onset_labels
from hri_prediction.tracks.segmentation import Reach, SegmentationConfig, find_reaches
from hri_prediction.tracks.track import ArmTrack

Array = NDArray[np.float64]
TRUTH_GAP_S = 0.1
"""The truth is interpolated over gaps up to this length [s]; what lies in longer ones is not judged."""

TRUTH = "the truth"
LABELS = "labels, extended to rest by the bell-shaped speed of reaches"
CUTS = "what the segmentation cuts, extended to rest by the bell-shaped speed of reaches"
"""What durations are held against."""


@dataclass(frozen=True, eq=False)
class Recording:
    """A track with its reaches.

    Args:
        track: What the sensor delivered.
        reaches: The reaches that are predicted: labelled where the file has labels, else ``found``.
        durations_s: How long each of these takes from rest to rest [s].
        durations_from: How that is known: `TRUTH`, `LABELS` or `CUTS`.
        found: What the segmentation finds; predictors learn from these.
        teaches: Whether others' predictors may learn from it.
        judged: Whether its own reaches are predicted.
        numbers: Of ``reaches``, in the order in which the track has them, from 0; those that are not usable
            are counted.
        refused: A line for each of those.
    """

    track: ArmTrack
    reaches: tuple[Reach, ...]
    durations_s: tuple[float, ...]
    durations_from: str
    found: tuple[Reach, ...]
    teaches: bool = True
    judged: bool = True
    numbers: tuple[int, ...] = ()
    refused: tuple[str, ...] = ()


def usable_reaches(
    track: ArmTrack, reaches: Sequence[Reach], points: int
) -> tuple[dict[int, Reach], tuple[str, ...]]:
    """Those reaches, by number, in which shoulder, elbow and wrist are seen often enough to be judged.

    Returns:
        These, and a line for each of the others.
    """
    usable, refused = {}, []
    for number, reach in enumerate(reaches):
        try:
            demonstration(track, reach.onset_s, reach.end_s, points)
        except DataError as error:
            when = f"from {reach.onset_s:.2f} to {reach.end_s:.2f} s"
            refused.append(f"reach {number}, {when}: {error}")
            continue
        usable[number] = reach
    return usable, tuple(refused)


def make_recording(
    track: ArmTrack,
    segmentation: SegmentationConfig,
    labels: Sequence[Reach] | None = None,
    *,
    label_speed: float = 0.0,
    teaches: bool = True,
    judged: bool = True,
) -> Recording:
    """Find the reaches of a track.

    Args:
        track: One trial or a continuous recording.
        segmentation: Thresholds.
        labels: The reaches to judge by, where they are known; none: those that are found.
        label_speed: Share of the peak speed at which the labels are set, 0 at rest.
        teaches: See :class:`Recording`.
        judged: Likewise.
    """
    cut = find_reaches(track.time_s, track.keypoints[:, 2], segmentation)
    found, refused = usable_reaches(track, cut, 5)
    usable = found
    if labels is not None:
        usable, refused = usable_reaches(track, labels, 5)
    reaches = tuple(usable.values())
    durations = []
    for reach in reaches:
        ratio = label_speed
        if labels is None:
            ratio = segmentation.onset_speed / peak_speed(track, reach, segmentation)
        durations.append(float(from_rest_to_rest(reach.duration_s, ratio)))
    source = CUTS if labels is None else LABELS if label_speed > 0.0 else TRUTH
    return Recording(
        track,
        reaches,
        tuple(durations),
        source,
        tuple(found.values()),
        teaches,
        judged,
        tuple(usable),
        refused,
    )


def load_recordings(path: str | Path, segmentation: SegmentationConfig) -> list[Recording]:
    """Read a track file (or a bag), in the axes that it was recorded in.

    Raises:
        DataError: when it cannot be read or holds no reach.
    """
    tracks = read_tracks(path)
    labels = onset_labels(path)
    recordings = [
        make_recording(
            track,
            segmentation,
            None if labels is None else [labels[i]],
            label_speed=ONSET_LABEL_SPEED,
        )
        for i, track in enumerate(tracks)
    ]
    if not any(recording.reaches for recording in recordings):
        refused = [line for recording in recordings for line in recording.refused]
        what = (
            f"no reach can be used, of {len(refused)}; the first: {refused[0]}"
            if refused
            else "no reach found: as far as it is seen without gaps, no wrist moves faster than "
            f"{segmentation.on_speed} m/s for {segmentation.min_duration} s"
        )
        raise DataError(f"{path}: {what}", expected="at least one that is seen throughout")
    return recordings


def reduced(recordings: Sequence[Recording], people: int, trials: int) -> list[Recording]:
    """The first people that are judged, and the first trials of each side and task, for a quick look."""
    judged = list(dict.fromkeys(r.track.subject for r in recordings if r.judged))[:people]
    kept: list[Recording] = []
    taken: Counter[tuple[str, str, str]] = Counter()
    for recording in recordings:
        track = recording.track
        key = (track.subject, track.side, track.task)
        if (track.subject in judged or not recording.judged) and taken[key] < trials:
            taken[key] += 1
            kept.append(recording)
    return kept


def truth_at(track: ArmTrack, times: Array) -> Array:
    """True wrist (K, 3) [m] at ``times`` (K,) on the clock of the track; NaN where not known."""
    wrist = track.keypoints[:, 2]
    rows = np.flatnonzero(np.isfinite(wrist).all(axis=1))
    if rows.size < 2:
        return np.full((times.size, 3), np.nan)
    seen = track.time_s[rows]
    points = np.column_stack([np.interp(times, seen, wrist[rows, axis]) for axis in range(3)])
    right = np.clip(np.searchsorted(seen, times), 1, seen.size - 1)
    known = (times >= seen[0] - 1e-9) & (times <= seen[-1] + 1e-9)
    known &= seen[right] - seen[right - 1] <= TRUTH_GAP_S * (1.0 + 1e-9)
    points[~known] = np.nan
    return points


def content_hash(recordings: Sequence[Recording]) -> str:
    """Hash (16 hex digits) of everything in the recordings that results depend on."""
    digest = hashlib.sha256()
    for recording in recordings:
        track = recording.track
        names = (track.side, track.subject, track.task, track.trial)
        uses = (recording.teaches, recording.judged)
        reaches = (recording.reaches, recording.durations_s, recording.found)
        digest.update(repr((names, uses, reaches)).encode())
        digest.update(track.time_s.tobytes())
        digest.update(track.keypoints.tobytes())
    return digest.hexdigest()[:16]
