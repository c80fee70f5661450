"""PTOMP node: replans the arm around the predicted person, one plan an interval.

Callbacks and ticks run in the executor; the optimiser runs beside it. At the start of each interval the
newest inputs are handed to the optimiser, which plans from the state that the robot will have at the end
of the interval; the plan is published before that moment, or dropped when it is late.
"""

from __future__ import annotations

import sys
import time
from collections import deque
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rclpy.action import CancelResponse, GoalResponse
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64, Header
from trajectory_msgs.msg import JointTrajectory
from visualization_msgs.msg import MarkerArray

from hri_planner.nodes.motion import Cycle, Motion, held_up
from hri_planner.nodes.ptomp_config import PtompNodeConfig
from hri_planner.ptomp.budget import VirtualTimeBudget
from hri_planner.ptomp.config import PtompConfig, load_default_config
from hri_planner.ptomp.costs import TableBox
from hri_planner.ptomp.planner import PtompPlanner
from hri_planner.robot.model import load_robot
from hri_planner.ros.action import TickedActionServer
from hri_planner.ros.bodies import Bodies
from hri_planner.ros.conversions import joints_from_message, trajectory_message
from hri_planner.ros.goals import target_of
from hri_planner.ros.handover import STANDING_RATE, Handover
from hri_planner.ros.inputs import Inputs
from hri_planner.ros.markers import plan_markers
from hri_planner.ros.status import describe_plan, percentile_figures
from hri_planner.ros.worker import Worker
from hri_planner.warm import warm_kernels
from hri_prediction.errors import DataError, PlanningError
from hri_prediction.ros.conversions import WORLD
from hri_prediction.ros.messages import ControllerState, IdsList, PlannerStatus, ReachTarget
from hri_prediction.ros.node import OK, WARN, HriNode, run_node
from hri_prediction.ros.parameters import declare_config
from hri_prediction.ros.qos import LATCHED, SENSOR, reliable
from hri_prediction.ros.time import NANO, seconds_to_ns, to_ns, to_time

FloatArray = NDArray[np.float64]

TICK_S = 0.004
TRANSPORT_NS = 5_000_000
"""A plan must be ready so long before its hand-over to reach the controller in time [ns]."""
HEARTBEAT_NS = 20_000_000
FEEDBACK_NS = 100_000_000
STOPPED_RATE = 0.7
"""A stop that has slowed the robot below this share of full speed ends at rest."""
SETTLE_NS = 100_000_000
"""How long a new motion waits for the controller to come to rest by itself [ns]."""
CLOCK_STEP_NS = 100_000_000
"""A clock that goes back by more than this starts the node anew; less is a clock being set [ns]."""
_STAGE_NAMES = {
    PlannerStatus.IDLE: "idle",
    PlannerStatus.MOVING: "moving",
    PlannerStatus.WAITING: "waiting",
    PlannerStatus.STOPPING: "stopping",
    PlannerStatus.HOLDING: "holding",
}


def _slowed(reference: ControllerState) -> bool:
    """Whether the controller follows a path and has been slowed a lot, yet does not stand."""
    active = reference.state != ControllerState.IDLE
    return active and STANDING_RATE < reference.speed_scale < STOPPED_RATE


