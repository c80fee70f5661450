"""Training a task library from recordings."""

from __future__ import annotations

import contextlib
import math
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from scipy.cluster.hierarchy import fcluster, linkage

from hri_prediction.errors import DataError
from hri_prediction.prediction.config import PredictorConfig
from hri_prediction.prediction.library import TaskLibrary, demonstration, learn_task
from hri_prediction.promp.regression import Demonstration
from hri_prediction.tracks.files import load_tracks
from hri_prediction.tracks.placement import Placement
from hri_prediction.tracks.plausible import check_arm
from hri_prediction.tracks.rate import check_rate
from hri_prediction.tracks.seating import facing_deg, suggest_placement
from hri_prediction.tracks.segmentation import find_reaches
from hri_prediction.tracks.track import ArmTrack

TASK_FIELDS = ("task", "subject", "source", "movement")
"""What a task can be named after: a field of the track, or ``movement``: like ``task``, but reaches of
continuous recordings are told apart by where they start and end."""
MOVEMENT_DISTANCE_M = 0.15
"""Reaches whose start and end points together lie nearer than this (average linkage) are one task."""


@dataclass(frozen=True)
class TaskReport:
    """What one task was learnt from.

    Args:
        name: Task.
        side: Arm.
        demonstrations: Number of reaches.
        subjects: Number of persons.
        duration_mean_s: Geometric mean of the durations.
        duration_std_s: Their standard deviation, for the next reach.
        residual_mm: Root mean square misfit of the basis.
        end_spread_mm: Root mean square distance of the wrist's end points from their mean.
    """

    name: str
    side: str
    demonstrations: int
    subjects: int
    duration_mean_s: float
    duration_std_s: float
    residual_mm: float
    end_spread_mm: float


@dataclass(frozen=True)
class TrainingResult:
    """A library and how it came about.

    Args:
        library: The trained library.
        tasks: One report a task, in the library's order.
        skipped: One line for each track or task that could not be used.
        demonstrations: The reaches of each task, in the library's order.
    """

    library: TaskLibrary
    tasks: tuple[TaskReport, ...]
    skipped: tuple[str, ...]
    demonstrations: tuple[tuple[Demonstration, ...], ...]


@dataclass
class _Group:
    reaches: list[Demonstration] = field(default_factory=list)
    durations: list[float] = field(default_factory=list)
    subjects: list[str] = field(default_factory=list)


def _by_movement(groups: dict[tuple[str, str], _Group]) -> dict[tuple[str, str], _Group]:
    """Split each group into clusters of reaches that start and end alike, the largest first."""
    split: dict[tuple[str, str], _Group] = {}
    for (name, side), group in groups.items():
        ends = np.array([np.r_[d.values[0, 3:], d.values[-1, 3:]] for d in group.reaches])
        labels = np.ones(len(ends), dtype=int)
        if len(ends) > 1:
            tree = linkage(ends, method="average")
            labels = fcluster(tree, MOVEMENT_DISTANCE_M, criterion="distance")
        order = [label for label, _ in Counter(labels.tolist()).most_common()]
        for number, label in enumerate(order, 1):
            chosen = np.flatnonzero(labels == label)
            split[f"{name}_{number}", side] = _Group(
                [group.reaches[i] for i in chosen],
                [group.durations[i] for i in chosen],
                [group.subjects[i] for i in chosen],
            )
    return split


def _usual_spread(groups: Iterable[_Group]) -> tuple[float, float]:
    """Standard deviations within a task, over all tasks: of paths [m] and of log durations.

    Zero when no task has two reaches.
    """
    paths = durations = 0.0
    count = 0
    for group in groups:
        values = np.stack([d.values for d in group.reaches])
        logs = np.log(group.durations)
        paths += float(np.sum((values - values.mean(axis=0)) ** 2)) / values[0].size
        durations += float(np.sum((logs - logs.mean()) ** 2))
        count += len(logs) - 1
    if count == 0:
        return 0.0, 0.0
    return math.sqrt(paths / count), math.sqrt(durations / count)


def seated(track: ArmTrack, place: str) -> ArmTrack:
    """The track turned as the graph seats people.

    Args:
        track: A recording.
        place: ``auto`` (across the table, facing the robot), ``none``, or ``X,Y,Z,YAW``.

    Raises:
        DataError: when ``auto`` cannot tell where the person faces.
        ConfigError: when ``place`` is neither of these.
    """
    return track.transformed(_placement(track, place))


def _placement(track: ArmTrack, place: str) -> Placement:
    if place == "none":
        return Placement()
    return suggest_placement(track) if place == "auto" else Placement.parse(place)


def read_tracks(path: str | Path) -> list[ArmTrack]:
    """Tracks of a track file, or the tracked arms of a bag (folder or .mcap).

    Raises:
        DataError: when it is neither, is damaged, or holds what is no arm by its size or was
            sampled too seldom.
    """
    from hri_prediction.bags.arms import arm_tracks

    path = Path(path)
    if path.is_dir() or path.suffix == ".mcap":
        tracks = [replace(track, task=track.task or path.stem) for track in arm_tracks(path)]
        for track in tracks:
            check_arm(track, f"{path}: {track.subject}")
            check_rate(track, f"{path}: {track.subject}")
        return tracks
    return load_tracks(path)


