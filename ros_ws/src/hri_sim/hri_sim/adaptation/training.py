"""Models of adaptation from simulated motions."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hri_planner.adaptation.algorithm1 import Label, label
from hri_planner.adaptation.best_fixed import BestFixed, best_fixed
from hri_planner.adaptation.features import FEATURES
from hri_planner.adaptation.gpr_selection import GprSelection, fit_gpr
from hri_planner.adaptation.grid import CELLS, ROLLOUTS, SHAPE, TIMESTEPS
from hri_planner.adaptation.success_selection import SuccessSelection, fit_success
from hri_prediction.arm.geometry import FloatArray
from hri_sim.adaptation.design import GRID, Design
from hri_sim.adaptation.samples import Sample
from hri_sim.benchmark.rows import Unit

Samples = Mapping[Unit, tuple[Sample, ...]]


@dataclass(frozen=True)
class Labelled:
    """A condition, and what Algorithm 1 says of it.

    Attributes:
        task: Number of its task.
        features: The five inputs (5,).
        label: Parameters, and which rule gave them.
    """

    task: int
    features: FloatArray
    label: Label

    @property
    def wanted(self) -> FloatArray:
        """TS and NT (2,)."""
        cell = self.label.cell
        return np.array([cell.num_timesteps, cell.num_rollouts], dtype=float)


@dataclass(frozen=True)
class Models:
    """All that are trained, by the names that files and planners have."""

    gpr: GprSelection
    gpr_lower: GprSelection
    success: SuccessSelection
    fixed: BestFixed

    @property
    def by_name(self) -> dict[str, GprSelection | SuccessSelection | BestFixed]:
        """In the order of tables."""
        return {
            "gpr": self.gpr,
            "gpr_lower": self.gpr_lower,
            "success": self.success,
            "fixed": self.fixed,
        }


def is_grid(unit: Unit) -> bool:
    """Whether samples are those of a whole grid."""
    return unit.planner.startswith(GRID)


def of_tasks(samples: Samples, tasks: Iterable[int], *, grid: bool | None = None) -> list[Sample]:
    """The samples of some tasks: of whole grids, of random cells, or (none) both."""
    chosen = set(tasks)
    return [
        sample
        for unit, found in samples.items()
        if unit.task in chosen and (grid is None or is_grid(unit) == grid)
        for sample in found
    ]


def labelled(samples: Samples, tasks: Iterable[int]) -> list[Labelled]:
    """Algorithm 1 in all conditions of some tasks that have a grid."""
    chosen = set(tasks)
    return [
        Labelled(
            unit.task,
            found[0].features,
            label(_over_grid(found, "collision"), _over_grid(found, "control")),
        )
        for unit, found in samples.items()
        if is_grid(unit) and unit.task in chosen
    ]


def _over_grid(samples: Iterable[Sample], name: str) -> FloatArray:
    """A cost over the grid; cells that were not simulated have that of the nearest."""
    known = {sample.cell: float(getattr(sample, name)) for sample in samples}
    steps = np.array(sorted({cell.num_timesteps for cell in known}))
    rollouts = np.array(sorted({cell.num_rollouts for cell in known}))
    table = {(cell.num_timesteps, cell.num_rollouts): cost for cell, cost in known.items()}
    values = np.empty(SHAPE)
    for i, wanted_steps in enumerate(TIMESTEPS):
        for j, wanted_rollouts in enumerate(ROLLOUTS):
            near = steps[np.argmin(np.abs(steps - wanted_steps))]
            few = rollouts[np.argmin(np.abs(rollouts - wanted_rollouts))]
            values[i, j] = table[int(near), int(few)]
    return values


@dataclass(frozen=True)
class LabelErrors:
    """What is said of labels of tasks that it was not learnt from, less what Algorithm 1 says.

    Attributes:
        gpr: By the processes, of TS and NT (n, 2).
        mean: By the mean label of the other tasks (n, 2).
    """

    gpr: FloatArray
    mean: FloatArray

    @property
    def gpr_sd(self) -> FloatArray:
        """Standard deviation of the processes' errors (2,)."""
        return np.asarray(self.gpr.std(axis=0))

    @property
    def mean_sd(self) -> FloatArray:
        """That of the mean label's errors (2,)."""
        return np.asarray(self.mean.std(axis=0))


def leave_one_task_out(labels: Sequence[Labelled]) -> LabelErrors:
    """Errors in each task of processes that are learnt from all the others.

    Whole tasks are left out, as conditions of a task have the person and the places in common.

    Raises:
        DataError: when fewer than two conditions are left to learn from.
    """
    gpr, mean = [], []
    for task in dict.fromkeys(each.task for each in labels):
        inside = [each for each in labels if each.task == task]
        others = [each for each in labels if each.task != task]
        process = _fitted(others)
        expected = np.mean([each.wanted for each in others], axis=0)
        gpr += [process.predict(each.features) - each.wanted for each in inside]
        mean += [expected - each.wanted for each in inside]
    return LabelErrors(np.array(gpr), np.array(mean))


def _fitted(labels: Sequence[Labelled]) -> GprSelection:
    features = np.array([each.features for each in labels]).reshape(-1, len(FEATURES))
    return fit_gpr(features, np.array([each.wanted for each in labels]))


def train(design: Design, samples: Samples) -> tuple[Models, LabelErrors]:
    """All models, from the tasks that are not held out, and what the processes' labels are worth.

    What `gpr_lower` subtracts is the standard deviation of the processes' errors in tasks left out.

    Raises:
        DataError: when there are too few samples.
    """
    labels = labelled(samples, design.learnt)
    gpr, errors = _fitted(labels), leave_one_task_out(labels)
    gpr_lower = replace(gpr, less=errors.gpr_sd)
    every = of_tasks(samples, design.learnt)
    fixed = best_fixed(
        np.array([CELLS.index(sample.cell) for sample in every]), _successes(every), _control(every)
    )
    success = _success(of_tasks(samples, design.learnt, grid=False))
    return Models(gpr, gpr_lower, success, fixed), errors


def _success(motions: list[Sample]) -> SuccessSelection:
    """From random cells alone: those of a whole grid share condition and noise, and so their luck."""
    return fit_success(
        np.array([sample.features for sample in motions]),
        np.array([(sample.num_timesteps, sample.num_rollouts) for sample in motions]),
        _successes(motions),
        _control(motions),
    )


def _successes(motions: list[Sample]) -> FloatArray:
    return np.array([float(sample.success) for sample in motions])


def _control(motions: list[Sample]) -> FloatArray:
    return np.array([sample.control for sample in motions])
