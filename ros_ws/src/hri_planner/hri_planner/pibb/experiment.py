"""What an experiment is: where goals, obstacles and the person's targets are, and how much is tried."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hri_planner.dmp.policy import AT_GOAL_M, HOME, DmpPolicy
from hri_planner.pibb.costs import CostWeights
from hri_planner.pibb.initial import CLEAR_M, straight_policy
from hri_planner.pibb.names import check_name
from hri_planner.policy.config import PolicyConfig
from hri_planner.policy.link_bounds import box_clearance
from hri_planner.robot.ik import solve_ik
from hri_planner.robot.model import RobotModel
from hri_prediction.config import parameter, validate
from hri_prediction.errors import ConfigError, PlanningError, shown

FloatArray = NDArray[np.float64]

RESPONSES = ("press", "hand")
TABLE = ((0.85, 0.0, -0.03), (0.6, 0.7, 0.02))
"""Centre and half the size of the table, unless an experiment has another [m]."""
TARGETS_APART_M = 0.1
"""Twice as far from each other as a hand is that has arrived at one [m]."""
OFF_GOALS_M = 0.13
"""Nearer to a resting hand than this the filter keeps the tool off its goal [m]."""


@dataclass(frozen=True)
class Improvement:
    """How a policy is improved.

    The last update's policy is what few roll-outs made of the one before; the mean of those of the last
    updates is what is common to them (Polyak & Juditsky 1992).

    Raises:
        ConfigError: when a value is out of range.
    """

    updates: int = parameter(15, "Updates of the policy", low=1, high=1000)
    rollouts: int = parameter(
        6, "Trials of each goal in an update, the mean among them", low=2, high=100
    )
    habituation: int = parameter(
        2, "Trials of each goal with the initial policy, before anything is learnt", low=1, high=100
    )
    exploration: float = parameter(
        0.05, "Standard deviation of a weight in the first update", unit="m", low=1e-4, high=0.5
    )
    decay: float = parameter(0.90, "What is left of it after each update", low=0.1, high=1.0)
    greed: float = parameter(8.0, "h: how much better trials count for more", low=0.0, high=100.0)
    averaged: int = parameter(
        1,
        "What has been learnt is the mean of the policies after so many last updates; 1: the last one",
        low=1,
        high=1000,
    )

    def __post_init__(self) -> None:
        """Check the values."""
        validate(self)
        if self.averaged > self.updates:
            raise ConfigError(
                f"improvement.averaged = {self.averaged}",
                expected=f"at most improvement.updates = {self.updates}",
            )

    @property
    def first_averaged(self) -> int:
        """How many updates there are before those that are averaged."""
        return self.updates - self.averaged

    def lasting(self, updates: int) -> Improvement:
        """The same for another number of updates, of which as large a share is averaged."""
        averaged = max(round(self.averaged * updates / self.updates), 1)
        return replace(self, updates=updates, averaged=averaged)


@dataclass(frozen=True, eq=False)
class Experiment:
    """An experiment with people; places in the base frame [m].

    Attributes:
        name: Of the experiment.
        posture: Joint angles (7,) [rad] in which the robot starts.
        goals: Where the tool goes (3,), by name.
        targets: Where a person puts the hand who means a goal (3,), by its name.
        boxes: Centre and half the size of static obstacles (k, 2, 3).
        duration: Of the robot's motion [s].
        response: ``"press"``: a person presses a key; ``"hand"``: reaches for the target.
        table: Centre and half the size of the table (2, 3), which nothing may touch.
        avoidance: Whether potential field and null space keep clear of people and obstacles; without, only
            the filter does.
        weights: Of the costs.
        improvement: How much is tried.
    """

    name: str
    posture: FloatArray
    goals: Mapping[str, FloatArray]
    targets: Mapping[str, FloatArray]
    boxes: FloatArray
    duration: float
    response: str = "hand"
    table: FloatArray = field(default_factory=lambda: np.array(TABLE))
    avoidance: bool = True
    weights: CostWeights = field(default_factory=CostWeights)
    improvement: Improvement = field(default_factory=Improvement)

    def __post_init__(self) -> None:
        """Check what can be checked without a robot.

        Raises:
            ConfigError: naming what does not fit.
        """
        check_name("experiment", self.name)
        if len(self.goals) < 2:
            raise ConfigError(
                f"goals {shown(list(self.goals))}", expected="at least two: one alone is no riddle"
            )
        if HOME in self.goals:
            raise ConfigError(
                f"a goal is named {HOME!r}", expected="another name: that is the start's"
            )
        if not (self.solids[:, 1] > 0.0).all():
            raise ConfigError(
                "a box or the table has an edge that is not positive", expected="edges in m"
            )
        if set(self.targets) != set(self.goals):
            raise ConfigError(
                f"targets for {shown(sorted(self.targets))}",
                expected=f"for {shown(sorted(self.goals))}",
            )
        if self.response not in RESPONSES:
            raise ConfigError(f"response {shown(self.response)}", expected=" or ".join(RESPONSES))

    @property
    def solids(self) -> FloatArray:
        """Centre and half the size of all that stands in the scene, the table last (k, 2, 3) [m]."""
        return np.concatenate((self.boxes, self.table[None]))

    def check(self, robot: RobotModel) -> None:
        """Check that a robot and a person can do it.

        Raises:
            ConfigError: when a goal is in an obstacle or out of reach, the arm is in one at the start, or
                targets of the person cannot be told apart, are in an obstacle, or too near to their goal.
        """
        if not robot.within_limits(self.posture):
            raise ConfigError(
                f"posture {self.posture.tolist()}", expected="angles within the joint limits"
            )
        for name, place in self.goals.items():
            for other in list(self.goals)[: list(self.goals).index(name)]:
                if np.linalg.norm(place - self.goals[other]) < 2.0 * AT_GOAL_M:
                    raise ConfigError(
                        f"goals {other} and {name} are one place", expected="places apart"
                    )
        least = float(robot.capsule_radii[2]) + CLEAR_M
        places = {"the start": robot.frames(self.posture)[3], **self.goals}
        for name, place in places.items():
            for index, (centre, half) in enumerate(self.solids):
                obstacle = f"obstacle {index}" if index < len(self.boxes) else "the table"
                gap = float(np.linalg.norm(np.maximum(np.abs(place - centre) - half, 0.0)))
                if gap < least:
                    raise ConfigError(
                        f"{name} ({', '.join(f'{v:.3f}' for v in place)}) is {100 * gap:.1f} cm from "
                        f"{obstacle}",
                        expected=f"at least {100 * least:.1f} cm, the tool's radius and a margin",
                        hint=f"move the goal or {obstacle}",
                    )
            try:
                solve_ik(robot, np.array(place), self.posture, np.random.default_rng(0))
            except PlanningError as error:
                raise ConfigError(f"goal {name}: {error}") from error
        room = box_clearance(robot, self.posture[None], self.solids)
        if room < CLEAR_M:
            raise ConfigError(
                f"the arm is {100 * room:.1f} cm from an obstacle or the table at the start",
                expected=f"at least {100 * CLEAR_M:.1f} cm",
                hint="change the posture, or move the obstacle",
            )
        self._check_targets()

    def _check_targets(self) -> None:
        """Where the person's hand goes: apart, out of what stands there, and off the robot's tool."""
        names = list(self.targets)
        for index, name in enumerate(names):
            place = self.targets[name]
            for other in names[:index]:
                apart = float(np.linalg.norm(place - self.targets[other]))
                if self.response == "hand" and apart < TARGETS_APART_M:
                    raise ConfigError(
                        f"the targets of {other} and {name} are {100 * apart:.1f} cm apart",
                        expected=f"at least {100 * TARGETS_APART_M:.0f} cm: a hand is at one of them",
                    )
            for box, (centre, half) in enumerate(self.solids):
                if (np.abs(place - centre) < half).all():
                    solid = f"obstacle {box}" if box < len(self.boxes) else "the table"
                    raise ConfigError(
                        f"the target of {name} is within {solid}", expected="where a hand can be"
                    )
            for goal, at in self.goals.items() if self.response == "hand" else ():
                off = float(np.linalg.norm(place - at))
                if off < OFF_GOALS_M:
                    raise ConfigError(
                        f"the target of {name} is {100 * off:.1f} cm from the goal {goal}",
                        expected=f"at least {100 * OFF_GOALS_M:.0f} cm: beside a hand that rests there the "
                        "robot does not get to its goal",
                    )

    def initial_policy(self, robot: RobotModel) -> DmpPolicy:
        """Straight ways with the speed of a bell; over obstacles, raised just as far as it takes."""
        return straight_policy(robot, self.posture, self.goals, self.boxes, self.duration)

    def planner(self, config: PolicyConfig) -> PolicyConfig:
        """A planner's parameters, without field and null space where the experiment has none."""
        if self.avoidance:
            return config
        return replace(config, field_strength=0.0, link_reach=0.0)

    def with_(self, **changes: Any) -> Experiment:
        """The same with other values."""
        return replace(self, **changes)
