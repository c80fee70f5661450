"""A benchmark: planners, seeds and tasks as units of work, done by many, kept in a file."""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import json
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from hri_planner.adaptation.model_file import shipped_path
from hri_prediction.compiled import processor
from hri_prediction.results.dependencies import dependency_hash
from hri_sim.benchmark.conditions import CONDITIONS_A_TASK, TASKS, task_conditions
from hri_sim.benchmark.episode import run_episode
from hri_sim.benchmark.execution import PAPER
from hri_sim.benchmark.learning import task_library
from hri_sim.benchmark.outcome import Outcome
from hri_sim.benchmark.planners import ORACLE, ORACLE_SETUP, PlannerSetup
from hri_sim.benchmark.rows import Done, RowFile, Unit, do_waiting
from hri_sim.benchmark.variation import AS_DRAWN, Variation
from hri_sim.benchmark.workers import WORK, versions

ORACLE_SLOWDOWN = 0.1
"""The oracle's F: ten times the iterations of the reference machine, more than it ever uses."""
SMOKE_TASKS = (0, 4)
SMOKE_CONDITIONS = 2


@dataclass(frozen=True)
class Plan:
    """What is measured.

    Attributes:
        planners: Which.
        split: ``tuning`` or ``test``.
        slowdown: F.
        seeds: Of noise.
        tasks: Numbers.
        conditions: How many of each task, from the first.
        variation: What is otherwise than drawn; for the oracle too.
        execution: What makes motions of plans, one of `EXECUTIONS`; for the oracle too.
    """

    planners: tuple[PlannerSetup, ...]
    split: str
    slowdown: float
    seeds: tuple[int, ...]
    tasks: tuple[int, ...] = tuple(range(TASKS))
    conditions: int = CONDITIONS_A_TASK
    variation: Variation = AS_DRAWN
    execution: str = PAPER

    @property
    def setups(self) -> dict[str, PlannerSetup]:
        """The planners and the oracle, by name."""
        return {setup.name: setup for setup in (*self.planners, ORACLE_SETUP)}

    @property
    def units(self) -> list[Unit]:
        """All the work; the oracle needs one seed only."""
        named = [setup.name for setup in self.planners]
        units = [Unit(name, seed, t) for seed in self.seeds for name in named for t in self.tasks]
        return units + [Unit(ORACLE, self.seeds[0], task) for task in self.tasks]

    def slowdown_of(self, planner: str) -> float:
        """F of a planner."""
        return ORACLE_SLOWDOWN if planner == ORACLE else self.slowdown


def marks(plan: Plan) -> dict[str, str]:
    """Hash of all that a planner's outcomes depend on but seed and task, by planner."""
    found = {}
    sources = dependency_hash(WORK)
    for name, setup in plan.setups.items():
        parts = (
            plan.split,
            plan.conditions,
            plan.slowdown_of(name),
            plan.variation,
            plan.execution,
            json.dumps([dataclasses.asdict(setup), dataclasses.asdict(setup.config)]),
            b"" if setup.adaptation is None else shipped_path(setup.adaptation).read_bytes(),
            sources,
            processor(),
            sorted(versions().items()),
        )
        found[name] = hashlib.sha256(repr(parts).encode()).hexdigest()[:16]
    return found


def do_unit(plan: Plan, unit: Unit) -> Done[Outcome]:
    """All conditions of one task, with one planner and seed."""
    conditions = task_conditions(plan.split, unit.task).conditions[: plan.conditions]
    library = task_library(plan.split, unit.task)
    setup, slowdown = plan.setups[unit.planner], plan.slowdown_of(unit.planner)
    begin = time.perf_counter()
    outcomes = tuple(
        run_episode(
            condition,
            setup,
            library,
            slowdown=slowdown,
            seed=unit.seed,
            variation=plan.variation,
            execution=plan.execution,
        )
        for condition in conditions
    )
    return Done(unit, outcomes, time.perf_counter() - begin)


def run_benchmark(
    plan: Plan,
    path: Path,
    *,
    workers: int = 1,
    scheduler: str | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> dict[Unit, Done[Outcome]]:
    """Do what is not yet done.

    Outcomes do not depend on who does the work, in what order, or on how often it was broken off.

    Args:
        plan: What is measured.
        path: File of rows.
        workers: Processes on this machine.
        scheduler: Address of a Dask scheduler instead.
        progress: Called with the numbers of units done and of all.

    Raises:
        ConfigError: when the scheduler cannot be used.
    """
    return do_waiting(
        RowFile(path, marks(plan), Outcome),
        {unit: unit for unit in plan.units},
        functools.partial(do_unit, plan),
        workers=workers,
        scheduler=scheduler,
        progress=progress,
    )
