"""The planners by the clock of this machine: what replans and their parts take, and which come too late.

The person and the robot move as in :mod:`.episode`, but a replan ends when its share of the interval is
over, as in ptomp's node, and what is not ready in time is dropped: the robot stays on the plan before.
Figures differ from run to run; nothing else may run on the machine while they are taken.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from hri_planner.ptomp import HumanForecast, PtompPlanner, ReplanResult, TableBox
from hri_planner.ptomp.budget import BASE_S, EXTRA_POINTS, PER_POINT_S
from hri_planner.robot import load_robot
from hri_prediction.errors import ConfigError, PlanningError
from hri_prediction.prediction import TaskLibrary
from hri_prediction.tracks.track import ArmSample
from hri_sim.benchmark.conditions import Condition
from hri_sim.benchmark.execution import PAPER, Run
from hri_sim.benchmark.iteration_times import IterationTimer
from hri_sim.benchmark.joints import standing
from hri_sim.benchmark.observers import OBSERVERS, Observer
from hri_sim.benchmark.planners import PlannerSetup
from hri_sim.benchmark.variation import AS_DRAWN, Variation
from hri_sim.benchmark.watching import Watch

COMPUTE_SHARE = 0.5
"""Share of the interval that a replan may take, as in ptomp's node."""
READY_S = 0.009
"""How long before its hand-over a plan must be ready: a tick of ptomp's node, and the way [s]."""


@dataclass
class Times:
    """What was measured of one planner; lists have one entry a measurement [s].

    Attributes:
        interval_s: Between two hand-overs [s].
        replan: Whole replans, under the deadline.
        missed: How many of them were late.
        failures: How many gave no plan.
        iterations: How many optimisation steps replans took in all.
        iteration: Optimisation steps, timed on the same plans beside the replans.
        iteration_charge: What the cost model of virtual time charges for each.
        prediction: The samples of an interval and one forecast.
        gather: Replans without iterations and other final postures.
        gather_met: Those of them in which the plan met the person.
        posture: For each final posture that is looked for, the mean of a replan.
        start: First final postures and the motions to them.
        ok: Whether the robot got to its goal without contact, one a condition.
    """

    interval_s: float = 0.0
    replan: list[float] = field(default_factory=list)
    missed: int = 0
    failures: int = 0
    iterations: int = 0
    iteration: list[float] = field(default_factory=list)
    iteration_charge: list[float] = field(default_factory=list)
    prediction: list[float] = field(default_factory=list)
    gather: list[float] = field(default_factory=list)
    gather_met: list[float] = field(default_factory=list)
    posture: list[float] = field(default_factory=list)
    start: list[float] = field(default_factory=list)
    ok: list[bool] = field(default_factory=list)


class _TimedObserver:
    """An observer, and what it took since it was last asked [s]."""

    def __init__(self, observer: Observer, times: list[float]) -> None:
        self._observer = observer
        self._times = times
        self._spent_s = 0.0

    def see(self, sample: ArmSample) -> None:
        begin = time.perf_counter()
        self._observer.see(sample)
        self._spent_s += time.perf_counter() - begin

    def forecast(self, now_s: float) -> HumanForecast | None:
        begin = time.perf_counter()
        forecast = self._observer.forecast(now_s)
        self._times.append(self._spent_s + time.perf_counter() - begin)
        self._spent_s = 0.0
        return forecast


class _Prices:
    """What a replan costs besides iterating, by planners that follow the one that is measured.

    Args:
        make: Makes a planner of the same kind with so many final postures to look for.
        candidates: How many the planner that is measured looks for.
        start: Has a planner begin the reach.
        times: Where prices go.
    """

    def __init__(
        self,
        make: Callable[[int], PtompPlanner],
        candidates: int,
        start: Callable[[PtompPlanner], None],
        times: Times,
    ) -> None:
        self._candidates = candidates
        self._times = times
        self._planners = [make(count) for count in sorted({0, candidates})]
        for planner in self._planners:
            start(planner)

    def note(
        self, measured: PtompPlanner, handover_s: float, known: list[HumanForecast], met: bool
    ) -> None:
        """Take the prices of the replan that comes next."""
        spent = []
        assert measured.plan is not None
        for planner in self._planners:
            planner.follow(measured.plan)
            begin = time.perf_counter()
            try:
                planner.replan(handover_s, known, iterations=0)
            except PlanningError:
                return
            spent.append(time.perf_counter() - begin)
        self._times.gather.append(spent[0])
        if met:
            self._times.gather_met.append(spent[0])
        if self._candidates:
            self._times.posture.append((spent[1] - spent[0]) / self._candidates)


