"""Inverse optimal control of many reaches: spread over processes, each result kept at once."""

from __future__ import annotations

import functools
import hashlib
import json
import math
import os
import time
from collections.abc import Callable, Sequence
from dataclasses import astuple, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from hri_prediction.compiled import processor
from hri_prediction.errors import DataError, HriError
from hri_prediction.motor_control.arm_model import ANATOMICAL, ArmModel, JointLimits
from hri_prediction.motor_control.compiled_graph import compiled_graph, library_path
from hri_prediction.motor_control.convention import CONVENTIONS
from hri_prediction.motor_control.costs import CHAPTER_2, indices_of
from hri_prediction.motor_control.ioc import explain
from hri_prediction.motor_control.observed import ObservedReach
from hri_prediction.motor_control.ocp import Motion, ReachSolver
from hri_prediction.motor_control.scaling import MAXIMUM, scaling_of
from hri_prediction.motor_control.seen import KNOT_S, from_rest
from hri_prediction.motor_control.uncertainty import certainty
from hri_prediction.results.dependencies import dependency_hash
from hri_prediction.results.workers import computed_with, do_all, versions

WORK = "hri_prediction.motor_control.batch"
PACKAGES = ("numpy", "scipy", "numba", "casadi")


@dataclass(frozen=True, eq=False)
class Job:
    """One reach to explain.

    Attributes:
        index: Its number in the batch.
        observed: What was seen.
        arm: Whose arm it was.
        names: Costs that may have a part in it.
        scaling: How costs are brought to one range.
        limits: Of the joints.
        correlated: So many samples in a row share an error (`uncertainty.certainty`).
    """

    index: int
    observed: ObservedReach
    arm: ArmModel
    names: tuple[str, ...] = CHAPTER_2
    scaling: str = MAXIMUM
    limits: JointLimits = ANATOMICAL
    correlated: float = 1.0

    @property
    def key(self) -> str:
        """Stands for all that decides about the result: the reach, the arm, settings, sources, versions."""
        digest = hashlib.sha256(_made_by().encode())
        problem = self.observed.problem
        arrays = (
            self.observed.phases, self.observed.angles, self.observed.hand, problem.q_start, problem.q_end,
            problem.v_start, problem.v_end, problem.a_start, problem.a_end, np.array([problem.duration]),
        )  # fmt: skip
        for array in arrays:
            digest.update(b"none" if array is None else array.tobytes())
        rest = (astuple(self.arm), self.names, self.scaling, astuple(self.limits), self.correlated)
        digest.update(repr(rest).encode())
        return digest.hexdigest()[:24]


@dataclass(frozen=True)
class Outcome:
    """What came of one reach; all numbers are plain, so that it can be kept as a line of JSON.

    Attributes:
        index: Of the job.
        name: Of the reach.
        error: Why it could not be explained; empty: it was.
        alpha: Weights.
        sd: Their standard deviations.
        factors: S of these costs.
        distance_cm: Of the hand, by dynamic time warping.
        single_cm: The same of each cost alone; none where that has no optimum.
        joint_distance_deg: Of the joints.
        single_joint_deg: The same of each cost alone.
        solves: How often the lower level was solved.
        seconds: Processor time that it took.
        rest_factors: S of these costs of the whole reach, from rest to rest (`seen.from_rest`); empty where
            that has no optimum.
        covariance: Of the errors of weights, row by row (n n,).
    """

    index: int
    name: str
    error: str = ""
    alpha: tuple[float, ...] = ()
    sd: tuple[float, ...] = ()
    factors: tuple[float, ...] = ()
    distance_cm: float = 0.0
    single_cm: tuple[float | None, ...] = ()
    joint_distance_deg: float = 0.0
    single_joint_deg: tuple[float | None, ...] = ()
    solves: int = 0
    seconds: float = 0.0
    rest_factors: tuple[float, ...] = ()
    covariance: tuple[float, ...] = ()


def compiled_models() -> list[str]:
    """Names of the compiled models of the arm, after all that decides about them."""
    return [library_path(convention).name for convention in CONVENTIONS]


@functools.cache
def _made_by() -> str:
    parts = (dependency_hash(WORK), processor(), sorted(versions(PACKAGES).items()))
    return repr((*parts, compiled_models()))


def made_with() -> dict[str, str]:
    """What workers of a cluster must have in common, the C compiler included."""
    return {**computed_with(WORK, PACKAGES), "compiled models": " ".join(compiled_models())}


def correlated(reach: ObservedReach) -> float:
    """How many samples in a row of a reach share an error: splines pass what is slower than their knots."""
    step_s = reach.problem.duration / (len(reach.phases) - 1)
    return max(KNOT_S / step_s, 1.0)


@functools.lru_cache(maxsize=64)
def _solver(arm: ArmModel, limits: JointLimits) -> ReachSolver:
    return ReachSolver(arm, limits)


