"""What all nodes have in common that move the robot: goals, intervals, plans, heartbeat.

Callbacks and ticks run in the executor; plans are made beside it. At the start of each interval the
newest inputs are handed over, and a plan is made from the state that the robot will have at the end of
the interval; the plan is published before that moment, or dropped when it is late. What is done when is
decided in :mod:`hri_planner.supervision`: here messages become facts, and decisions messages.
"""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import replace
from typing import Any

import numpy as np
from rclpy.action import CancelResponse, GoalResponse
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import JointTrajectory

from hri_planner.nodes.motion_config import MotionConfig
from hri_planner.nodes.motions import Failed, MadePlan, Replans, Reports
from hri_planner.robot.model import RobotModel, load_robot
from hri_planner.ros.action import TickedActionServer
from hri_planner.ros.authority import Authority
from hri_planner.ros.conversions import joints_from_message, trajectory_message
from hri_planner.ros.goals import target_of
from hri_planner.ros.heartbeat import Heartbeat
from hri_planner.ros.inputs import NOBODY, RobotInputs
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
from hri_prediction.errors import DataError, PlanningError
from hri_prediction.ros.messages import ControllerState, ReachTarget
from hri_prediction.ros.node import OK, WARN, HriNode
from hri_prediction.ros.qos import SENSOR, reliable
from hri_prediction.ros.time import to_ns

TICK_S = 0.004


