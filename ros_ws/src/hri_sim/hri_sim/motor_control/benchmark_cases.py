"""What the benchmark of optimal control and its inverse measures, part by part."""

from __future__ import annotations

import contextlib
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hri_prediction.errors import HriError
from hri_prediction.motor_control import design
from hri_prediction.motor_control.arm_model import ArmModel
from hri_prediction.motor_control.batch import Job, Outcome, explain_all
from hri_prediction.motor_control.costs import CHAPTER_2, CHAPTER_3, COSTS, indices_of
from hri_prediction.motor_control.ioc import explain
from hri_prediction.motor_control.law import explained
from hri_prediction.motor_control.multiple_shooting import MultipleShooting
from hri_prediction.motor_control.observed import of_angles
from hri_prediction.motor_control.ocp import Motion, NotConverged, ReachSolver
from hri_prediction.motor_control.problem import ReachProblem
from hri_prediction.motor_control.scaling import Scaling, scaling_of
from hri_prediction.motor_control.search import search
from hri_prediction.motor_control.seen import SHARE_OF_PEAK
from hri_sim.motor_control.benchmark_laws import Lawful, laws_case
from hri_sim.motor_control.first_solve import first_solve
from hri_sim.motor_control.people import (
    Recorded,
    draw_people,
    measured_arm,
    record,
    see,
)

Array = NDArray[np.float64]
Tick = Callable[[int, int], None]

INTERIOR = 0.03
"""Least weight that counts as interior."""
RATE_HZ = 250.0
_ATTEMPTS = 20
"""So often may a reach be drawn for which no optimum is found."""
_SPREAD_RAD = 0.3
"""How far off other starts are."""


@dataclass(frozen=True)
class Extent:
    """How much is measured.

    Attributes:
        tasks: Of the 81 of the design, evenly chosen.
        mixes: Random weights for each.
        reference: Solves by multiple shooting, evenly chosen.
        intervals: Of multiple shooting.
        starts: Other starts for each solve.
        inverse: Reaches without noise to explain, with a search beside each.
        people: Of the batch, all tasks each.
        laws: Of how many of them laws are fitted.
    """

    tasks: int = 81
    mixes: int = 5
    reference: int = 81
    intervals: int = 30
    starts: int = 3
    inverse: int = 60
    people: int = 15
    laws: int = 3


SMOKE = Extent(tasks=4, mixes=2, reference=2, intervals=15, starts=1, inverse=2, people=1, laws=1)


def chosen_tasks(count: int) -> list[ReachProblem]:
    """Reaches of the design, evenly chosen."""
    every = design.tasks()
    picked = np.unique(np.linspace(0, len(every) - 1, count).round().astype(int))
    return [ReachProblem.at_rest(*every[i][2:]) for i in picked]


def build_seconds() -> float:
    """From nothing to the first optimum in a new process, where nothing has been compiled yet [s].

    Imports, the model of the arm (derived, and compiled by the C compiler) and all compiled code of the
    solver.
    """
    with tempfile.TemporaryDirectory() as folder:
        cold = first_solve(Path(folder))
    return cold["import_s"] + cold["first_s"]


def ocp_case(extent: Extent, rng: np.random.Generator, tick: Tick) -> dict[str, Any]:
    """Solve reaches of random mixes of five costs, some of them by multiple shooting too."""
    built_s, new = build_seconds(), first_solve()
    arm = ArmModel.of_body()
    solver, reference = ReachSolver(arm), MultipleShooting(arm, extent.intervals)
    tasks = chosen_tasks(extent.tasks)
    jobs = [
        (task, rng.dirichlet(np.ones(len(CHAPTER_3))))
        for task in tasks
        for _ in range(extent.mixes)
    ]
    beside = set(np.linspace(0, len(jobs) - 1, extent.reference).round().astype(int).tolist())
    solver.solve(tasks[0], np.ones(len(COSTS)))  # the first call loads compiled code
    seconds, whole, gaps, ratios, theirs, spreads = [], [], [], [], [], []
    converged = 0
    for number, (task, alpha) in enumerate(jobs):
        try:
            asked = time.perf_counter()
            weights = scaling_of(solver, task).weights(alpha, CHAPTER_3)
            begun = time.perf_counter()
            motion = solver.solve(task, weights)
        except NotConverged:
            tick(number + 1, len(jobs))
            continue
        seconds.append(time.perf_counter() - begun)
        whole.append(time.perf_counter() - asked)
        converged += 1
        if number in beside:
            other = reference.solve(task, weights)
            if other.converged:
                phases = np.linspace(0.0, 1.0, extent.intervals + 1)
                apart = reference.hand(other) - motion.hand(phases, arm)
                gaps.append(float(np.linalg.norm(apart, axis=1).max()))
                theirs.append(other.seconds)
                ratios.append(other.seconds / seconds[-1])
        spreads += _other_starts(solver, task, weights, motion, extent.starts, rng)
        tick(number + 1, len(jobs))
    if not gaps:
        raise HriError("no reach was solved both ways", expected="one at least, to compare them")
    return {
        "build_seconds": built_s,
        "n": len(jobs),
        "converged": converged,
        "starts_n": len(spreads),
        "median_ms": 1e3 * float(np.median(seconds)),
        "p95_ms": 1e3 * float(np.percentile(seconds, 95.0)),
        "whole_median_ms": 1e3 * float(np.median(whole)),
        "new_process": new,
        "multiple_shooting_n": len(beside),
        "multiple_shooting_converged": len(theirs),
        "multiple_shooting_median_ms": 1e3 * float(np.median(theirs)),
        "speedup_vs_multiple_shooting": float(np.median(ratios)),
        "max_hand_gap_cm": 100.0 * max(gaps),
        "multistart_spread": max(spreads),
    }


