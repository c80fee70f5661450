"""The larger design of chapter 3: the mean reach of all people for each task, explained by five costs."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from hri_prediction.motor_control import design
from hri_prediction.motor_control.analyses.table import ReachTable, table_of
from hri_prediction.motor_control.arm_model import ArmModel
from hri_prediction.motor_control.batch import Job, Kept, explain_all
from hri_prediction.motor_control.costs import CHAPTER_3
from hri_prediction.motor_control.observed import ObservedReach, of_angles
from hri_prediction.motor_control.problem import ReachProblem


def mean_reach(rows: ReachTable, arm: ArmModel) -> ObservedReach:
    """The mean of reaches of many people, by phase, as one arm makes it.

    Args:
        rows: Reaches of one task.
        arm: Of nobody: of mean lengths and mass.
    """
    duration = float(rows.duration_s.mean())
    angles = rows.angles.mean(axis=0)
    v_start, v_end = (
        (v * rows.duration_s[:, None]).mean(axis=0) / duration for v in (rows.v_start, rows.v_end)
    )
    problem = ReachProblem.moving(angles[0], angles[-1], duration, v_start, v_end)
    return of_angles(problem, angles, arm, f"{rows.start[0]} {rows.target[0]}")


def explain_means(
    table: ReachTable,
    file: Path,
    *,
    workers: int,
    progress: Callable[[int, int], None] = lambda done, of: None,
) -> ReachTable:
    """Explain the mean reach of each task of a table by the five costs of chapter 3.

    Args:
        table: Reaches of many people.
        file: Where outcomes are kept.
        workers: Processes.
        progress: Called with reaches done, and their number.
    """
    arm = ArmModel.of_body()
    tasks = list(dict.fromkeys(zip(table.start.tolist(), table.target.tolist(), strict=True)))
    reaches = [
        mean_reach(table.where((table.start == start) & (table.target == target)), arm)
        for start, target in tasks
    ]
    jobs = [Job(i, each, arm, CHAPTER_3) for i, each in enumerate(reaches)]
    outcomes = explain_all(jobs, workers=workers, kept=Kept(file), progress=progress)
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