class PtompNode(HriNode):
    """Serves ``/ptomp/reach_target`` and keeps the robot clear of people while it moves."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("ptomp", period_s=TICK_S, **kwargs)
        self._config = declare_config(self, PtompNodeConfig)
        self._planner_config = declare_config(
            self, PtompConfig, prefix="planner", defaults=load_default_config()
        )
        config = self._config
        self._robot = load_robot()
        self._targets = dict(
            zip(
                config.target_names,
                np.reshape(config.target_positions, (-1, 3)),
                strict=True,
            )
        )
        table = TableBox(*config.table) if config.table_center else None
        self._planner = PtompPlanner(
            self._robot, self._planner_config, np.random.default_rng(config.seed), table=table
        )
        radii = np.array([config.radius_upper_arm, config.radius_forearm, config.radius_hand])
        self._inputs = Inputs(
            max_joint_age_s=config.max_joint_age,
            max_sample_age_s=config.max_sample_age,
            require_tracking=config.require_tracking,
            radii=radii,
        )
        self._interval_ns = seconds_to_ns(config.replan_interval)
        self._budget = VirtualTimeBudget(config.slowdown)
        self._worker: Worker[Cycle] = Worker("ptomp optimiser", inline=self.lockstep)
        self._motion: Motion | None = None
        self._holding = False
        self._dropped_ns: int | None = None
        self._motions = 0
        self._next_cycle_ns = 0
        self._last_plan_ns = 0
        self._last_tick_ns = 0
        arrival = 0 if self.lockstep else config.compute_share * config.replan_interval + TICK_S
        self._handover = Handover(
            self._planner,
            self._inputs,
            arrival_ns=seconds_to_ns(arrival),
            interval_ns=self._interval_ns,
            lockstep=self.lockstep,
            now_ns=self.now_ns,
        )
        self._last: Cycle | None = None
        self._stage = PlannerStatus.IDLE
        self._reason = ""
        self._scale = 1.0
        self._next_heartbeat_ns = 0
        self._next_feedback_ns = 0
        self._next_markers_ns = 0
        self._next_pause_ns = 0
        self._compute_ms: deque[float] = deque(maxlen=1000)
        self._late_ms: deque[float] = deque(maxlen=1000)
        self._plans = 0
        self._misses = 0
        self._failures = 0
        self._overdue = False
        self._failure = ""
        warm_kernels()

        self._trajectory = self.announce(
            JointTrajectory, "joint_trajectory_controller/joint_trajectory", reliable(1)
        )
        self._speed_scale = self.announce(Float64, "separation/speed_scale", reliable(1))
        self._status = self.announce(PlannerStatus, "ptomp/status", reliable(10))
        self._markers = self.announce(MarkerArray, "ptomp/markers", reliable(1))
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
        self._worker.close()
        self._action.destroy()

    # ------------------------------------------------------------------ inputs
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

    # ------------------------------------------------------------------ goals
    def _on_goal(self, handle: Any) -> None:
        """Make an accepted goal the present motion; a malformed one ends at once."""
        goal = handle.request
        self._motions += 1
        motion = Motion(handle, np.zeros(3), 0.0, self.now_ns(), self._motions)
        handle.execute()
        try:
            motion.target = target_of(goal, self._targets)
            motion.duration_s = goal.duration or self._config.default_duration
        except PlanningError as error:
            self._end(motion, ReachTarget.Result.REJECTED, str(error))
        else:
            if self._motion is not None:
                self._end(self._motion, ReachTarget.Result.PREEMPTED, "a newer goal took over")
            self._motion = motion

    def _end(self, motion: Motion, outcome: int, reason: str) -> None:
        """End a motion, once: its final state, the result, the status."""
        now_ns, handle = self.now_ns(), motion.handle
        if motion.ended:
            return
        result = motion.end(outcome, reason, now_ns, self._goal_distance(motion))
        if outcome == ReachTarget.Result.REACHED:
            handle.succeed()
        elif outcome == ReachTarget.Result.CANCELLED and handle.is_cancel_requested:
            handle.canceled()
        else:
            handle.abort()
        self._action.send_result(handle, result)
        self.get_logger().info(f"motion {motion.number}: {reason}")
        if self._motion is motion:
            self._motion = None
            self._stage = PlannerStatus.HOLDING if self._holding else PlannerStatus.IDLE
            self._reason = reason
            self._publish_status(now_ns, motion, None)

    def _on_cancel(self, handle: Any) -> CancelResponse:
        if self._motion is None or self._motion.handle.goal_id != handle.goal_id:
            return CancelResponse.REJECT
        self._motion.cancelling = True
        return CancelResponse.ACCEPT

    def _goal_distance(self, motion: Motion) -> float:
        return float(np.linalg.norm(self._robot.frames(self._inputs.q)[3] - motion.target))

    # ------------------------------------------------------------------ tick
    def on_tick(self, now_ns: int) -> None:
        """Publish finished plans, start the next one, supply the heartbeat, end the motion."""
        if now_ns < self._last_tick_ns - CLOCK_STEP_NS:
            self._clock_went_back(now_ns)
        self._last_tick_ns = now_ns
        self._collect(now_ns)
        motion = self._motion
        if motion is not None or self._holding:
            self._supervise(now_ns, motion)
        if now_ns >= self._next_heartbeat_ns:
            self._next_heartbeat_ns = now_ns + HEARTBEAT_NS
            if self._config.heartbeat:
                self._speed_scale.publish(Float64(data=self._scale))
        if motion is not None and now_ns >= self._next_feedback_ns and not motion.ended:
            self._next_feedback_ns = now_ns + FEEDBACK_NS
            motion.handle.publish_feedback(
                ReachTarget.Feedback(
                    distance_to_goal=self._goal_distance(motion),
                    min_separation=motion.min_separation,
                    stage=_STAGE_NAMES[self._stage],
                )
            )

    def _clock_went_back(self, now_ns: int) -> None:
        self.fault("clock", "the clock went back: the present motion is dropped")
        self._halt()
        self._overdue, self._failure, self._dropped_ns = False, "", None
        self._inputs.forget()
        if self._motion is not None:
            self._end(self._motion, ReachTarget.Result.FAILED, "the clock went back")
        self._next_heartbeat_ns = self._next_feedback_ns = self._next_markers_ns = now_ns
        self._next_pause_ns = now_ns
        self._last_plan_ns = self._next_cycle_ns = now_ns

    def _supervise(self, now_ns: int, motion: Motion | None) -> None:
        if motion is not None and motion.cancelling:
            self._cancel(now_ns, motion)
            return
        problem = self._inputs.problem(now_ns) or self._unrest()
        overdue = "" if problem else self._lateness(now_ns, motion)
        if problem or overdue:
            self._pause(now_ns, motion, problem or overdue)
            wanted = self._motion is not None or self._holding
            if overdue and wanted and not self._worker.busy and now_ns >= self._next_cycle_ns:
                # Tried again while the robot stops and stands: the first success lets it go on.
                self._start_cycle(now_ns, self._motion)
            return
        self._dropped_ns = None
        if self._scale == 0.0:
            self._reason = ""
            self._next_heartbeat_ns = now_ns
            # While paused no replan was due: the first one must not count as late.
            self._last_plan_ns = now_ns
            self._next_cycle_ns = max(self._next_cycle_ns, now_ns)
            if motion is not None:
                motion.lost_since_ns = None
        self._scale = 1.0
        if motion is not None:
            motion.min_separation = min(motion.min_separation, self._inputs.separation(self._robot))
            if self._has_ended(now_ns, motion):
                return
        if not self._worker.busy and now_ns >= self._next_cycle_ns:
            self._start_cycle(now_ns, motion)

    def _lateness(self, now_ns: int, motion: Motion | None) -> str:
        """What is said when no replan has come for too long; empty when all is well.

        Whether it still computes or failed again and again makes no difference to the robot: it is on a
        plan that knows nothing of what the person did since.
        """
        late = (now_ns - self._last_plan_ns) / NANO - self._config.replan_interval
        due = self._worker.busy or motion is None or motion.started
        if self._scale != 0.0 and due and late > self._config.late_timeout:
            self._overdue = True
        if not self._overdue:
            return ""
        why = f": {self._failure}" if self._failure else ""
        return f"the replan is {late:.2f} s late{why}"

    def _pause(self, now_ns: int, motion: Motion | None, problem: str) -> None:
        """Bring the robot to rest on its path until the inputs are back."""
        if self._scale != 0.0 or self._stage != PlannerStatus.STOPPING:
            self._scale = 0.0
            # At once, not with the next beat: every millisecond of the stop counts.
            self._next_heartbeat_ns = now_ns
            self._stage, self._reason = PlannerStatus.STOPPING, problem
            self.fault("paused", problem)
            self._next_pause_ns = now_ns
        if now_ns >= self._next_pause_ns:
            # Again and again: the cause may change while the robot stands.
            self._next_pause_ns = now_ns + FEEDBACK_NS
            self._reason = problem
            self._publish_status(now_ns, motion, None)
        reference = self._inputs.reference
        if reference is not None and reference.state != ControllerState.IDLE:
            # Without a heartbeat of our own there is no other way to stop.
            slow = not self._config.heartbeat or reference.speed_scale < STOPPED_RATE
            told = self._dropped_ns
            if slow if told is None else now_ns - told > SETTLE_NS:
                self._dropped_ns = now_ns
                self._drop()
        if motion is None:
            return
        motion.over_since_ns = None
        if motion.lost_since_ns is None:
            motion.lost_since_ns = now_ns
        if (now_ns - motion.lost_since_ns) / NANO > self._config.lost_timeout:
            self._halt()
            result = ReachTarget.Result
            failed = self._overdue and not self._inputs.problem(now_ns)
            self._end(motion, result.FAILED if failed else result.LOST_INPUT, f"stopped: {problem}")

    def _cancel(self, now_ns: int, motion: Motion) -> None:
        """Stop, and end the motion once the robot is seen at rest."""
        if motion.cancelled_ns is None:
            motion.cancelled_ns = self._dropped_ns = now_ns
            self._halt()
            self._stage, self._reason = PlannerStatus.STOPPING, "cancelled"
            self._publish_status(now_ns, motion, None)
        elif self._dropped_ns is not None and now_ns - self._dropped_ns > SETTLE_NS:
            self._dropped_ns = now_ns
            self._halt()
        reference = self._inputs.reference
        idle = reference is None or reference.state == ControllerState.IDLE
        unseen = self._inputs.joints_problem(now_ns)
        if not unseen and idle and np.abs(self._inputs.qd).max() < self._config.rest_speed:
            self._dropped_ns = None
            self._end(motion, ReachTarget.Result.CANCELLED, "cancelled; the robot stands")
        elif (now_ns - motion.cancelled_ns) / NANO > self._config.lost_timeout:
            why = unseen or "it still moves"
            text = f"cancelled, but the robot was not seen to come to rest: {why}"
            self._end(motion, ReachTarget.Result.LOST_INPUT, text)

    def _unrest(self) -> str:
        """Whether a stop has yet to come to rest.

        A stop that has begun to bite ends at rest, whatever its cause: where a robot that is being slowed
        and quickened again will be at a hand-over, nobody knows well enough.
        """
        reference = self._inputs.reference
        if reference is None or reference.state == ControllerState.IDLE:
            return ""
        if self._dropped_ns is not None:
            return self._reason or "a stop was asked for"
        if reference.state == ControllerState.STOPPING and _slowed(reference):
            return reference.reason or "the controller is stopping"
        return ""

    def _drop(self) -> None:
        """Stop along the present path: an empty trajectory, as for joint_trajectory_controller."""
        self._trajectory.publish(JointTrajectory(joint_names=list(self._robot.joint_names)))
        self._handover.forget()

    def _halt(self) -> None:
        """Stop, and hold nothing."""
        self._drop()
        self._holding = False

    def _has_ended(self, now_ns: int, motion: Motion) -> bool:
        if (now_ns - motion.accepted_ns) / NANO > self._config.max_duration:
            self._halt()
            reason = self._reason or "no way to the goal was found in time"
            text = f"gave up {self._goal_distance(motion):.2f} m away: {reason}"
            self._end(motion, ReachTarget.Result.BLOCKED, text)
            return True
        if not motion.started:
            return False
        at_rest = np.abs(self._inputs.qd).max() < self._config.rest_speed
        distance = self._goal_distance(motion)
        last = self._last
        over = (
            last is not None
            and last.motion_number == motion.number
            and last.is_over(self._handover.plan_time_s(now_ns))
        )
        if at_rest and over and distance <= self._config.goal_tolerance:
            self._holding = True
            self._end(motion, ReachTarget.Result.REACHED, f"reached, {distance * 1e3:.1f} mm off")
            return True
        stuck = motion.is_held_up(now_ns, over)
        if stuck:
            self._halt()
            self._end(motion, ReachTarget.Result.BLOCKED, held_up(distance, self._planner.table))
        return stuck

    # ------------------------------------------------------------------ planning
    def _start_cycle(self, now_ns: int, motion: Motion | None) -> None:
        # From the last hand-over, not from this tick: else each interval is longer by part of a tick.
        begin_ns = self._next_cycle_ns
        if now_ns - begin_ns > self._interval_ns // 4:
            if self._scale != 0.0 and (motion is None or motion.started):
                self._missed(motion, (now_ns - begin_ns) // self._interval_ns)
            begin_ns = now_ns
        handover_ns = begin_ns + self._interval_ns
        if (
            motion is not None
            and not motion.started
            and not (self._may_begin(now_ns, motion) and self._begin(motion, handover_ns))
        ):
            return
        self._next_cycle_ns = handover_ns
        handover_s = self._handover.plan_time_s(handover_ns)
        try:
            joint = self._handover.align(handover_ns)
            forecasts = self._inputs.forecasts(self._handover.origin_ns)
        except (DataError, PlanningError) as error:
            self._note_failure(error)
            return
        newest_ns = self._inputs.newest_sample_ns()
        number = self._motions if motion is None else motion.number
        iterations: int | None = None
        deadline: Callable[[], bool] | None = None
        if self.lockstep:
            iterations = self._budget.iterations(
                self._config.replan_interval,
                self._planner_config.num_rollouts,
                self._free_steps(handover_s),
            )
        else:
            end_ns = begin_ns + round(self._config.compute_share * self._interval_ns)

            def deadline() -> bool:
                # The ROS clock, so that the share is kept when /clock runs fast or slow.
                return self.now_ns() >= end_ns

        def job() -> Cycle:
            start = time.monotonic()
            before = self._planner.snapshot()
            try:
                result = self._planner.replan(
                    handover_s, forecasts, iterations=iterations, deadline=deadline
                )
            except (DataError, PlanningError):
                self._planner.restore(before)
                raise
            spent = time.monotonic() - start
            return Cycle(number, handover_ns, newest_ns, joint, before, result, spent)

        self._worker.submit(job)
        if self.lockstep:
            self._collect(now_ns)

    def _may_begin(self, now_ns: int, motion: Motion) -> bool:
        """Whether the robot stands or is on a plan of ours.

        Otherwise it is coming to rest after a stop, and nobody knows where it will be at the
        hand-over; what somebody else made it do is stopped.
        """
        reference = self._inputs.reference
        if reference is None or reference.state == ControllerState.IDLE:
            return True
        if self._handover.state_at(now_ns + self._interval_ns) is not None:
            return True
        if now_ns - motion.accepted_ns > SETTLE_NS:
            self._halt()
            self._next_cycle_ns = now_ns + SETTLE_NS
        return False

    def _begin(self, motion: Motion, handover_ns: int) -> bool:
        """Set the planner on a new goal, from rest or in flight."""
        q, qd = self._inputs.q, self._inputs.qd
        state = self._handover.state_at(handover_ns)
        reference = self._inputs.reference
        if state is not None:
            q, qd = state[0], state[1]
        elif reference is not None:
            # What the controller asks for, not what the joints make of it: no step at hand-over.
            q = np.array(reference.reference_position)
            qd = np.array(reference.reference_velocity)
        try:
            self._planner.start(q, qd, motion.target, motion.duration_s, 0.0)
        except PlanningError as error:
            if state is not None:
                self._halt()
            self._end(motion, ReachTarget.Result.UNREACHABLE, str(error))
            return False
        self._handover.begin(handover_ns)
        motion.started = True
        self._holding = False
        self._last_plan_ns = handover_ns
        return True

    def _free_steps(self, handover_s: float) -> int:
        """Time steps between a hand-over and the end of the present plan."""
        plan = self._planner.plan
        left = 0.0 if plan is None else max(plan.end_s - handover_s, 0.0)
        return round(left / self._config.default_duration * self._planner_config.num_timesteps)

    def _collect(self, now_ns: int) -> None:
        """Publish the plan that has become ready, unless it is late."""
        try:
            cycle = self._worker.take()
        except (DataError, PlanningError) as error:
            self._note_failure(error)
            return
        if cycle is None:
            return
        motion = self._motion
        current = motion is not None and motion.number == cycle.motion_number and motion.started
        if not current and not (motion is None and self._holding):
            return  # the motion it was made for has ended
        if current and (motion is None or motion.cancelling):
            return
        self._plans += 1
        self._compute_ms.append(cycle.compute_s * 1e3)
        self._late_ms.append((now_ns - cycle.handover_ns) / 1e6)
        if late := now_ns > cycle.handover_ns - (0 if self.lockstep else TRANSPORT_NS):
            self._missed(motion)
        else:
            # Only a plan in time shows that replanning works again.
            self._overdue, self._failure = False, ""
        if late or self._scale == 0.0:
            # It would begin in the past, or was made for a robot that moves on but is being stopped.
            self._planner.restore(cycle.before)
            return
        self._last = cycle
        self._last_plan_ns = now_ns
        self._publish_plan(now_ns, motion, cycle)

    def _missed(self, motion: Motion | None, intervals: int = 1) -> None:
        """Count intervals that brought no new plan."""
        self._misses += intervals
        if motion is not None:
            motion.misses += intervals

    def _note_failure(self, error: DataError | PlanningError) -> None:
        """A replan failed: the robot stays on the plan before, until that is too old."""
        self._failures += 1
        self._missed(self._motion)
        self._failure = str(error)
        self.fault("replan", f"a replan failed: {error}")

    def _publish_plan(self, now_ns: int, motion: Motion | None, cycle: Cycle) -> None:
        result = cycle.result
        due_ns = self._handover.publish(cycle.handover_ns, cycle.joint, cycle.before, result)
        self._trajectory.publish(trajectory_message(result.plan, self._robot.joint_names, due_ns))
        if motion is not None:
            motion.replans += 1
            motion.costs = dict(result.cost_terms)
        self._stage = (
            PlannerStatus.HOLDING
            if motion is None
            else PlannerStatus.WAITING
            if result.stage == "waiting"
            else PlannerStatus.MOVING
        )
        self._reason = result.reason
        self._publish_status(now_ns, motion, cycle)
        if now_ns >= self._next_markers_ns:
            self._next_markers_ns = now_ns + NANO // 10
            self._markers.publish(plan_markers(result.plan, self._robot, now_ns))

    def _publish_status(self, now_ns: int, motion: Motion | None, cycle: Cycle | None) -> None:
        reference = self._inputs.reference
        message = PlannerStatus(
            header=Header(stamp=to_time(now_ns), frame_id=WORLD),
            stage=self._stage,
            reason=self._reason,
            motion=self._motions if motion is None else motion.number,
            clearance=self._inputs.separation(self._robot),
            speed_scale=self._scale,
            handover_jump=0.0 if reference is None else reference.max_handover_jump,
            predicted_clearance=1e9,
            first_contact=-1.0,
        )
        if motion is not None:
            message.replan = motion.replans
            message.deadline_misses = motion.misses
            message.distance_to_goal = self._goal_distance(motion)
        if cycle is not None:
            describe_plan(
                message,
                cycle.result,
                due_ns=self._handover.newest_due_ns or cycle.handover_ns,
                due_s=self._handover.plan_time_s(cycle.handover_ns),
                newest_sample_ns=cycle.newest_sample_ns,
            )
        self._status.publish(message)

    def health(self) -> tuple[bytes, str, dict[str, Any]]:
        """Timing of the replans, misses, what is wrong with the inputs."""
        figures: dict[str, Any] = {
            "plans": self._plans,
            "deadline_misses": self._misses,
            "failed_replans": self._failures,
        }
        figures |= percentile_figures("compute_ms", self._compute_ms)
        figures |= percentile_figures("lateness_ms", self._late_ms)
        if self._last is not None:
            figures["iterations"] = self._last.result.iterations
        problem = self._inputs.problem(self.now_ns())
        if problem:
            return WARN, problem, figures
        return OK, _STAGE_NAMES[self._stage], figures


def main(args: list[str] | None = None) -> int:
    """Entry point."""
    # Optimiser and executor share the interpreter: hand it over often, or callbacks wait 5 ms for it.
    sys.setswitchinterval(5e-4)
    return run_node(PtompNode, args)