def _other_starts(
    solver: ReachSolver,
    task: ReachProblem,
    weights: Array,
    motion: Motion,
    count: int,
    rng: np.random.Generator,
) -> list[float]:
    """By how much of itself the cost differs when a solve begins elsewhere: about the smoothest motion."""
    cost = float(weights @ motion.costs)
    smooth = solver.smooth(task)
    found = []
    for _ in range(count):
        start = smooth + rng.normal(0.0, _SPREAD_RAD, smooth.shape)
        try:
            again = solver.solve(task, weights, start=start)
        except NotConverged:
            found.append(1.0)  # a miss by all of itself
            continue
        found.append(abs(float(weights @ again.costs) - cost) / cost)
    return found


def inverse_case(extent: Extent, rng: np.random.Generator, tick: Tick) -> dict[str, Any]:
    """Find interior weights of reaches without noise again, beside a search without derivatives.

    Raises:
        HriError: nothing was explained, or no reach of which a part is seen.
    """
    solver = ReachSolver(ArmModel.of_body())
    every = design.tasks()
    errors, solves, seconds, not_worse, search_solves = [], [], [], [], []
    cut: list[tuple[tuple[float, float], tuple[float, float]]] = []
    for number in range(extent.inverse):
        task, alpha, scaling, motion = _interior(solver, every, rng)
        truth = scaling.factors[indices_of(CHAPTER_2)] * alpha
        with contextlib.suppress(NotConverged):
            free, known = (_of_cut(solver, motion, truth, seen=each) for each in (False, True))
            cut.append((free, known))
        phases = np.linspace(0.0, 1.0, round(task.duration * RATE_HZ) + 1)
        seen = of_angles(task, motion.angles(phases), solver.arm)
        begun = time.perf_counter()
        try:
            found = explain(solver, seen)
        except NotConverged:
            errors.append(1.0)  # the largest that there is
            not_worse.append(False)
        else:
            seconds.append(time.perf_counter() - begun)
            errors.append(float(np.abs(found.alpha - alpha).max()))
            solves.append(found.solves)
            with contextlib.suppress(NotConverged):
                beside = search(solver, seen)
                not_worse.append(found.distance_m <= beside.distance_m)
                search_solves.append(beside.solves)
        tick(number + 1, extent.inverse)
    if not search_solves or not cut:
        raise HriError("no reach without noise was explained both ways", expected="one at least")
    return {
        "n": extent.inverse,
        "not_explained": extent.inverse - len(solves),
        "search_n": len(search_solves),
        "alpha_error_median": float(np.median(errors)),
        "alpha_error_max": max(errors),
        "share_below_1e3": float(np.mean(np.array(errors) < 1e-3)),
        "solves_median": float(np.median(solves)),
        "solves_max": max(solves),
        "seconds_median": float(np.median(seconds)),
        "seconds_max": max(seconds),
        "dtw_not_worse_share": float(np.mean(not_worse)),
        "search_solves_median": float(np.median(search_solves)),
        "cut": {
            "n": len(cut),
            **{
                name: {
                    "alpha_error_median": float(np.median([pair[k][0] for pair in cut])),
                    "distance_cm_median": 100.0 * float(np.median([pair[k][1] for pair in cut])),
                }
                for k, name in enumerate(("accelerations_free", "accelerations_seen"))
            },
        },
    }


def _interior(
    solver: ReachSolver, every: Sequence[tuple[Any, ...]], rng: np.random.Generator
) -> tuple[ReachProblem, Array, Scaling, Motion]:
    """A random reach of the design, interior weights (4,), and its optimum; drawn anew where none is found.

    Raises:
        NotConverged: none is found for anything that was drawn.
    """
    for attempt in range(_ATTEMPTS):
        task = ReachProblem.at_rest(*every[int(rng.integers(len(every)))][2:])
        alpha = rng.dirichlet(np.full(len(CHAPTER_2), 2.0))
        while alpha.min() < INTERIOR:
            alpha = rng.dirichlet(np.full(len(CHAPTER_2), 2.0))
        try:
            scaling = scaling_of(solver, task)
            return task, alpha, scaling, solver.solve(task, scaling.weights(alpha, CHAPTER_2))
        except NotConverged:
            if attempt == _ATTEMPTS - 1:
                raise
    raise AssertionError("there is one attempt at least")


