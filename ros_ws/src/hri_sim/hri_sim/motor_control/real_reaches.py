"""Reaches of real people, explained as those of the simulated ones are."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from hri_prediction.errors import DataError
from hri_prediction.evaluation.recordings import load_recordings
from hri_prediction.motor_control.analyses.table import ReachTable, table_of
from hri_prediction.motor_control.arm_model import BODY_HEIGHT_M, BODY_MASS_KG
from hri_prediction.motor_control.batch import Job, Kept, correlated, explain_all
from hri_prediction.motor_control.collected import AUTO, People, collect
from hri_prediction.motor_control.convention import YAW_PITCH_ELBOW_PITCH
from hri_prediction.motor_control.costs import CHAPTER_2
from hri_prediction.tracks.segmentation import SegmentationConfig

Array = NDArray[np.float64]

SOURCE = Path("reach_adl_vicon/reach.npz")
CONVENTION = YAW_PITCH_ELBOW_PITCH.name
"""Of which the model comes nearest to elbow and wrist of people who sit at a table."""
TASKS = {"F": "forward", "A": "across"}
_RESAMPLES = 2000


def explain_real(
    file: Path,
    kept: Path,
    *,
    workers: int,
    scheduler: str | None = None,
    smoke: bool = False,
    convention: str = CONVENTION,
    progress: Callable[[int, int], None] = lambda done, of: None,
) -> tuple[ReachTable, list[str]]:
    """Explain recorded reaches.

    Args:
        file: Tracks with labels of subject, side and task.
        kept: File where outcomes are kept.
        workers: Processes.
        scheduler: Of a Dask cluster that does it instead.
        smoke: The first few alone.
        convention: Of joint angles.
        progress: Called with reaches done, and their number.

    Returns:
        The table (start: side; target: task), and a line for each reach that cannot be used.

    Raises:
        DataError: the file cannot be read, or holds no reach that can be used.
    """
    recordings = load_recordings(file, SegmentationConfig())
    if smoke:
        recordings = recordings[:12]
    people = People(AUTO, BODY_HEIGHT_M, BODY_MASS_KG, convention, average=False)
    reaches, skipped = collect(recordings, people)
    if not reaches:
        raise DataError(f"no reach of {file} can be used", expected="one at least")
    jobs = [
        Job(i, each.observed, each.arm, correlated=correlated(each.observed))
        for i, each in enumerate(reaches)
    ]
    outcomes = explain_all(
        jobs, workers=workers, scheduler=scheduler, kept=Kept(kept), progress=progress
    )
    arms = [each.person.rsplit(" ", 1) for each in reaches]
    tasks = [each.task.rsplit(".", 1)[0] for each in reaches]
    table = table_of(
        CHAPTER_2,
        [each.observed for each in reaches],
        outcomes,
        person=[who for who, _ in arms],
        start=[side for _, side in arms],
        target=[TASKS.get(task, task) for task in tasks],
    )
    return table, skipped


def by_task(table: ReachTable, rng: np.random.Generator) -> dict[str, Any]:
    """Mean weights of each task with 95 % intervals over people, and whether tasks differ.

    Each person counts once: reaches of one person are no independent witnesses.

    Args:
        table: Reaches that were explained.
        rng: For resampling.
    """
    people = sorted(set(table.person.tolist()))
    groups = {name: table.alpha[:, i] for i, name in enumerate(table.names)}
    groups["dynamic"] = table.dynamic
    tasks = list(dict.fromkeys(table.target.tolist()))
    result: dict[str, Any] = {"people": len(people), "tasks": tasks, "weights": {}, "differ_p": {}}
    for name, values in groups.items():
        means = {
            task: np.array(
                [
                    values[(table.person == p) & (table.target == task)].mean()
                    for p in people
                    if ((table.person == p) & (table.target == task)).any()
                ]
            )
            for task in tasks
        }
        result["weights"][name] = {task: _interval(each, rng) for task, each in means.items()}
        sizes = {len(each) for each in means.values()}
        if len(tasks) == 2 and sizes == {len(people)} and len(people) > 5:
            first, second = means.values()
            same = np.allclose(first, second)
            result["differ_p"][name] = 1.0 if same else float(stats.wilcoxon(first, second).pvalue)
    return result


def _interval(values: Array, rng: np.random.Generator) -> dict[str, float]:
    """Mean with its 95 % interval by resampling people."""
    drawn = rng.choice(values, (_RESAMPLES, len(values))).mean(axis=1)
    low, high = np.quantile(drawn, [0.025, 0.975])
    return {"mean": float(values.mean()), "low": float(low), "high": float(high)}
