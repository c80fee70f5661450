"""The library of known reaching tasks: one ProMP and one duration statistic a task.

A task's ProMP spans six dimensions, elbow x y z then wrist x y z, in metres along the world's axes,
relative to where the *shoulder was at the onset* of the reach. A moving trunk thus stays part of
the movement, while it does not matter where the person sits.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hri_prediction.arm.geometry import KEYPOINTS
from hri_prediction.errors import DataError, HriError
from hri_prediction.prediction.config import PredictorConfig
from hri_prediction.promp.learning import learn
from hri_prediction.promp.model import ProMP
from hri_prediction.promp.regression import Demonstration
from hri_prediction.promp.storage import read_npz, write_npz
from hri_prediction.tracks.track import ArmTrack

Array = NDArray[np.float64]
FORMAT = "hri-task-library-1"
DIMS = 6
ANY_SIDE = "any"


@dataclass(frozen=True)
class TaskModel:
    """One reaching task.

    Args:
        name: Name of the task.
        side: "left", "right" or "any": the arm it was learnt from.
        promp: Distribution over (elbow, wrist), D = 6, relative to the shoulder at onset.
        duration_mean_s: Geometric mean of the durations.
        duration_log_sd: Standard deviation of log duration, for the next reach.
        demonstrations: Number of reaches it was learnt from.
        residual_m: Root mean square deviation of these reaches from the basis, in metres.
    """

    name: str
    side: str
    promp: ProMP
    duration_mean_s: float
    duration_log_sd: float
    demonstrations: int
    residual_m: float

    @property
    def duration_std_s(self) -> float:
        """Standard deviation of the duration in seconds."""
        return self.duration_mean_s * self.duration_log_sd


@dataclass(frozen=True)
class TaskLibrary:
    """Named tasks, and the segment lengths of the people they were learnt from.

    Args:
        tasks: At least one; all with the same basis.
        upper_arm_m: Mean shoulder-elbow distance.
        forearm_m: Mean elbow-wrist distance.
        place: The ``--place`` that it was trained with; empty: not known.
        facing_deg: Where its people faced in the world by that [deg], from x towards y.

    Raises:
        DataError: on an empty or inconsistent library.
    """

    tasks: tuple[TaskModel, ...]
    upper_arm_m: float
    forearm_m: float
    place: str = ""
    facing_deg: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        if not self.tasks:
            raise DataError("the task library is empty", expected="at least one task")
        keys = [(task.name, task.side) for task in self.tasks]
        if len(set(keys)) != len(keys):
            raise DataError(f"a task appears twice in {keys}")
        for task in self.tasks:
            if task.promp.dims != DIMS or task.promp.basis != self.tasks[0].promp.basis:
                raise DataError(
                    f"task {task.name} has {task.promp.dims} dimensions and {task.promp.basis}",
                    expected=f"{DIMS} dimensions and {self.tasks[0].promp.basis}",
                )
            if task.side not in ("left", "right", ANY_SIDE):
                raise DataError(f"task {task.name}: side {task.side!r}")
            if not (task.duration_mean_s > 0.0 and task.duration_log_sd >= 0.0):
                raise DataError(f"task {task.name} has no positive duration")
        if not (self.upper_arm_m > 0.0 and self.forearm_m > 0.0):
            raise DataError("the library's segment lengths are not positive")

    @property
    def placed(self) -> str:
        """How its people were placed, in words."""
        if not self.place:
            return "trained without --place"
        faced = " and ".join(f"{angle:g}" for angle in self.facing_deg) or "unknown"
        return f"trained with --place {self.place} (people face {faced} degrees)"

    def for_side(self, side: str) -> tuple[TaskModel, ...]:
        """Tasks of one arm; all tasks if there are none for it."""
        return tuple(t for t in self.tasks if t.side in (side, ANY_SIDE)) or self.tasks

    def save(self, path: str | Path) -> None:
        """Write one .npz: arrays and a JSON header, no pickle."""
        arrays: dict[str, Any] = {}
        entries = []
        for i, task in enumerate(self.tasks):
            own, basis = task.promp.to_arrays(f"task{i}_")
            arrays.update(own)
            entries.append(
                {
                    "name": task.name,
                    "side": task.side,
                    "basis": basis,
                    "duration_mean_s": task.duration_mean_s,
                    "duration_log_sd": task.duration_log_sd,
                    "demonstrations": task.demonstrations,
                    "residual_m": task.residual_m,
                }
            )
        header = {
            "format": FORMAT,
            "units": "metre, second",
            "dimensions": ["elbow x", "elbow y", "elbow z", "wrist x", "wrist y", "wrist z"],
            "upper_arm_m": self.upper_arm_m,
            "forearm_m": self.forearm_m,
            "place": self.place,
            "facing_deg": list(self.facing_deg),
            "tasks": entries,
        }
        write_npz(path, arrays, header)

    @staticmethod
    def load(path: str | Path) -> TaskLibrary:
        """Read a library.

        Raises:
            DataError: when the file is missing, damaged, of another kind, or inconsistent.
        """
        arrays, header = read_npz(path, FORMAT)
        try:
            tasks = tuple(
                TaskModel(
                    name=str(entry["name"]),
                    side=str(entry["side"]),
                    promp=ProMP.from_arrays(arrays, entry["basis"], f"task{i}_"),
                    duration_mean_s=float(entry["duration_mean_s"]),
                    duration_log_sd=float(entry["duration_log_sd"]),
                    demonstrations=int(entry["demonstrations"]),
                    residual_m=float(entry["residual_m"]),
                )
                for i, entry in enumerate(header["tasks"])
            )
            return TaskLibrary(
                tasks,
                float(header["upper_arm_m"]),
                float(header["forearm_m"]),
                # Files of before say nothing of these.
                place=str(header.get("place", "")),
                facing_deg=tuple(float(angle) for angle in header.get("facing_deg", ())),
            )
        except HriError as error:
            raise DataError(f"{path}: {error.problem}", expected=error.expected) from error
        except (ArithmeticError, LookupError, TypeError, ValueError) as error:
            raise DataError(f"{path}: the library lacks or garbles {error}") from error


def demonstration(track: ArmTrack, onset_s: float, end_s: float, points: int) -> Demonstration:
    """Cut one reach out of a track and bring it to phase, relative to the shoulder at onset.

    Args:
        track: Recording that contains the reach.
        onset_s: Start on the track's clock.
        end_s: End on the track's clock.
        points: Number of points, evenly over the phase.

    Raises:
        DataError: if shoulder, elbow or wrist are not seen often enough.
    """
    phases = np.linspace(0.0, 1.0, points)
    times = onset_s + phases * (end_s - onset_s)
    columns = []
    for keypoint, name in enumerate(KEYPOINTS[:3]):
        seen = np.isfinite(track.keypoints[:, keypoint]).all(axis=1)
        inside = seen & (track.time_s >= onset_s - 1e-6) & (track.time_s <= end_s + 1e-6)
        if np.count_nonzero(inside) < 4:
            raise DataError(
                f"{track.source or track.task} trial {track.trial}: the {name} is seen "
                f"{np.count_nonzero(inside)} times in the reach at {onset_s:.2f} s",
                expected="at least 4 times",
            )
        t, p = track.time_s[seen], track.keypoints[seen, keypoint]
        columns.append(np.column_stack([np.interp(times, t, p[:, axis]) for axis in range(3)]))
    shoulder, elbow, wrist = columns
    values = np.hstack([elbow - shoulder[0], wrist - shoulder[0]])
    return Demonstration(phases, values)


def learn_task(
    name: str,
    side: str,
    demonstrations: list[Demonstration],
    durations: Array,
    subjects: Sequence[str],
    config: PredictorConfig,
    usual_log_sd: float = 0.0,
) -> TaskModel:
    """Learn one task from its reaches, their durations (N,) and who did them.

    ``usual_log_sd`` is the standard deviation of log duration that is usual for a task: it counts for one
    reach, and matters where there are few.

    With several subjects the library is meant for a new one: a person's reaches resemble each
    other, so they count for fewer independent ones (`person_correlation`).
    """
    weights = np.ones(len(demonstrations))
    if len(set(subjects)) > 1:
        sizes = np.array([subjects.count(s) for s in subjects], dtype=float)
        weights = 1.0 / (1.0 + (sizes - 1.0) * config.person_correlation)
    promp = learn(
        [replace(d, weight=float(w)) for d, w in zip(demonstrations, weights, strict=True)],
        config.learning,
    )
    rows = promp.basis.values(demonstrations[0].phases)
    projector = np.linalg.qr(rows)[0]
    residuals = [d.values - projector @ (projector.T @ d.values) for d in demonstrations]
    logs = np.log(durations)
    total = float(weights.sum())
    log_mean = float(weights @ logs) / total
    # Shrunk towards the usual spread by one pseudo-observation, widened for the mean's error.
    usual = max(usual_log_sd, config.min_duration_cv)
    spread = float(weights @ (logs - log_mean) ** 2) + usual**2
    log_sd = math.sqrt(spread / (total + 1.0) * (1.0 + 1.0 / total))
    return TaskModel(
        name=name,
        side=side,
        promp=promp,
        duration_mean_s=math.exp(log_mean),
        duration_log_sd=max(log_sd, config.min_duration_cv),
        demonstrations=logs.size,
        residual_m=float(np.sqrt(np.mean(np.square(residuals)))),
    )


def train_library(tracks: Iterable[ArmTrack], config: PredictorConfig | None = None) -> TaskLibrary:
    """Learn a library from tracks that each hold one or more reaches, named by ``track.task``.

    Left and right arms make separate tasks.

    Raises:
        DataError: if no track holds a usable reach.
    """
    from hri_prediction.prediction.training import train  # the report is of no use here

    return train(tracks, config).library