def _of_cut(
    solver: ReachSolver, motion: Motion, truth: Array, *, seen: bool
) -> tuple[float, float]:
    """Explain the part of a motion that is seen of reaches, without noise.

    Args:
        solver: Of the arm.
        motion: From rest to rest.
        truth: S alpha of its costs (n,).
        seen: Whether accelerations where it was cut are known; else they are left to the optimum, as of
            recordings, which are too noisy for them.

    Returns:
        Greatest error of a weight, and distance of the optimum by dynamic time warping and sample [m].
    """
    phases = np.linspace(0.0, 1.0, 401)
    speed = np.linalg.norm(np.gradient(motion.hand(phases, solver.arm), phases, axis=0), axis=1)
    fast = phases[speed >= SHARE_OF_PEAK * speed.max()]
    share = float(fast[-1] - fast[0])
    at = np.linspace(fast[0], fast[-1], round(share * motion.duration * RATE_HZ) + 1)
    q, v, a = (motion.angles(at, order)[[0, -1]] for order in (0, 1, 2))
    duration = share * motion.duration
    problem = ReachProblem.moving(q[0], q[1], duration, v[0], v[1])
    if seen:
        problem = ReachProblem(q[0], q[1], duration, v[0], v[1], a[0], a[1])
    found = explain(solver, of_angles(problem, motion.angles(at), solver.arm))
    same = truth / found.factors
    return float(np.abs(found.alpha - same / same.sum()).max()), found.distance_m


def people_case(
    extent: Extent, rng: np.random.Generator, tick: Tick, say: Callable[[str], None]
) -> dict[str, dict[str, Any]]:
    """Explain noisy reaches of simulated people, one after the other; fit laws of the first of them."""
    pairs = [(start, target) for start in range(len(design.STARTS_DEG)) for target in range(9)]
    if extent.tasks < len(pairs):
        pairs = [pairs[i] for i in np.linspace(0, len(pairs) - 1, extent.tasks).round().astype(int)]
    people = draw_people(extent.people, rng)
    say("recording people")
    jobs: list[Job] = []
    recorded: list[Recorded] = []
    lawful: list[Lawful] = []
    for number, person in enumerate(people):
        recordings = [record(person, start, target, rng) for start, target in pairs]
        arm = measured_arm(person, recordings)
        for each in recordings:
            jobs.append(Job(len(jobs), see(each, arm), arm))
            recorded.append(each)
        if number < extent.laws:
            lawful.append(Lawful.seen(recordings, arm))
        tick(number + 1, len(people))
    say("explaining their reaches, on one core")
    begun = time.perf_counter()
    outcomes = explain_all(jobs, workers=1, progress=tick)
    seconds = time.perf_counter() - begun
    # Weights mean nothing without scale factors, and those of the reach as it was seen (cut, averaged) are
    # others than those of the reach as it was made.
    truth = [
        one.alpha_with(np.array(o.factors)) if o.factors else one.alpha
        for one, o in zip(recorded, outcomes, strict=True)
    ]
    nothing = np.full(len(CHAPTER_2), 1.0 / len(CHAPTER_2))
    single = [np.array(o.alpha) if o.alpha else nothing for o in outcomes]
    own = [slice(k * len(pairs), (k + 1) * len(pairs)) for k in range(len(people))]
    return {
        "batch": {
            "n": len(jobs),
            "seconds": seconds,
            "failed": sum(bool(o.error) for o in outcomes),
        },
        "composite": _composite(outcomes[own[0]], truth[own[0]]),
        "law": {
            **laws_case(lawful, tick, say),
            "r2_single_reaches": min(
                explained(truth[each], single[each]) for each in own[: len(lawful)]
            ),
        },
    }


def _composite(outcomes: Sequence[Outcome], truth: Sequence[Array]) -> dict[str, Any]:
    """How near the mix of all costs is to what was seen, beside each cost alone."""
    done = [(each, alpha) for each, alpha in zip(outcomes, truth, strict=True) if not each.error]
    mixed = np.array([each.distance_cm for each, _ in done])
    single = np.array([each.single_cm for each, _ in done], dtype=float)
    single[np.isnan(single)] = np.inf  # a cost alone that has no optimum is no better
    best = single.mean(axis=0).min()
    errors = [float(np.abs(np.array(each.alpha) - alpha).max()) for each, alpha in done]
    return {
        "n": len(outcomes),
        "not_worse": int((mixed <= single.min(axis=1) + 1e-12).sum()),
        "mean_dtw_cm": float(mixed.mean()),
        "single_mean_cm": {
            name: float(value) if np.isfinite(value) else None
            for name, value in zip(CHAPTER_2, single.mean(axis=0), strict=True)
        },
        "ratio_best_single": float(mixed.mean() / best),
        "alpha_error_median": float(np.median(errors)),
    }
