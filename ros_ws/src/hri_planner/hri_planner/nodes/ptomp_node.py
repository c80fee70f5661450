"""PTOMP node: replans the arm around the predicted person, one plan an interval.

Callbacks and ticks run in the executor; the optimiser runs beside it. At the start of each interval the
newest inputs are handed to the optimiser, which plans from the state that the robot will have at the end
of the interval; the plan is published before that moment, or dropped when it is late. What is done when
is decided in :mod:`hri_planner.supervision`: here messages become facts, and decisions messages.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from typing import Any

import numpy as np
from rclpy.action import CancelResponse, GoalResponse
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from trajectory_msgs.msg import JointTrajectory

from hri_planner.adaptation.origin import unfit
from hri_planner.nodes.ptomp_config import PtompNodeConfig
from hri_planner.nodes.replanning import Cycle, Failed, Replanning
from hri_planner.nodes.reporting import Reporting
from hri_planner.ptomp.config import PtompConfig
from hri_planner.ptomp.variants import find_variant
from hri_planner.robot.model import load_robot
from hri_planner.ros.action import TickedActionServer
from hri_planner.ros.bodies import Bodies
from hri_planner.ros.conversions import joints_from_message, trajectory_message
from hri_planner.ros.goals import target_of
from hri_planner.ros.inputs import NOBODY, Inputs
from hri_planner.ros.status import result_message
from hri_planner.supervision.decision import (
    Decision,
    Ending,
    Goal,
    Interval,
    Outcome,
    ReadyPlan,
    Seen,
    Verdict,
)
from hri_planner.supervision.freshness import problem
from hri_planner.supervision.supervisor import Supervisor
from hri_planner.warm import warm_kernels
from hri_prediction.errors import DataError, PlanningError
from hri_prediction.ros.messages import ControllerState, IdsList, ReachTarget
from hri_prediction.ros.node import OK, WARN, HriNode, run_node
from hri_prediction.ros.parameters import declare_config
from hri_prediction.ros.qos import LATCHED, SENSOR, reliable
from hri_prediction.ros.time import to_ns

TICK_S = 0.004


class PtompNode(HriNode):
    """Serves ``/ptomp/reach_target`` and keeps the robot clear of people while it moves."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("ptomp", period_s=TICK_S, **kwargs)
        self._config = config = declare_config(self, PtompNodeConfig)
        planner = declare_config(
            self, PtompConfig, prefix="planner", defaults=find_variant(config.variant).config
        )
        self._robot = load_robot()
        self._limits = config.limits
        self._supervisor = Supervisor(
            config.rules(lockstep=self.lockstep, plans_once=not planner.interleaved), self._limits
        )
        self._inputs = Inputs(radii=config.radii)
        self.replanning = Replanning(
            self._robot,
            config,
            planner,
            self._inputs,
            tick_s=TICK_S,
            lockstep=self.lockstep,
            now_ns=self.now_ns,
        )
        if config.adaptation_model and (why := unfit(config.adaptation_model, config.variant)):
            self.get_logger().warning(f"{why}: it is used all the same")
        self._handover = self.replanning.handover
        self._handles: dict[int, Any] = {}
        self._last: Cycle | None = None
        warm_kernels()

        self._trajectory = self.announce(
            JointTrajectory, "joint_trajectory_controller/joint_trajectory", reliable(1)
        )
        self._speed_scale = self.announce(Float64, "separation/speed_scale", reliable(1))
        self._reporting = Reporting(self, self._robot, self._inputs, config.default_duration)
        self.listen(JointState, "joint_states", self._on_joints, SENSOR)
        self.listen(
            ControllerState, "joint_trajectory_controller/reference", self._on_reference, SENSOR
        )
        self.listen(IdsList, "humans/bodies/tracked", Bodies(self, self._inputs).take, LATCHED)
        self._action = TickedActionServer(
            self,
            ReachTarget,
            "ptomp/reach_target",
            goal_callback=lambda _: GoalResponse.ACCEPT,
            handle_accepted_callback=self._on_goal,
            cancel_callback=self._on_cancel,
        )

    def close(self) -> None:
        """End the optimiser's thread."""
        self.replanning.worker.close()
        self._action.destroy()

    # ------------------------------------------------------------------ what is heard
    def _on_joints(self, message: JointState) -> None:
        try:
            self._inputs.q, self._inputs.qd = joints_from_message(message, self._robot.joint_names)
        except DataError as error:
            self.fault("joints", str(error))
            return
        self._inputs.joints_ns = to_ns(message.header.stamp)

    def _on_reference(self, message: ControllerState) -> None:
        try:
            self._inputs.take_reference(message, self._robot.joint_names)
        except DataError as error:
            self.fault("reference", str(error))

    def _on_goal(self, handle: Any) -> None:
        """Make an accepted goal the present motion; a malformed one ends at once."""
        now_ns, request = self.now_ns(), handle.request
        handle.execute()
        try:
            target = target_of(request, self._config.targets)
        except PlanningError as error:
            number, decision = self._supervisor.refuse(str(error), now_ns)
        else:
            goal = Goal(target, request.duration or self._config.default_duration)
            number, decision = self._supervisor.accept(goal, now_ns)
        self._handles[number] = handle
        self._carry_out(now_ns, decision)

    def _on_cancel(self, handle: Any) -> CancelResponse:
        motion = self._supervisor.motion
        if motion is None or self._handles[motion.number].goal_id != handle.goal_id:
            return CancelResponse.REJECT
        known = self._supervisor.cancel(motion.number)
        return CancelResponse.ACCEPT if known else CancelResponse.REJECT

    # ------------------------------------------------------------------ tick
    def on_tick(self, now_ns: int) -> None:
        """Publish the plan that is ready, begin the next one, supply the heartbeat, end the motion."""
        supervisor = self._supervisor
        if supervisor.clock_went_back(now_ns):
            self._inputs.forget()
            self._reporting.restart(now_ns)
            self._carry_out(now_ns, supervisor.restart(now_ns))
        self._collect(now_ns)
        if supervisor.active:
            self._carry_out(now_ns, supervisor.tick(self._see(now_ns)))
        if supervisor.heartbeat_due(now_ns):
            self._speed_scale.publish(Float64(data=supervisor.scale))
        motion = supervisor.motion
        if motion is not None and motion.goal is not None and supervisor.feedback_due(now_ns):
            self._handles[motion.number].publish_feedback(
                ReachTarget.Feedback(
                    distance_to_goal=self._reporting.distance(motion.goal.target),
                    min_separation=min(motion.min_separation, NOBODY),
                    stage=supervisor.stage.name.lower(),
                )
            )

    def _see(self, now_ns: int) -> Seen:
        motion, last = self._supervisor.motion, self._last
        seen = Seen(
            now_ns,
            self._inputs.heard(),
            speed=float(np.abs(self._inputs.qd).max()),
            separation=self._inputs.separation(self._robot),
            busy=self.replanning.worker.busy,
        )
        if motion is None or motion.goal is None:
            return seen
        time_s = self._handover.plan_time_s(now_ns)
        return replace(
            seen,
            distance=self._reporting.distance(motion.goal.target),
            plan_over=last is not None and last.is_over_for(motion.number, time_s),
            on_plan=not motion.started and self._handover.follows_a_plan,
        )

    def _carry_out(self, now_ns: int, decision: Decision) -> None:
        for kind, text in decision.faults:
            self.fault(kind, text)
        if decision.drop:
            # Stop along the present path: an empty trajectory, as for joint_trajectory_controller.
            names = list(self._robot.joint_names)
            self._trajectory.publish(JointTrajectory(joint_names=names))
            self._handover.forget()
        for ending in decision.endings:
            self._end(ending)
        for report in decision.reports:
            self._reporting.say(now_ns, report, self._duration_s())
        if decision.interval is not None:
            self._begin(now_ns, decision.interval)

    def _end(self, ending: Ending) -> None:
        handle = self._handles.pop(ending.number)
        self.replanning.abandon(ending.number)
        error = 0.0 if ending.target is None else self._reporting.distance(ending.target)
        if ending.outcome == Outcome.REACHED:
            handle.succeed()
        elif ending.outcome == Outcome.CANCELLED and handle.is_cancel_requested:
            handle.canceled()
        else:
            handle.abort()
        self._action.send_result(handle, result_message(ending, error))
        self.get_logger().info(f"motion {ending.number}: {ending.reason}")

    # ------------------------------------------------------------------ plans
    def _begin(self, now_ns: int, interval: Interval) -> None:
        supervisor = self._supervisor
        if interval.start is not None:
            seen = self._see(now_ns)
            try:
                self.replanning.start(interval.start, interval.handover_ns)
            except PlanningError as error:
                self._carry_out(now_ns, supervisor.unreachable(str(error), seen))
                return
            supervisor.begun(interval)
        try:
            if not self.replanning.submit(interval):
                supervisor.out_of_time(interval.number)
        except (DataError, PlanningError) as error:
            self._carry_out(now_ns, supervisor.failed(interval.number, str(error)))
            return
        if self.lockstep:
            self._collect(now_ns)

    def _collect(self, now_ns: int) -> None:
        """Publish the plan that has become ready, unless it is late."""
        made = self.replanning.take(now_ns)
        if made is None:
            return
        if isinstance(made, Failed):
            self._carry_out(now_ns, self._supervisor.failed(made.number, made.text))
            return
        result, handover_ns = made.result, made.interval.handover_ns
        plan = made.ready(self._handover.due_ns(handover_ns, made.joint, result.plan.q[0]))
        verdict = self._supervisor.judge(plan, now_ns)
        if verdict == Verdict.FORGET:
            return
        self._reporting.made(made, now_ns)
        if verdict == Verdict.DROP or plan.due_ns is None:
            self.replanning.planner.restore(made.before)
            return
        self._last = made
        self._publish(now_ns, plan, made, plan.due_ns)

    def _publish(self, now_ns: int, plan: ReadyPlan, cycle: Cycle, due_ns: int) -> None:
        joints = cycle.result.plan
        self._handover.sent(due_ns, cycle.before, cycle.result)
        self._trajectory.publish(trajectory_message(joints, self._robot.joint_names, due_ns))
        report = self._supervisor.published(plan, now_ns)
        self._reporting.say_plan(
            now_ns,
            report,
            self._duration_s(),
            cycle,
            due_ns=due_ns,
            due_s=self._handover.plan_time_s(plan.handover_ns),
        )

    def _duration_s(self) -> float | None:
        motion = self._supervisor.motion
        return None if motion is None or motion.goal is None else motion.goal.duration_s

    def health(self) -> tuple[bytes, str, dict[str, Any]]:
        """Timing of the replans, misses, what is wrong with the inputs."""
        intervals, size = self._supervisor.intervals, self.replanning.planner.config
        figures: dict[str, Any] = {
            "num_timesteps": size.num_timesteps,
            "num_rollouts": size.num_rollouts,
            "plans": intervals.plans,
            "deadline_misses": intervals.misses,
            "failed_replans": intervals.failures,
            "plans_off_path": self._handover.off_path,
            "plans_not_followed": self._handover.not_followed,
            **self._reporting.figures(),
        }
        trouble = problem(self._inputs.heard(), self._limits, self.now_ns())
        if trouble:
            return WARN, trouble, figures
        return OK, self._supervisor.stage.name.lower(), figures


def main(args: list[str] | None = None) -> int:
    """Entry point."""
    # Optimiser and executor share the interpreter: hand it over often, or callbacks wait 5 ms for it.
    sys.setswitchinterval(5e-4)
    return run_node(PtompNode, args)