def train(
    tracks: Iterable[ArmTrack],
    config: PredictorConfig | None = None,
    *,
    group_by: str = "task",
    progress: Callable[[str], None] | None = None,
) -> TrainingResult:
    """Cut the reaches out of all tracks and learn one task a name and side.

    Args:
        tracks: Recordings with one or more reaches each.
        config: Settings.
        group_by: Field of the track that names the task (`TASK_FIELDS`).
        progress: Called with a line of text before each task is learnt.

    Raises:
        DataError: if no usable reach is found, a track is sampled too seldom for that, or
            ``group_by`` is unknown.
    """
    settings = config or PredictorConfig()
    if group_by not in TASK_FIELDS:
        raise DataError(f"group_by = {group_by!r}", expected="one of " + ", ".join(TASK_FIELDS))
    groups: dict[tuple[str, str], _Group] = {}
    skipped: list[str] = []
    uppers, fores = [], []
    for track in tracks:
        where = f"{track.source or track.subject} {track.task} trial {track.trial}".strip()
        check_rate(track, where)
        found = find_reaches(track.time_s, track.keypoints[:, 2], settings.segmentation)
        if not found:
            skipped.append(f"{where}: no reach found")
        for reach in found:
            try:
                demo = demonstration(
                    track, reach.onset_s, reach.end_s, settings.demonstration_points
                )
            except DataError as error:
                skipped.append(f"{where}: {error}")
                continue
            name = str(getattr(track, "task" if group_by == "movement" else group_by)) or "reach"
            group = groups.setdefault((name, track.side), _Group())
            group.reaches.append(demo)
            group.durations.append(reach.duration_s)
            group.subjects.append(track.subject)
        seen = np.isfinite(track.keypoints[:, :3]).all(axis=(1, 2))
        if found and seen.any():
            points = track.keypoints[seen]
            uppers.append(float(np.median(np.linalg.norm(points[:, 1] - points[:, 0], axis=1))))
            fores.append(float(np.median(np.linalg.norm(points[:, 2] - points[:, 1], axis=1))))
    if group_by == "movement":
        groups = _by_movement(groups)
    # A task of which little was seen varies as the others do.
    path_sd, log_sd = _usual_spread(groups.values())
    wide = replace(settings, prior_sd=max(settings.prior_sd, path_sd))
    models, reports, kept = [], [], []
    for (name, side), group in sorted(groups.items()):
        if len(group.reaches) < settings.min_demonstrations:
            skipped.append(
                f"task {name} ({side}): {len(group.reaches)} reaches, fewer than "
                f"{settings.min_demonstrations}"
            )
            continue
        if progress is not None:
            progress(f"{name} ({side}): {len(group.reaches)} reaches")
        model = learn_task(
            name, side, group.reaches, np.array(group.durations), group.subjects, wide, log_sd
        )
        ends = np.stack([d.values[-1, 3:] for d in group.reaches])
        spread = float(np.sqrt(np.mean(np.sum((ends - ends.mean(axis=0)) ** 2, axis=1))))
        models.append(model)
        kept.append(tuple(group.reaches))
        reports.append(
            TaskReport(
                name=name,
                side=side,
                demonstrations=len(group.reaches),
                subjects=len(set(group.subjects)),
                duration_mean_s=model.duration_mean_s,
                duration_std_s=model.duration_std_s,
                residual_mm=1e3 * model.residual_m,
                end_spread_mm=1e3 * spread,
            )
        )
    if not models:
        raise DataError(
            "no task could be learnt" + (f" ({skipped[0]})" if skipped else ""),
            expected=f"at least {settings.min_demonstrations} reaches of one task",
        )
    library = TaskLibrary(tuple(models), float(np.mean(uppers)), float(np.mean(fores)))
    return TrainingResult(library, tuple(reports), tuple(skipped), tuple(kept))


def train_from_files(
    paths: Sequence[str | Path],
    config: PredictorConfig | None = None,
    *,
    group_by: str = "task",
    place: str = "auto",
    leave_out_subject: str = "",
    leave_out_trial: int | None = None,
    max_tracks: int = 0,
    progress: Callable[[str], None] | None = None,
) -> TrainingResult:
    """Load recordings and train on them.

    Args:
        paths: Track files and bags.
        config: Settings.
        group_by: Field of the track that names the task.
        place: How recordings are turned, see :func:`seated`. The library is in world axes, relative
            to the shoulder: it must be trained with people facing as the graph seats them, and
            remembers how they did.
        leave_out_subject: Subject whose tracks are not used (empty: use all).
        leave_out_trial: Trial that is not used; with a subject, only that subject's.
        max_tracks: Most tracks used of one task and side (0: all).
        progress: Called with a line of text now and then.

    Raises:
        DataError: on unreadable files, an absent subject, or no usable reach.
    """
    tracks: list[ArmTrack] = []
    for path in paths:
        if progress is not None:
            progress(f"reading {path}")
        tracks += read_tracks(path)
    subjects = sorted({t.subject for t in tracks})
    if leave_out_subject and leave_out_subject not in subjects:
        raise DataError(
            f"no subject {leave_out_subject!r}", expected="one of " + ", ".join(subjects)
        )
    if leave_out_subject or leave_out_trial is not None:
        tracks = [
            t
            for t in tracks
            if (leave_out_subject and t.subject != leave_out_subject)
            or (leave_out_trial is not None and t.trial != leave_out_trial)
        ]
    if max_tracks:
        taken: Counter[tuple[str, str]] = Counter()
        chosen = []
        for track in tracks:
            taken[track.task, track.side] += 1
            if taken[track.task, track.side] <= max_tracks:
                chosen.append(track)
        tracks = chosen
    placements = [_placement(track, place) for track in tracks]
    result = train(
        [track.transformed(placed) for track, placed in zip(tracks, placements, strict=True)],
        config,
        group_by=group_by,
        progress=progress,
    )
    faced: set[float] = set()
    for track, placed in zip(tracks, placements, strict=True):
        with contextlib.suppress(DataError):  # shoulder and hand tip never seen together
            faced.add(facing_deg(track, placed))
    library = replace(result.library, place=place, facing_deg=tuple(sorted(faced)))
    return replace(result, library=library)
