"""Replans: from an interval to a plan, beside the executor."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from hri_planner.adaptation.model_file import find_model
from hri_planner.adaptation.online import OnlineAdaptation
from hri_planner.nodes.motions import Failed, MadePlan
from hri_planner.nodes.ptomp_config import PtompNodeConfig
from hri_planner.ptomp.budget import ADAPTATION_S, START_S, VirtualTimeBudget, replan_charge
from hri_planner.ptomp.config import PtompConfig
from hri_planner.ptomp.costs import TableBox
from hri_planner.ptomp.planner import PlannerSnapshot, PtompPlanner
from hri_planner.ptomp.result import ReplanResult
from hri_planner.robot.model import RobotModel
from hri_planner.ros.handover import Handover
from hri_planner.ros.inputs import Inputs
from hri_planner.ros.worker import Worker
from hri_planner.supervision.decision import Goal, Interval, ReadyPlan
from hri_prediction.errors import DataError, PlanningError
from hri_prediction.ros.time import NANO, seconds_to_ns

FloatArray = NDArray[np.float64]


class Cycle(MadePlan[PlannerSnapshot, ReplanResult]):
    """What one replan was made from and for."""

    def ready(self, due_ns: int | None) -> ReadyPlan:
        """The plan, when its first point is due [ns]; none: the robot will not be there."""
        return ReadyPlan(
            self.interval.number,
            self.interval.handover_ns,
            due_ns,
            waits=self.result.stage == "waiting",
            reason=self.result.reason,
            costs=self.result.cost_terms,
        )

    def is_over_for(self, number: int, plan_time_s: float) -> bool:
        """Whether it is the plan that has brought the tool to the goal of a motion by that time [s]."""
        if self.interval.number != number:
            return False
        if self.result.stage == "holding":
            return True
        return self.result.stage == "reaching" and plan_time_s >= self.result.plan.end_s - 1e-9


class Replanning:
    """The planner, the thread that it runs in, and the hand-over of its plans.

    Args:
        robot: The robot.
        config: Of the node.
        planner_config: Of the planner.
        inputs: What the node has heard.
        tick_s: Period of the node's tick [s].
        lockstep: Whether plans are made at once, with a budget of virtual time.
        now_ns: The node's clock.

    Raises:
        ConfigError: when the adaptation model is one that does not ship.
        DataError: when its file is unusable.
    """

    def __init__(
        self,
        robot: RobotModel,
        config: PtompNodeConfig,
        planner_config: PtompConfig,
        inputs: Inputs,
        *,
        tick_s: float,
        lockstep: bool,
        now_ns: Callable[[], int],
    ) -> None:
        self._config = config
        self._inputs = inputs
        self._lockstep = lockstep
        self._now_ns = now_ns
        self._robot = robot
        table = TableBox(*config.table) if config.table_center else None
        rng = np.random.default_rng(config.seed)
        self._adaptation: OnlineAdaptation | None = None
        if config.adaptation_model:
            selection = find_model(config.adaptation_model)
            self._adaptation = OnlineAdaptation(selection, robot, planner_config, rng, table)
        arrival_s = 0.0 if lockstep else config.compute_share * config.replan_interval + tick_s
        self.handover = Handover(
            PtompPlanner(robot, planner_config, rng, table=table),
            inputs,
            arrival_ns=seconds_to_ns(arrival_s),
            interval_ns=seconds_to_ns(config.replan_interval),
            lockstep=lockstep,
            now_ns=now_ns,
        )
        self.worker: Worker[Cycle | Failed] = Worker("ptomp optimiser", inline=lockstep)
        self._budget = VirtualTimeBudget(config.slowdown)
        self._take_from_ns = 0
        self._abandoned = 0

    @property
    def planner(self) -> PtompPlanner:
        """That of the present motion: with adaptation, each motion may have another."""
        return self.handover.planner

    def start(self, goal: Goal, handover_ns: int) -> None:
        """Set the planner on a new goal, from rest or in flight.

        Raises:
            PlanningError: when there is no way to the goal.
        """
        state = self.handover.state_at(handover_ns)
        q, qd = self._inputs.state if state is None else state[:2]
        if self._adaptation is None:
            self.planner.start(q, qd, goal.target, goal.duration_s, 0.0)
        else:
            inputs = self._inputs
            self.handover.planner = self._adaptation.start(
                self.planner,
                (q, qd),
                goal.target,
                goal.duration_s,
                inputs.forecasts(handover_ns),
                uncertainties=inputs.uncertainties,
                errors=inputs.errors,
                distance=inputs.separation(self._robot),
            )
        self.handover.begin(handover_ns)

    def submit(self, interval: Interval) -> bool:
        """Begin a replan with the newest inputs; :meth:`take` brings what comes of it.

        Returns:
            Whether it has begun: in lock-step, what has been saved up may not pay for a replan yet.

        Raises:
            DataError: when the inputs cannot be used.
            PlanningError: when the planner cannot go on from where the robot will be.
        """
        handover_ns = interval.handover_ns
        handover_s = self.handover.plan_time_s(handover_ns)
        joint = self.handover.align(handover_ns)
        forecasts = self._inputs.forecasts(self.handover.origin_ns)
        newest_ns = self._inputs.newest_sample_ns()
        interval_ns = seconds_to_ns(self._config.replan_interval)
        self._take_from_ns = handover_ns - interval_ns if interval.ahead else interval.begin_ns
        deadline: Callable[[], bool] | None = None
        iterations: int | None
        if self._lockstep:
            iterations = self._granted(interval, handover_s)
            if iterations is None:
                return False
        else:
            # A plan that is made ahead may take the steps of all the replans that others make.
            replans = max(round((handover_ns - interval.begin_ns) / interval_ns), 1)
            iterations = self.planner.config.iterations * replans
            end_ns = handover_ns - round((1.0 - self._config.compute_share) * interval_ns)

            def deadline() -> bool:
                # The ROS clock, so that the share is kept when /clock runs fast or slow.
                unwanted = interval.ahead and interval.number <= self._abandoned
                return unwanted or self._now_ns() >= end_ns

        def job() -> Cycle | Failed:
            start = time.monotonic()
            before = self.planner.snapshot()
            try:
                result = self.planner.replan(
                    handover_s, forecasts, iterations=iterations, deadline=deadline
                )
            except (DataError, PlanningError) as error:
                self.planner.restore(before)
                return Failed(interval.number, str(error))
            spent_s = time.monotonic() - start
            return Cycle(interval, newest_ns, joint, before, result, spent_s)

        self.worker.submit(job)
        return True

    def take(self, now_ns: int) -> Cycle | Failed | None:
        """What has come of the last replan, once; one made ahead when the robot is about to set off."""
        return self.worker.take() if now_ns >= self._take_from_ns else None

    def abandon(self, number: int) -> None:
        """A motion is over: what is still planned ahead for it need not be finished."""
        self._abandoned = max(self._abandoned, number)

    def _granted(self, interval: Interval, handover_s: float) -> int | None:
        """Iterations of a replan in virtual time, charged as in the benchmark; none: not yet.

        An interval's whole time counts, and what is left over is kept for the next.
        """
        config = self.planner.config
        if not config.interleaved and not interval.ahead:
            return 0  # it has planned already
        charge_s = replan_charge(config)
        if interval.start is not None:
            charge_s += START_S + (ADAPTATION_S if self._adaptation is not None else 0.0)
        return self._budget.grant(
            (interval.handover_ns - interval.begin_ns) / NANO,
            config.num_rollouts,
            self.planner.free_steps(handover_s),
            charge_s,
        )
