"""Models of adaptation from simulated motions."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from hri_planner.adaptation.algorithm1 import Label, label
from hri_planner.adaptation.best_fixed import BestFixed, best_fixed
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
        features: The five inputs (5,).
        label: Parameters, and which rule gave them.
    """

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
        Labelled(found[0].features, label(_over_grid(found, "collision"), _over_grid(found, "control")))
        for unit, found in samples.items()
        if is_grid(unit) and unit.task in chosen
    ]  # fmt: skip


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


def train(design: Design, samples: Samples) -> Models:
    """All models, from the tasks that are not held out.

    What `gpr_lower` subtracts is the standard deviation of the errors in held-out conditions, as in the
    thesis; that is all that any model has from them.

    Raises:
        DataError: when there are too few samples.
    """
    labels = labelled(samples, design.learnt)
    gpr = fit_gpr(
        np.array([each.features for each in labels]), np.array([each.wanted for each in labels])
    )
    errors = label_errors(gpr, labelled(samples, design.held_out))
    gpr_lower = replace(gpr, less=errors.std(axis=0))
    every = of_tasks(samples, design.learnt)
    fixed = best_fixed(
        np.array([CELLS.index(sample.cell) for sample in every]), _ok(every), _control(every)
    )
    return Models(gpr, gpr_lower, _success(of_tasks(samples, design.learnt, grid=False)), fixed)


def _success(motions: list[Sample]) -> SuccessSelection:
    """From random cells alone: those of a whole grid share condition and noise, and so their luck."""
    return fit_success(
        np.array([sample.features for sample in motions]),
        np.array([(sample.num_timesteps, sample.num_rollouts) for sample in motions]),
        _ok(motions),
        _control(motions),
    )


def _ok(motions: list[Sample]) -> FloatArray:
    return np.array([float(sample.ok) for sample in motions])


def _control(motions: list[Sample]) -> FloatArray:
    return np.array([sample.control for sample in motions])


def label_errors(gpr: GprSelection, labels: list[Labelled]) -> FloatArray:
    """What the processes say less what Algorithm 1 says, of TS and NT (n, 2)."""
    return np.array([gpr.predict(each.features) - each.wanted for each in labels])
