"""Which motions are simulated: conditions, seeds and cells, all of them of tuning tasks.

Every fifth task is held out: nothing is learnt from it, all that is said of models is measured there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hri_planner.adaptation.grid import CELLS, ROLLOUTS, TIMESTEPS, Cell
from hri_sim.benchmark.conditions import CONDITIONS_A_TASK, TASKS
from hri_sim.benchmark.rows import Unit

SPLIT = "tuning"
HELD_OUT_EVERY = 5
GRID = "grid"
"""All cells, with the first seed alone, as Algorithm 1 asks for."""
RANDOM = "random"
"""Some cells, others in each condition and with each seed."""
GRID_SEED = 0

_ENTROPY = 20160607


@dataclass(frozen=True)
class Trial:
    """One motion: a condition of a task by number, and the parameters to plan it with."""

    condition: int
    cell: Cell


@dataclass(frozen=True)
class Job:
    """Motions of one task with one seed, done by one process.

    Attributes:
        unit: Its ``planner`` says which part of the design this is.
        trials: The motions.
    """

    unit: Unit
    trials: tuple[Trial, ...]


@dataclass(frozen=True)
class Design:
    """How much is simulated.

    Attributes:
        slowdown: F.
        seeds: Of noise, for the random part.
        grid_conditions: Conditions of each task to learn from that get the whole grid, from the first.
        conditions: Conditions of each task that get random cells, from the first.
        cells: How many random cells, for each condition and seed.
        tasks: Numbers.
        grid_step: Of the grid, every so manieth value of TS and NT; those between count as the nearest.
    """

    slowdown: float
    seeds: tuple[int, ...]
    grid_conditions: int = 1
    conditions: int = CONDITIONS_A_TASK
    cells: int = 2
    tasks: tuple[int, ...] = tuple(range(TASKS))
    grid_step: int = 1

    @property
    def learnt(self) -> tuple[int, ...]:
        """Tasks that models are trained on."""
        return tuple(task for task in self.tasks if task not in self.held_out)

    @property
    def grid_cells(self) -> tuple[Cell, ...]:
        """The cells that are simulated of the grid."""
        steps, rollouts = TIMESTEPS[:: self.grid_step], ROLLOUTS[:: self.grid_step]
        return tuple(Cell(ts, nt) for ts in steps for nt in rollouts)

    @property
    def held_out(self) -> tuple[int, ...]:
        """Tasks that nothing is learnt from: every fifth, each time another place among the five.

        So that they are not just those whose intent is ambiguous.
        """
        return tuple(
            task for i, task in enumerate(self.tasks) if i % HELD_OUT_EVERY == self._turn(i)
        )

    @staticmethod
    def _turn(index: int) -> int:
        return 4 * (index // HELD_OUT_EVERY) % HELD_OUT_EVERY

    def grid_jobs(self) -> list[Job]:
        """All cells in each of the conditions, one condition a job; held-out tasks need no labels."""
        return [
            Job(
                Unit(f"{GRID}_{c}", GRID_SEED, task),
                tuple(Trial(c, cell) for cell in self.grid_cells),
            )
            for c in range(self.grid_conditions)
            for task in self.learnt
        ]

    def random_jobs(self) -> list[Job]:
        """Some cells in each condition, with each seed."""
        return [
            Job(Unit(RANDOM, seed, task), self._random_trials(task, seed))
            for task in self.tasks
            for seed in self.seeds
        ]

    def _random_trials(self, task: int, seed: int) -> tuple[Trial, ...]:
        rng = np.random.default_rng(np.random.SeedSequence(_ENTROPY, spawn_key=(task, seed)))
        return tuple(
            Trial(condition, CELLS[index])
            for condition in range(self.conditions)
            for index in rng.choice(len(CELLS), size=self.cells, replace=False)
        )
