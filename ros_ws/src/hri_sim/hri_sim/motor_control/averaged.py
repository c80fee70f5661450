"""The larger design of chapter 3: the mean reach of all people for each task, explained by five costs."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hri_prediction.motor_control import design
from hri_prediction.motor_control.analyses.table import ReachTable, table_of
from hri_prediction.motor_control.arm_model import ArmModel
from hri_prediction.motor_control.batch import Job, Kept, explain_all
from hri_prediction.motor_control.costs import CHAPTER_3
from hri_prediction.motor_control.observed import ObservedReach, of_angles
from hri_prediction.motor_control.problem import ReachProblem

Array = NDArray[np.float64]


def mean_reach(
    angles: Array, durations_s: Array, v_start: Array, v_end: Array, arm: ArmModel, name: str
) -> ObservedReach:
    """The mean of reaches of many people, by phase, as one arm makes it.

    Args:
        angles: Joint angles at the same evenly spaced phases (N, P, 3) [rad].
        durations_s: Of each (N,).
        v_start: Joint velocities where they begin (N, 3) [rad/s].
        v_end: Where they end.
        arm: Of nobody: of mean lengths and mass.
        name: Of the task.
    """
    duration, mean = float(durations_s.mean()), angles.mean(axis=0)
    first, last = ((v * durations_s[:, None]).mean(axis=0) / duration for v in (v_start, v_end))
    problem = ReachProblem.moving(mean[0], mean[-1], duration, first, last)
    return of_angles(problem, mean, arm, name)


def explain_means(
    table: ReachTable,
    file: Path,
    *,
    workers: int,
    scheduler: str | None = None,
    progress: Callable[[int, int], None] = lambda done, of: None,
) -> ReachTable:
    """Explain the mean reach of each task of a table by the five costs of chapter 3.

    Args:
        table: Reaches of many people.
        file: Where outcomes are kept.
        workers: Processes.
        scheduler: Of a Dask cluster that does it instead.
        progress: Called with reaches done, and their number.
    """
    arm = ArmModel.of_body()
    tasks = list(dict.fromkeys(zip(table.start.tolist(), table.target.tolist(), strict=True)))
    reaches = []
    for start, target in tasks:
        rows = table.where((table.start == start) & (table.target == target))
        reaches.append(
            mean_reach(
                rows.angles, rows.duration_s, rows.v_start, rows.v_end, arm, f"{start} {target}"
            )
        )
    jobs = [Job(i, each, arm, CHAPTER_3) for i, each in enumerate(reaches)]
    outcomes = explain_all(
        jobs, workers=workers, scheduler=scheduler, kept=Kept(file), progress=progress
    )
    return table_of(
        CHAPTER_3,
        reaches,
        outcomes,
        person=["mean"] * len(tasks),
        start=[start for start, _ in tasks],
        target=[target for _, target in tasks],
    )


def levels(table: ReachTable) -> dict[str, np.ndarray]:
    """Factors of chapter 3: levels of the starting angles, and the target (N,)."""
    rows = [design.LEVELS_12[int(start[1:]) - 1] for start in table.start.tolist()]
    q1, q2, q3 = np.array(rows).T
    return {"q1_start": q1, "q2_start": q2, "q3_start": q3, "target": table.target}
