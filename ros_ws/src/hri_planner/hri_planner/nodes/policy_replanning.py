"""Cycles of a policy: from the newest inputs to a short plan, beside the executor."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from hri_planner.nodes.motions import Failed, MadePlan
from hri_planner.nodes.policy_config import PolicyNodeConfig
from hri_planner.policy.config import PolicyConfig
from hri_planner.policy.planner import AnyPolicy, Cycle, PolicyPlanner, PolicySnapshot, floor_over
from hri_planner.robot.model import RobotModel
from hri_planner.ros.arms import ArmInputs
from hri_planner.ros.handover import Handover
from hri_planner.ros.worker import Worker
from hri_planner.supervision.decision import Goal, Interval, ReadyPlan
from hri_prediction.errors import DataError, PlanningError
from hri_prediction.ros.time import seconds_to_ns

FloatArray = NDArray[np.float64]

_SHARE = 0.8
"""Of the goal's tolerance, within which the hand counts as there."""


class PolicyCycle(MadePlan[PolicySnapshot, Cycle]):
    """What one cycle was made from and for."""

    def ready(self, due_ns: int | None) -> ReadyPlan:
        """The plan, when its first point is due [ns]; none: the robot will not be there."""
        return ReadyPlan(
            self.interval.number, self.interval.handover_ns, due_ns, reason=self.result.reason
        )

    def is_over_for(self, number: int, plan_time_s: float) -> bool:
        """Whether by it the hand rests at the goal of a motion."""
        return self.interval.number == number and self.result.stage == "holding"


class PolicyReplanning:
    """The policy, the thread that it runs in, and the hand-over of its plans.

    Args:
        robot: The robot.
        model: The policy.
        config: Of the node.
        policy_config: Of the planner.
        inputs: What the node has heard.
        tick_s: Period of the node's tick [s].
        lockstep: Whether plans are made at once.
        now_ns: The node's clock.
    """

    def __init__(
        self,
        robot: RobotModel,
        model: AnyPolicy,
        config: PolicyNodeConfig,
        policy_config: PolicyConfig,
        inputs: ArmInputs,
        *,
        tick_s: float,
        lockstep: bool,
        now_ns: Callable[[], int],
    ) -> None:
        floor = None
        if config.table_center:
            center, size = config.table
            floor = floor_over(
                np.array((center, 0.5 * np.array(size))), robot, policy_config.table_margin
            )
        self._config = config
        self._inputs = inputs
        self._goal: FloatArray | None = None
        self.handover = Handover(
            PolicyPlanner(
                robot,
                model,
                policy_config,
                np.random.default_rng(0),
                floor=floor,
                boxes=config.boxes,
                limb_radii=config.radii.tolist(),
                # The tool follows the hand, and is to be within the whole of it.
                arrived=_SHARE * config.goal_tolerance,
            ),
            inputs,
            arrival_ns=0 if lockstep else 2 * seconds_to_ns(tick_s),
            interval_ns=seconds_to_ns(config.replan_interval),
            lockstep=lockstep,
            now_ns=now_ns,
        )
        self.worker: Worker[PolicyCycle | Failed] = Worker("policy", inline=lockstep)

    @property
    def planner(self) -> PolicyPlanner:
        """Of all motions."""
        return self.handover.planner

    def start(self, goal: Goal, handover_ns: int) -> None:
        """Set the policy on a new goal, from rest or in flight.

        Raises:
            PlanningError: when there is no way to the goal.
        """
        state = self.handover.state_at(handover_ns)
        q, qd = self._inputs.state if state is None else state[:2]
        self.planner.start(q, qd, goal.target, 0.0, goal.duration_s)
        self._goal = None
        self.handover.begin(handover_ns)

    def retarget(self, target: FloatArray) -> None:
        """The goal is elsewhere (3,) [m] from the next cycle on.

        Raises:
            PlanningError: when that is no place for a goal.
        """
        self.planner.check(target, self._inputs.q)
        self._goal = target

    def submit(self, interval: Interval) -> bool:
        """Begin a cycle with the newest inputs; :meth:`take` brings what comes of it.

        Raises:
            PlanningError: when the planner cannot go on from where the robot will be.
        """
        handover_ns = interval.handover_ns
        handover_s = self.handover.plan_time_s(handover_ns)
        joint = self.handover.align(handover_ns)
        if self._goal is not None:
            self.planner.retarget(self._goal)
            self._goal = None
        partners = self._inputs.partners(handover_ns)
        newest_ns = self._inputs.newest_sample_ns()
        horizon_s = self._config.horizon

        def job() -> PolicyCycle | Failed:
            start = time.monotonic()
            before = self.planner.snapshot()
            try:
                result = self.planner.replan(handover_s, partners, horizon_s)
            except (DataError, PlanningError) as error:
                self.planner.restore(before)
                return Failed(interval.number, str(error))
            return PolicyCycle(interval, newest_ns, joint, before, result, time.monotonic() - start)

        self.worker.submit(job)
        return True

    def take(self, now_ns: int) -> PolicyCycle | Failed | None:
        """What has come of the last cycle, once."""
        return self.worker.take()

    def abandon(self, number: int) -> None:
        """A motion is over; nothing is planned ahead for it."""
