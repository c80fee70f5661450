"""Compiles every kernel of planner and policies, so that no reach pays for it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from hri_planner.dmp.potential_field import FieldConfig
from hri_planner.dmp.runner import DmpRunner
from hri_planner.pibb.initial import straight_policy
from hri_planner.policy.partner import Partner
from hri_planner.policy.separation import SeparationConfig
from hri_planner.policy.stretch import Limits, stretch
from hri_planner.policy.tool_velocity import ToolVelocity, ToolVelocityConfig
from hri_planner.ptomp import HumanForecast, PtompConfig, PtompPlanner, TableBox
from hri_planner.ptomp.costs import CostModel
from hri_planner.robot import RobotModel, load_robot
from hri_planner.separation.config import (
    PREDICTED,
    BodyConfig,
    ProtectiveDistanceConfig,
    ReleaseConfig,
)
from hri_planner.separation.monitor import SeparationMonitor
from hri_planner.separation.predicted import ArmPrediction
from hri_planner.separation.robot_state import RobotState
from hri_planner.separation.track import ArmWatch
from hri_prediction.arm.geometry import arm_capsules
from hri_prediction.geometry import capsule_distances

PRECISIONS = ("double", "single")
"""Of the planner."""
_START = np.radians([-40.0, -40.0, 0.0, 90.0, 0.0, -40.0, 0.0])
_ARM = np.array([[0.8, 0.0, 0.4], [0.7, 0.0, 0.3], [0.5, 0.0, 0.3], [0.4, 0.0, 0.3]])
_RADII = np.array([0.05, 0.04, 0.05])


def warm_kernels() -> None:
    """Compile all kernels, with the types they are used with, into the cache; called by nodes."""
    for warm in PARTS:
        warm()


def _goal(robot: RobotModel) -> NDArray[np.float64]:
    return robot.frames(np.radians([40.0, -40.0, 0.0, 90.0, 0.0, -40.0, 0.0]))[3]


def warm_ptomp(precision: str) -> None:
    """Compile the kernels of the planner: a short reach past an arm in the way touches each of them.

    Args:
        precision: One of :data:`PRECISIONS`.
    """
    robot = load_robot()
    goal = _goal(robot)
    table = TableBox((0.5, 0.0, -0.1), (1.0, 1.0, 0.1))
    people = HumanForecast(0.0, 0.1, _ARM[None], np.full((1, 4), 0.02), _RADII)
    for weights in ("total", "per_step"):
        config = PtompConfig(precision=precision, weights=weights)
        planner = PtompPlanner(robot, config, np.random.default_rng(0), table)
        planner.start(_START, np.zeros(7), goal, 1.0, 0.0)
        planner.replan(0.04, [people], iterations=4)
        costs = CostModel(robot, config, table)
        costs.bind(np.linspace(0.0, 0.4, 5), goal, [people], 0.05)
        costs.clearances(np.tile(_START[:, None], (1, 1, 5)))  # asked for when there is a contact


def warm_policies() -> None:
    """Compile the kernels of policies: one that moves past the same arm."""
    robot = load_robot()
    goal = _goal(robot)
    axes = np.stack((_ARM[:-1], _ARM[1:]), axis=1)
    capsule_distances(robot.robot_capsules(_START), robot.capsule_radii, axes, _RADII)
    inverse = ToolVelocity(robot, ToolVelocityConfig())
    inverse.tool_motion(_START, np.zeros(7))
    partner = Partner(_ARM[-1], np.zeros(3), joints=_ARM, speeds=np.zeros((4, 3)))
    partner.distance(goal)
    limits = Limits(SeparationConfig(), True, 0.0)
    still = np.zeros(3)
    for reach in (0.0, 0.1):
        limits = replace(limits, link_reach=reach)
        stretch(goal, still, still, _START, np.zeros(7), [partner], 1, 0.004, limits, inverse)
    policy = straight_policy(robot, _START, {"goal": goal}, limits.boxes, 1.0)
    runner = DmpRunner(policy, FieldConfig(), limits, 0.004)
    tool = robot.frames(_START)[3]
    runner.set_out(tool, goal, 0.0)
    runner.move(runner.begin(tool), goal, [partner], _START, np.zeros(7), 1, inverse)


def warm_separation() -> None:
    """Compile the kernels of the separation monitor."""
    robot, release = load_robot(), ReleaseConfig()
    distance = ProtectiveDistanceConfig(human=PREDICTED)  # for which all kernels are needed
    monitor = SeparationMonitor(robot, distance, BodyConfig(), release)
    watch = ArmWatch("right", release)
    arm = np.array([[0.8, 0.0, 0.4], [0.7, 0.0, 0.1], [0.5, 0.0, 0.1], [0.4, 0.0, 0.1]])
    arm.setflags(write=False)  # as samples of messages are
    watch.add(1, arm)
    still = RobotState.following(np.zeros(7), np.zeros(7), 0.0, 1.0, np.zeros(7))
    times = np.array([0.0, 0.1])
    said = ArmPrediction(0.0, times, np.tile(arm, (2, 1, 1)), np.zeros((2, 4, 3, 3)))
    monitor.decide(1, still, {"person": watch.at(1)}, {("person", "right"): said})
    capsule_distances(
        robot.robot_capsules(np.zeros(7)), robot.capsule_radii, arm_capsules(arm), np.zeros(3)
    )


PARTS: tuple[Callable[[], None], ...] = (
    *(partial(warm_ptomp, precision) for precision in PRECISIONS),
    warm_policies,
    warm_separation,
)
"""All that there is to be compiled; the first of them takes as long as the others."""
