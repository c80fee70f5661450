"""Training a task library from recordings."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from hri_prediction.errors import DataError
from hri_prediction.prediction.config import PredictorConfig
from hri_prediction.prediction.library import TaskLibrary, demonstration, learn_task
from hri_prediction.promp.learning import Demonstration
from hri_prediction.tracks.segmentation import find_reaches
from hri_prediction.tracks.track import ArmTrack

TASK_FIELDS = ("task", "subject", "source")
"""Fields of a track that a task can be named after."""


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
        DataError: if no usable reach is found, or ``group_by`` is unknown.
    """
    settings = config or PredictorConfig()
    if group_by not in TASK_FIELDS:
        raise DataError(f"group_by = {group_by!r}", expected="one of " + ", ".join(TASK_FIELDS))
    groups: dict[tuple[str, str], _Group] = {}
    skipped: list[str] = []
    uppers, fores = [], []
    for track in tracks:
        where = f"{track.source or track.subject} {track.task} trial {track.trial}".strip()
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
            name = str(getattr(track, group_by)) or "reach"
            group = groups.setdefault((name, track.side), _Group())
            group.reaches.append(demo)
            group.durations.append(reach.duration_s)
            group.subjects.append(track.subject)
        seen = np.isfinite(track.keypoints[:, :3]).all(axis=(1, 2))
        if found and seen.any():
            points = track.keypoints[seen]
            uppers.append(float(np.median(np.linalg.norm(points[:, 1] - points[:, 0], axis=1))))
            fores.append(float(np.median(np.linalg.norm(points[:, 2] - points[:, 1], axis=1))))
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
            name, side, group.reaches, np.array(group.durations), group.subjects, settings
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
    leave_out_subject: str = "",
    max_tracks: int = 0,
    progress: Callable[[str], None] | None = None,
) -> TrainingResult:
    """Load recordings and train on them.

    Args:
        paths: Files that `hri_prediction.tracks.files.load_tracks` reads.
        config: Settings.
        group_by: Field of the track that names the task.
        leave_out_subject: Subject whose tracks are not used (empty: use all).
        max_tracks: Most tracks used of one task and side (0: all).
        progress: Called with a line of text now and then.

    Raises:
        DataError: on unreadable files, an absent subject, or no usable reach.
    """
    from hri_prediction.tracks.files import load_tracks

    tracks: list[ArmTrack] = []
    for path in paths:
        if progress is not None:
            progress(f"reading {path}")
        tracks += load_tracks(path)
    subjects = sorted({t.subject for t in tracks})
    if leave_out_subject:
        if leave_out_subject not in subjects:
            raise DataError(
                f"no subject {leave_out_subject!r}", expected="one of " + ", ".join(subjects)
            )
        tracks = [t for t in tracks if t.subject != leave_out_subject]
    if max_tracks:
        taken: Counter[tuple[str, str]] = Counter()
        chosen = []
        for track in tracks:
            taken[track.task, track.side] += 1
            if taken[track.task, track.side] <= max_tracks:
                chosen.append(track)
        tracks = chosen
    return train(tracks, config, group_by=group_by, progress=progress)
