"""One condition from start to end in virtual time: what is computed takes the time of a cost model.

The person moves as it truly does and is tracked at 250 Hz with noise, latency and drop-outs. The
planner has an interval (duration / TS) for each replan. A replan is charged what predicting, gathering
other motions and iterating cost on the machine of the benchmark (F times slower than the reference).
The next begins when it has taken effect. Where one takes more than an interval, it takes effect so much
later, made from what was known when it began; meanwhile the robot goes on along the plan before, or
stands until it has one. A planner that plans once has, before the motion, the time that others have during
the whole of it, and keeps nobody waiting.
"""

from __future__ import annotations

import numpy as np

from hri_planner.ptomp import HumanForecast, PtompPlanner, ReplanResult, TableBox
from hri_planner.ptomp.budget import START_S, VirtualTimeBudget, replan_charge
from hri_planner.ptomp.config import LOOK_S
from hri_planner.robot import load_robot
from hri_prediction.errors import PlanningError
from hri_prediction.prediction import TaskLibrary
from hri_sim.benchmark.adapted import adapted_config
from hri_sim.benchmark.conditions import Condition
from hri_sim.benchmark.execution import PAPER, Run
from hri_sim.benchmark.first_look import episode_seeds
from hri_sim.benchmark.joints import standing
from hri_sim.benchmark.observers import OBSERVERS
from hri_sim.benchmark.outcome import LIMIT_S, Execution, Outcome
from hri_sim.benchmark.planners import PlannerSetup, nominal_plan
from hri_sim.benchmark.variation import AS_DRAWN, Variation
from hri_sim.benchmark.watching import Watch

SLOWDOWNS = (1, 8, 64, 512)
"""Values of F: how many times slower than the reference a machine is."""


def run_episode(
    condition: Condition,
    setup: PlannerSetup,
    library: TaskLibrary,
    *,
    slowdown: float,
    seed: int,
    variation: Variation = AS_DRAWN,
    execution: str = PAPER,
) -> Outcome:
    """What becomes of a condition when a planner brings the robot to its goal; see `watch_episode`."""
    return watch_episode(
        condition, setup, library, slowdown=slowdown, seed=seed, variation=variation, execution=execution
    )[1]  # fmt: skip


def watch_episode(
    condition: Condition,
    setup: PlannerSetup,
    library: TaskLibrary,
    *,
    slowdown: float,
    seed: int,
    variation: Variation = AS_DRAWN,
    execution: str = PAPER,
) -> tuple[Execution, Outcome]:
    """Let a planner bring the robot to the goal of a condition.

    Args:
        condition: Scene, person, goal.
        setup: The planner.
        library: What was learnt from the task's recorded reaches.
        slowdown: F.
        seed: Of tracking noise and the planner's noise; planners of one seed see the same samples.
        variation: What is otherwise than drawn.
        execution: What makes a motion of plans, one of `EXECUTIONS`.

    Returns:
        The motions of robot and person, and what they amount to.

    Raises:
        PlanningError: when the planner refuses the goal.
        ConfigError: when the setup names a model that does not ship.
        DataError: when its file is unusable.
    """
    tracking, noise = episode_seeds(condition, seed)
    robot, scenario, person = load_robot(), condition.scenario, variation.person_in(condition)
    if setup.observer is None:
        run = Run(condition, person, nominal_plan(robot, scenario), execution)
        run.until(LIMIT_S)
        return run.ended(0, 0, 0)
    observer = OBSERVERS[setup.observer](person, library)
    watch = Watch(person, observer, np.random.default_rng(tracking))
    table = TableBox(scenario.table.center, scenario.table.size)
    config, start_charge_s = setup.config, START_S
    if setup.adaptation is not None:
        config, choosing_s = adapted_config(
            config, setup.adaptation, condition, setup.observer, library, seed, variation
        )
        start_charge_s += choosing_s
    planner = PtompPlanner(robot, config, np.random.default_rng(noise), table)
    duration = scenario.reaches[0].duration
    interval_s = duration / config.num_timesteps
    budget, fixed_s = VirtualTimeBudget(slowdown), replan_charge(setup.config)
    q, rest, goal = np.array(scenario.robot_start), np.zeros(7), np.array(condition.robot_goal)
    run = Run(condition, person, standing(q), execution)
    replans, failures, iterations, cycle, last = 0, 0, 0, 0, -1
    while not run.over:
        if replans and not config.interleaved:
            run.until(LIMIT_S)
            break
        handover_s = cycle * interval_s
        watch.advance(handover_s - interval_s)
        if planner.plan is None:
            left_s = duration
        elif planner.stage == "waiting":
            left_s = LOOK_S  # all of the horizon is optimised
        else:
            left_s = max(planner.plan.end_s - handover_s, 0.0)
        charge_s = fixed_s + (start_charge_s if planner.plan is None else 0.0)
        given_s = interval_s if config.interleaved or cycle else duration
        granted = budget.grant(given_s, config.num_rollouts, round(left_s / interval_s), charge_s)
        if granted is not None:
            if setup.max_iterations is not None:
                granted = min(granted, setup.max_iterations)
            if planner.plan is None:
                # As in the graph, what the robot sets off with is replanned once before.
                run.plan = planner.start(q, rest, goal, duration, handover_s)
            elif (followed := run.followed) is not planner.plan:
                planner.follow(followed)
            known, last = watch.known(cycle - last), cycle
            replans += 1
            try:
                result = _replan(planner, handover_s, known, granted)
                run.plan = result.plan
                iterations += result.iterations
            except PlanningError:
                failures += 1
        cycle += 1
        run.until(cycle * interval_s)
    return run.ended(replans, failures, iterations)


def _replan(
    planner: PtompPlanner, handover_s: float, forecasts: list[HumanForecast], iterations: int
) -> ReplanResult:
    """The next plan; after a failure the planner is as it was.

    Raises:
        PlanningError: when the planner has none; the robot stays on the plan before.
    """
    before = planner.snapshot()
    try:
        return planner.replan(handover_s, forecasts, iterations=iterations)
    except PlanningError:
        planner.restore(before)
        raise