def explain_job(job: Job) -> Outcome:
    """Explain one reach; what is wrong with it becomes a part of the outcome."""
    begun = time.process_time()
    solver = _solver(job.arm, job.limits)
    observed = job.observed
    try:
        found = explain(solver, observed, job.names, scaling=job.scaling)
        sure = certainty(found, observed, correlated=job.correlated)
    except (HriError, np.linalg.LinAlgError) as error:
        return Outcome(job.index, observed.name, error=str(error))
    return Outcome(
        index=job.index,
        name=observed.name,
        alpha=tuple(found.alpha.tolist()),
        sd=tuple(sure.sd.tolist()),
        covariance=tuple(sure.covariance.ravel().tolist()),
        factors=tuple(found.factors.tolist()),
        rest_factors=_rest_factors(solver, job),
        distance_cm=100.0 * found.distance_m,
        single_cm=tuple(
            100.0 * value if math.isfinite(value) else None for value in found.single_m.tolist()
        ),
        joint_distance_deg=_joints_deg(observed, found.motion),
        single_joint_deg=tuple(
            None if motion is None else _joints_deg(observed, motion)
            for motion in found.single_motions
        ),
        solves=found.solves,
        seconds=time.process_time() - begun,
    )


def _rest_factors(solver: ReachSolver, job: Job) -> tuple[float, ...]:
    try:
        scaling = scaling_of(solver, from_rest(job.observed.problem), job.scaling)
    except (HriError, np.linalg.LinAlgError):
        return ()
    return tuple(scaling.factors[indices_of(job.names)].tolist())


def _joints_deg(observed: ObservedReach, motion: Motion) -> float:
    return math.degrees(observed.joint_distance(motion.angles(observed.phases)))


class Kept:
    """Outcomes on the disk, a line each, by the key of their job.

    Args:
        path: The file; it need not exist. A line that was broken off is left out, and what other jobs,
            settings or sources left there is not touched.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._found: dict[str, Outcome] = {}
        try:
            text = path.read_text()
        except FileNotFoundError:
            text = ""
        except (OSError, ValueError) as error:
            raise DataError(
                f"cannot read {path}: {error}", hint="move it away, or name another --out"
            ) from error
        # What follows a line that was broken off must not become a part of it.
        self._before = "\n" if text and not text.endswith("\n") else ""
        for line in text.splitlines():
            try:
                entry = json.loads(line)
                key = entry.pop("key")
                self._found[key] = _outcome(entry)
            except (ValueError, LookupError, TypeError, AttributeError):
                continue

    def get(self, job: Job) -> Outcome | None:
        """What came of a job, if it was done before."""
        found = self._found.get(job.key)
        return None if found is None else replace(found, index=job.index, name=job.observed.name)

    def add(self, job: Job, outcome: Outcome) -> None:
        """Keep an outcome: at once, so that nothing that was done is done again."""
        self._found[job.key] = outcome
        with self.path.open("a") as file:
            line = json.dumps({"key": job.key, **outcome.__dict__}, allow_nan=False)
            file.write(f"{self._before}{line}\n")
            file.flush()
            os.fsync(file.fileno())
        self._before = ""


def _outcome(entry: dict[str, Any]) -> Outcome:
    """An outcome of what a line holds.

    Raises:
        TypeError: it holds something else.
    """
    values: dict[str, Any] = {k: tuple(v) if isinstance(v, list) else v for k, v in entry.items()}
    made = Outcome(**values)
    rows = [made.alpha, made.sd, made.factors, made.single_cm, made.single_joint_deg]
    whole = all(isinstance(row, tuple) and len(row) == len(made.alpha) for row in rows)
    whole = whole and len(made.rest_factors) in (0, len(made.alpha))
    whole = whole and len(made.covariance) == len(made.alpha) ** 2
    rows += [made.rest_factors, made.covariance]
    numbers = [made.index, made.solves, made.seconds, made.distance_cm, made.joint_distance_deg]
    numbers += [
        value for row in rows if isinstance(row, tuple) for value in row if value is not None
    ]
    plain = all(isinstance(value, int | float) and math.isfinite(value) for value in numbers)
    named = isinstance(made.name, str) and isinstance(made.error, str)
    if not (whole and plain and named and bool(made.alpha) != bool(made.error)):
        raise TypeError("a line of something else")
    return made


def explain_all(
    jobs: Sequence[Job],
    *,
    workers: int,
    scheduler: str | None = None,
    kept: Kept | None = None,
    progress: Callable[[int, int], None] = lambda done, of: None,
) -> list[Outcome]:
    """Explain many reaches.

    Args:
        jobs: Each with an index of its own.
        workers: Processes.
        scheduler: Of a Dask cluster that does it instead.
        kept: Where outcomes are kept, and found again.
        progress: Called with how many are done, and how many there are.

    Returns:
        In the order of the jobs; the same for any number of workers.

    Raises:
        ConfigError: on a scheduler that does not answer, or whose workers run other code.
    """
    found: dict[int, Outcome] = {}
    for job in jobs:
        outcome = None if kept is None else kept.get(job)
        if outcome is not None:
            found[job.index] = outcome
    missing = {job.index: job for job in jobs if job.index not in found}
    progress(len(found), len(jobs))
    if missing:
        conventions = tuple({job.arm.convention for job in missing.values()})
        results = do_all(
            explain_job,
            list(missing.values()),
            workers=workers,
            scheduler=scheduler,
            prepare=functools.partial(prepare, conventions),
            computed_with=made_with,
        )
        for outcome in results:
            found[outcome.index] = outcome
            if kept is not None:
                kept.add(missing[outcome.index], outcome)
            progress(len(found), len(jobs))
    return [found[job.index] for job in jobs]


def prepare(conventions: Sequence[str]) -> None:
    """Have the models of the arm compiled, once, before many ask for them at the same time."""
    for convention in conventions:
        compiled_graph(convention)
