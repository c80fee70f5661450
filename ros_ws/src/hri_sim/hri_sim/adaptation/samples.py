"""Simulated motions: the situation at their start, the parameters, and what became of them."""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import importlib.metadata
import json
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from hri_planner.adaptation.features import vector
from hri_planner.adaptation.grid import Cell
from hri_planner.adaptation.origin import TRAINED_FOR
from hri_planner.ptomp.situation import Situation
from hri_prediction.arm.geometry import FloatArray
from hri_prediction.compiled import processor
from hri_prediction.results.dependencies import dependency_hash
from hri_sim.adaptation.design import SPLIT, Job, Trial
from hri_sim.benchmark.conditions import task_conditions
from hri_sim.benchmark.episode import run_episode
from hri_sim.benchmark.first_look import start_situation
from hri_sim.benchmark.learning import task_library
from hri_sim.benchmark.outcome import CLEARANCES_M
from hri_sim.benchmark.planners import PLANNERS, PlannerSetup
from hri_sim.benchmark.rows import Done, RowFile, Unit, do_waiting

CONTACT_M = 0.02
"""The collision cost of Algorithm 1 begins below this true clearance, as the planner's contact cost [m]."""


SUCCESS_M = CLEARANCES_M[-1]
"""Clearance of a success to learn from [m]: free of contact are nearly all, whatever the parameters."""


@dataclass(frozen=True)
class Sample:
    """One motion.

    Attributes:
        condition: Number within the task.
        num_timesteps: TS.
        num_rollouts: NT.
        uncertainty: This and the four below: the situation at its start.
        error: See :class:`Situation`.
        distance: See :class:`Situation`.
        time_to_collision: See :class:`Situation`.
        collision_cost: See :class:`Situation`.
        ok: No contact, goal reached.
        clearance: Smallest true clearance [m].
        missing: Distance of the tool from the goal at the end; 0 if it arrived [m].
        control: Integral of the squared joint accelerations [rad^2/s^3].
        iterations: Optimisation steps of the motion.
    """

    condition: int
    num_timesteps: int
    num_rollouts: int
    uncertainty: float
    error: float
    distance: float
    time_to_collision: float
    collision_cost: float
    ok: bool
    clearance: float
    missing: float
    control: float
    iterations: int

    @property
    def cell(self) -> Cell:
        """The parameters."""
        return Cell(self.num_timesteps, self.num_rollouts)

    @property
    def situation(self) -> Situation:
        """At the start."""
        return Situation(
            self.uncertainty, self.error, self.distance, self.time_to_collision, self.collision_cost
        )

    @property
    def success(self) -> bool:
        """What models learn the chance of: ok, and 5 cm clear all the way."""
        return self.ok and self.clearance >= SUCCESS_M

    @property
    def features(self) -> FloatArray:
        """The five inputs as a vector."""
        return vector(self.situation)

    @property
    def collision(self) -> float:
        """Collision cost as Algorithm 1 asks for: what misses to 2 cm of clearance, and to the goal [m].

        A motion that waits for ever collides with nobody, but is no motion to the goal.
        """
        return max(CONTACT_M - self.clearance, 0.0) + self.missing


def setup_of(cell: Cell) -> PlannerSetup:
    """The planner with these parameters."""
    base = PLANNERS[TRAINED_FOR]
    chosen = {"num_timesteps": cell.num_timesteps, "num_rollouts": cell.num_rollouts}
    settings = tuple({**dict(base.settings), **chosen}.items())
    return dataclasses.replace(base, settings=settings)


def do_job(slowdown: float, job: Job) -> Done[Sample]:
    """Simulate the motions of a job."""
    begin = time.perf_counter()
    unit = job.unit
    conditions = task_conditions(SPLIT, unit.task).conditions
    library = task_library(SPLIT, unit.task)
    base = PLANNERS[TRAINED_FOR]
    assert base.observer is not None
    seen: dict[int, Situation] = {}
    samples = []
    for trial in job.trials:
        condition = conditions[trial.condition]
        if trial.condition not in seen:
            seen[trial.condition] = start_situation(
                condition, base.observer, base.config, library, unit.seed
            )
        outcome = run_episode(
            condition, setup_of(trial.cell), library, slowdown=slowdown, seed=unit.seed
        )
        samples.append(
            Sample(
                trial.condition,
                **dataclasses.asdict(trial.cell),
                **dataclasses.asdict(seen[trial.condition]),
                ok=outcome.ok,
                clearance=outcome.clearance,
                missing=0.0 if outcome.time_to_goal is not None else outcome.goal_error,
                control=outcome.accel_cost,
                iterations=outcome.iterations,
            )
        )
    return Done(unit, tuple(samples), time.perf_counter() - begin)


def gather(
    slowdown: float,
    jobs: Sequence[Job],
    path: Path,
    *,
    workers: int = 1,
    scheduler: str | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> dict[Unit, tuple[Sample, ...]]:
    """The samples of jobs; those that the file holds are not simulated again.

    Args:
        slowdown: F.
        jobs: What to simulate, no unit twice.
        path: File of rows.
        workers: Processes on this machine.
        scheduler: Address of a Dask scheduler instead.
        progress: Called with the numbers of jobs done and of all.

    Raises:
        ConfigError: when the scheduler cannot be used.
    """
    done = do_waiting(
        _SampleFile(path, _marks(slowdown, jobs), jobs),
        {job.unit: job for job in jobs},
        functools.partial(do_job, slowdown),
        workers=workers,
        scheduler=scheduler,
        progress=progress,
    )
    return {unit: result.outcomes for unit, result in done.items()}


class _SampleFile(RowFile[Sample]):
    """Rows of samples; those of other trials than are asked for are left alone."""

    def __init__(self, path: Path, marks: dict[str, str], jobs: Sequence[Job]) -> None:
        super().__init__(path, marks, Sample)
        self._trials = {job.unit: job.trials for job in jobs}

    def read(self) -> dict[Unit, Done[Sample]]:
        return {
            unit: done
            for unit, done in super().read().items()
            if tuple(Trial(s.condition, s.cell) for s in done.outcomes) == self._trials.get(unit)
        }


def _marks(slowdown: float, jobs: Sequence[Job]) -> dict[str, str]:
    """Hash of all that samples depend on but the trials, for each part of the design."""
    versions = [importlib.metadata.version(package) for package in ("numpy", "scipy", "numba")]
    settings = json.dumps(dataclasses.asdict(PLANNERS[TRAINED_FOR].config))
    parts = repr((slowdown, dependency_hash(__name__), processor(), versions, settings))
    mark = hashlib.sha256(parts.encode()).hexdigest()[:16]
    return {job.unit.planner: mark for job in jobs}