def _passed(time_s: float) -> bool:
    return time.perf_counter() >= time_s


def measure_condition(
    condition: Condition,
    setup: PlannerSetup,
    library: TaskLibrary,
    times: Times,
    *,
    seed: int,
    variation: Variation = AS_DRAWN,
    execution: str = PAPER,
) -> None:
    """Let a planner that replans bring the robot to the goal of a condition, and add what it took.

    Args:
        condition: Scene, person, goal.
        setup: The planner.
        library: What was learnt from the task's recorded reaches.
        times: Where figures go.
        seed: Of tracking noise and the planner's noise.
        variation: What is otherwise than drawn.
        execution: What makes a motion of plans, one of `EXECUTIONS`.

    Raises:
        PlanningError: when the planner refuses the goal.
        ConfigError: for a planner whose time steps are chosen at the start: it has no interval of its own.
    """
    if setup.adaptation is not None:
        raise ConfigError(
            f"--real-time with {setup.name}", expected="planners whose time steps are not chosen"
        )
    assert setup.observer is not None
    robot, scenario, person = load_robot(), condition.scenario, variation.person_in(condition)
    rngs = np.random.default_rng([seed, scenario.seed]).spawn(5)
    observer = _TimedObserver(OBSERVERS[setup.observer](person, library), times.prediction)
    watch = Watch(person, observer, rngs.pop())
    table, config = TableBox(scenario.table.center, scenario.table.size), setup.config
    duration = scenario.reaches[0].duration
    interval_s = times.interval_s = duration / config.num_timesteps
    q, rest, goal = np.array(scenario.robot_start), np.zeros(7), np.array(condition.robot_goal)

    def make(candidates: int) -> PtompPlanner:
        changed = replace(config, posture_candidates=candidates)
        return PtompPlanner(robot, changed, rngs.pop(), table)

    def start(planner: PtompPlanner) -> None:
        begin = time.perf_counter()
        planner.start(q, rest, goal, duration, 0.0)
        times.start.append(time.perf_counter() - begin)

    planner = make(config.posture_candidates)
    start(planner)
    prices = _Prices(make, config.posture_candidates, start, times)
    timer = IterationTimer(planner, goal, rngs.pop())
    run = Run(condition, person, standing(q), execution)
    assert planner.plan is not None
    run.plan = planner.plan
    result: ReplanResult | None = None
    cycle, replans, failures, iterations = 0, 0, 0, 0
    while not run.over:
        handover_s = cycle * interval_s
        watch.advance(handover_s - interval_s)
        if cycle and (followed := run.followed) is not planner.plan:
            planner.follow(followed)
        known = watch.known(1)
        met = result is not None and (
            result.stage == "waiting"
            or result.cost_terms["collision"] + result.cost_terms["contact"]
            > planner.config.trouble_cost
        )
        prices.note(planner, handover_s, known, met)
        taken = timer.times(handover_s, known)
        times.iteration += taken
        before, steps = planner.snapshot(), planner.free_steps(handover_s)
        begin = time.perf_counter()
        is_over = partial(_passed, begin + COMPUTE_SHARE * interval_s)
        replans += 1
        try:
            result = planner.replan(handover_s, known, deadline=is_over)
            times.iterations += result.iterations
        except PlanningError:
            result = None
            failures += 1
        spent_s = time.perf_counter() - begin
        times.replan.append(spent_s)
        charge_s = BASE_S + PER_POINT_S * config.num_rollouts * (steps + EXTRA_POINTS)
        times.iteration_charge += [charge_s] * len(taken)
        late = spent_s > interval_s - READY_S
        times.missed += late
        if result is None or late:
            planner.restore(before)
        else:
            run.plan = result.plan
            iterations += result.iterations
        cycle += 1
        run.until(cycle * interval_s)
    _, outcome = run.ended(replans, failures, iterations)
    times.failures += outcome.failures
    times.ok.append(outcome.ok)