class MotionNode(HriNode):
    """Serves ``/<name>/reach_target`` and leads the robot by plans.

    Derived nodes call :meth:`serve_motions` at the end of their constructor.

    Args:
        name: Of the node, and of its topics.
    """

    def __init__(self, name: str, **kwargs: Any) -> None:
        super().__init__(name, period_s=TICK_S, **kwargs)
        self._name = name
        self._robot: RobotModel = load_robot()
        self._handles: dict[int, Any] = {}
        self._last: MadePlan[Any, Any] | None = None

    def serve_motions(
        self,
        config: MotionConfig,
        inputs: RobotInputs,
        replanning: Replans,
        reporting: Reports,
        *,
        plans_once: bool = False,
    ) -> None:
        """Listen to the robot, and offer the action.

        Args:
            config: Of the node.
            inputs: Where messages go.
            replanning: Makes the plans.
            reporting: Says what the node does.
            plans_once: Whether there is one plan for all of a motion.
        """
        # As in the code, not as the node may have been renamed: topics keep their names then.
        name, self._motion_config, self.targets_by_name = self._name, config, config.targets
        self._heard, self._replans, self._reports = inputs, replanning, reporting
        self._supervisor = Supervisor(
            config.rules(lockstep=self.lockstep, plans_once=plans_once), config.limits
        )
        self._handover = replanning.handover
        self._authority = Authority(self, name)
        self._trajectory = self.announce(
            JointTrajectory, "joint_trajectory_controller/joint_trajectory", reliable(1)
        )
        self._heartbeat = Heartbeat(self, wanted=config.heartbeat)
        self.listen(JointState, "joint_states", self._on_joints, SENSOR)
        self.listen(
            ControllerState, "joint_trajectory_controller/reference", self._on_reference, SENSOR
        )
        self._action = TickedActionServer(
            self,
            ReachTarget,
            f"{name}/reach_target",
            goal_callback=lambda _: GoalResponse.ACCEPT,
            handle_accepted_callback=self._on_goal,
            cancel_callback=self._on_cancel,
        )

    def close(self) -> None:
        """End the thread that plans."""
        self._replans.worker.close()
        self._action.destroy()

    @abstractmethod
    def duration_of(self, request: ReachTarget.Goal) -> float:
        """How long a motion is to take [s]."""

    # ------------------------------------------------------------------ what is heard
    def _on_joints(self, message: JointState) -> None:
        try:
            self._heard.q, self._heard.qd = joints_from_message(message, self._robot.joint_names)
        except DataError as error:
            self.fault("joints", str(error))
            return
        self._heard.joints_ns = to_ns(message.header.stamp)

    def _on_reference(self, message: ControllerState) -> None:
        try:
            self._heard.take_reference(message, self._robot.joint_names)
        except DataError as error:
            self.fault("reference", str(error))

    def _on_goal(self, handle: Any) -> None:
        """Make an accepted goal the present motion; a malformed one ends at once."""
        now_ns, request = self.now_ns(), handle.request
        handle.execute()
        try:
            target = target_of(request, self.targets_by_name)
            self._authority.check(now_ns)
        except PlanningError as error:
            number, decision = self._supervisor.refuse(str(error), now_ns)
        else:
            goal = Goal(target, self.duration_of(request))
            number, decision = self._supervisor.accept(goal, now_ns)
        self._handles[number] = handle
        self._carry_out(now_ns, decision)
        if self._supervisor.motion is not None:
            # Others that hold the robot at a goal of theirs hear it, and let go.
            self._reports.say(now_ns, self._supervisor.begins(), self._duration_s())

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
            self._heard.forget()
            self._reports.restart(now_ns)
            self._carry_out(now_ns, supervisor.restart(now_ns))
        other = self._authority.holder(now_ns)
        if other and supervisor.motion is not None and self._authority.is_first:
            other = ""  # both have begun at once: the other gives way
        if other and supervisor.active:
            self._carry_out(now_ns, supervisor.give_way(f"{other} moves the robot", now_ns))
        self._collect(now_ns)
        if supervisor.active:
            self._carry_out(now_ns, supervisor.tick(self._see(now_ns)))
        # One heartbeat at a time: that of the node which moves the robot, or holds it.
        mine = not other and (supervisor.active or not self._authority.engaged(now_ns))
        if supervisor.heartbeat_due(now_ns) and mine:
            self._heartbeat.say(supervisor.scale)
        motion = supervisor.motion
        if motion is not None and motion.goal is not None and supervisor.feedback_due(now_ns):
            self._handles[motion.number].publish_feedback(
                ReachTarget.Feedback(
                    distance_to_goal=self._reports.distance(motion.goal.target),
                    min_separation=min(motion.min_separation, NOBODY),
                    stage=supervisor.stage.name.lower(),
                )
            )

    def _see(self, now_ns: int) -> Seen:
        motion, last = self._supervisor.motion, self._last
        seen = Seen(
            now_ns,
            self._heard.heard(now_ns),
            speed=float(np.abs(self._heard.qd).max()),
            separation=self._heard.separation(self._robot),
            busy=self._replans.worker.busy,
        )
        if motion is None or motion.goal is None:
            return seen
        time_s = self._handover.plan_time_s(now_ns)
        return replace(
            seen,
            distance=self._reports.distance(motion.goal.target),
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
            self._reports.say(now_ns, report, self._duration_s())
        if decision.interval is not None:
            self._begin(now_ns, decision.interval)

    def _end(self, ending: Ending) -> None:
        handle = self._handles.pop(ending.number)
        self._replans.abandon(ending.number)
        error = 0.0 if ending.target is None else self._reports.distance(ending.target)
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
        # What has become ready since this tick looked would be lost.
        self._collect(now_ns)
        if interval.start is not None:
            seen = self._see(now_ns)
            try:
                self._replans.start(interval.start, interval.handover_ns)
            except PlanningError as error:
                self._carry_out(now_ns, supervisor.unreachable(str(error), seen))
                return
            supervisor.begun(interval)
        try:
            if not self._replans.submit(interval):
                supervisor.out_of_time(interval.number)
        except (DataError, PlanningError) as error:
            self._carry_out(now_ns, supervisor.failed(interval.number, str(error)))
            return
        if self.lockstep:
            self._collect(now_ns)

    def _collect(self, now_ns: int) -> None:
        """Publish the plan that has become ready, unless it is late."""
        made = self._replans.take(now_ns)
        if made is None:
            return
        if isinstance(made, Failed):
            self._carry_out(now_ns, self._supervisor.failed(made.number, made.text))
            return
        handover_ns = made.interval.handover_ns
        plan = made.ready(self._handover.due_ns(handover_ns, made.joint, made.plan.q[0]))
        verdict = self._supervisor.judge(plan, now_ns)
        if verdict == Verdict.FORGET:
            return
        self._reports.made(made, now_ns)
        if verdict == Verdict.DROP or plan.due_ns is None:
            self._handover.planner.restore(made.before)
            return
        self._last = made
        self._publish(now_ns, plan, made, plan.due_ns)

    def _publish(self, now_ns: int, plan: ReadyPlan, made: MadePlan[Any, Any], due_ns: int) -> None:
        self._handover.sent(due_ns, made.before.plan, made.plan)
        self._trajectory.publish(trajectory_message(made.plan, self._robot.joint_names, due_ns))
        report = self._supervisor.published(plan, now_ns)
        self._reports.say_plan(
            now_ns,
            report,
            self._duration_s(),
            made,
            due_ns=due_ns,
            due_s=self._handover.plan_time_s(plan.handover_ns),
        )

    def _duration_s(self) -> float | None:
        motion = self._supervisor.motion
        return None if motion is None or motion.goal is None else motion.goal.duration_s

    def health(self) -> tuple[bytes, str, dict[str, Any]]:
        """Timing of the replans, misses, what is wrong with the inputs."""
        intervals = self._supervisor.intervals
        figures: dict[str, Any] = {
            "plans": intervals.plans,
            "deadline_misses": intervals.misses,
            "failed_replans": intervals.failures,
            "plans_off_path": self._handover.off_path,
            "plans_not_followed": self._handover.not_followed,
            **self._reports.figures(),
        }
        limits, now_ns = self._motion_config.limits, self.now_ns()
        trouble = self._heartbeat.trouble() or problem(self._heard.heard(now_ns), limits, now_ns)
        if trouble:
            return WARN, trouble, figures
        return OK, self._supervisor.stage.name.lower(), figures
