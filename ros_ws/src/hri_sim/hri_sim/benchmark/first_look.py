"""What adaptation is told when a motion of the benchmark starts."""

from __future__ import annotations

import numpy as np

from hri_planner.adaptation.first_look import FirstLook
from hri_planner.adaptation.grid import TIMESTEPS
from hri_planner.ptomp import HumanForecast, PtompConfig, PtompPlanner, TableBox
from hri_planner.ptomp.situation import WRIST, PredictionError, Situation, uncertainty
from hri_planner.robot import load_robot
from hri_prediction.geometry.segments import capsule_distances
from hri_prediction.prediction import TaskLibrary
from hri_sim.benchmark.conditions import SPLITS, Condition
from hri_sim.benchmark.observers import OBSERVERS
from hri_sim.benchmark.variation import AS_DRAWN, Variation
from hri_sim.benchmark.watching import WATCHED_S, Watch

PERIOD_S = 0.02
"""While it is watched, predictions of the person are made as often as in the graph [s]."""

LONGEST_INTERVAL = 1.0 / min(TIMESTEPS)
"""Of the replans that may be chosen, as a share of the motion's duration."""

_ENTROPY = 20150611  # of tracking and planners' noise


def episode_seeds(
    condition: Condition, seed: int
) -> tuple[np.random.SeedSequence, np.random.SeedSequence]:
    """Of the tracking and of the planner's noise; planners of one seed see the same samples."""
    task = condition.task
    key = (SPLITS.index(task.split), task.number, condition.number, seed)
    tracking, noise = np.random.SeedSequence(_ENTROPY, spawn_key=key).spawn(2)
    return tracking, noise


def start_situation(
    condition: Condition,
    observer: str,
    config: PtompConfig,
    library: TaskLibrary,
    seed: int,
    variation: Variation = AS_DRAWN,
) -> Situation:
    """The five inputs at the start of a motion: seen is what a planner of that seed sees.

    The look ends when the first replan begins, an interval before the motion; as what is chosen decides
    how long that is, the longest interval: no choice is made from what its replan does not know.

    Args:
        condition: Scene, person, goal.
        observer: What is known of the person.
        config: Of the planner before adaptation.
        library: What was learnt from the task's recorded reaches.
        seed: Of tracking noise and the planner's noise.
        variation: What is otherwise than drawn.

    Raises:
        PlanningError: when the planner refuses the goal.
    """
    tracking, noise = episode_seeds(condition, seed)
    person = variation.person_in(condition)
    watch = Watch(person, OBSERVERS[observer](person, library), np.random.default_rng(tracking))
    error, known = PredictionError(), list[HumanForecast]()
    duration_s = condition.scenario.reaches[0].duration
    begin_s = -LONGEST_INTERVAL * duration_s
    for k in range(int((begin_s + WATCHED_S) / PERIOD_S))[::-1]:
        watch.advance(begin_s - k * PERIOD_S)
        known = watch.known(1)
        for said in known:
            offsets = np.asarray(said.dt_s * np.arange(len(said.mean)), dtype=np.float64)
            error.observe(said.time0_s, offsets, np.asarray(said.mean, dtype=float)[:, WRIST])
    robot, scenario = load_robot(), condition.scenario
    table = TableBox(scenario.table.center, scenario.table.size)
    q, goal = np.array(scenario.robot_start), np.array(condition.robot_goal)
    planner = PtompPlanner(robot, config, np.random.default_rng(noise), table)
    plan = planner.start(q, np.zeros(7), goal, duration_s, 0.0)
    body = robot.robot_capsules(q), robot.capsule_radii
    return FirstLook(robot, config, table).situation(
        plan,
        goal,
        duration_s,
        known,
        uncertainties=[uncertainty(said) for said in known],
        errors=[error.rms],
        distance=min((_distance(*body, said) for said in known), default=np.inf),
    )


def _distance(capsules: np.ndarray, radii: np.ndarray, said: HumanForecast) -> float:
    """Smallest surface distance of robot and the arm as it was seen last [m]."""
    points = np.asarray(said.mean, dtype=float)[0]
    limbs = np.stack((points[:-1], points[1:]), axis=1)
    return float(capsule_distances(capsules, radii, limbs, said.radii).min())
