"""Conducts a scenario over a live graph: cues the person, sends the robot's goals, watches."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import rclpy
from action_msgs.msg import GoalStatus
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.action import ActionClient
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import JointState

from hri_planner.ros.authority import STATUSES
from hri_prediction.errors import GraphError
from hri_prediction.ros.conversions import WORLD
from hri_prediction.ros.messages import (
    Cue,
    PlannerStatus,
    PolicyStatus,
    ReachTarget,
    SimState,
)
from hri_prediction.ros.node import STANDSTILL
from hri_prediction.ros.qos import SENSOR, reliable
from hri_prediction.ros.time import seconds_to_ns, to_time
from hri_sim.launch.folder import LOGS
from hri_sim.launch.held_signals import HeldSignals
from hri_sim.launch.leading import Leading
from hri_sim.launch.moving_goals import Leader
from hri_sim.launch.reports import INTERRUPTED, OUTCOMES, ReachReport, plans_of
from hri_sim.launch.supervisor import Death, Supervisor
from hri_sim.launch.vital import hears, vital_topics
from hri_sim.scenario.schema import Scenario

DISCOVERY_S = 1.0
"""How long to look for another graph before the start [s]."""
CUE_LEAD_S = 0.1
"""The cue is sent this long before the reach begins, so that everyone has it in time [s]."""
FAR_M = 1e8
"""Clearances beyond this mean that nobody is there [m]."""
PATIENCE_S = 20.0
"""How long a node may warn before the run begins all the same [s]."""
STOP_S = 0.4
"""Time for the robot to come to rest when a run is broken off [s]."""
LONGEST_STOP_S = 2.0
"""The same for one that still moves after that, on a machine that is busy [s]."""
REST_SPEED = 0.02
"""Joint speed below which the robot counts as at rest [rad/s]."""
REST_S = 0.5
"""Rest between reaches, in which the predictor sees that nobody moves [s]."""


class NodeDeath(GraphError):
    """A node that the run needs has ended by itself.

    Attributes:
        death: Which, how, and its last words.
    """

    def __init__(self, death: Death) -> None:
        self.death = death
        super().__init__(str(death))


class Conductor:
    """The launching process's own node.

    Args:
        scenario: What is to be done.
        supervisor: Whose nodes to watch.
        say: Takes the one-line live status.
        tell: Takes what must not be missed, such as the death of a node.
        mover: The node that moves the robot, one of :data:`STATUSES`.
        leader: Moves goals while the robot is on its way; none: they stay.
    """

    def __init__(
        self,
        scenario: Scenario,
        supervisor: Supervisor,
        say: Callable[[str], None],
        tell: Callable[[str], None],
        mover: str = "ptomp",
        leader: Leader | None = None,
    ) -> None:
        self._scenario = scenario
        self._supervisor = supervisor
        self._say = say
        self._tell = tell
        self._signals = HeldSignals()
        # Ctrl-C must not take ROS away: the robot is stopped over it first.
        rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
        self._node = Node("conductor", start_parameter_services=False)
        self._executor = EventsExecutor()
        self._executor.add_node(self._node)
        self._cues = self._node.create_publisher(Cue, "sim/cue", reliable(10))
        self._action = f"{mover}/reach_target"
        self._client = ActionClient(self._node, ReachTarget, self._action)
        self._leading = Leading(self._node, f"{mover}/goal", scenario, leader)
        self._begun = False
        self._health: dict[str, DiagnosticStatus] = {}
        self._state: SimState | None = None
        self._status: PlannerStatus | PolicyStatus | None = None
        self._reports: list[ReachReport] = []
        self._closest: list[float] = []
        self._node.create_subscription(DiagnosticArray, "/diagnostics", self._on_diagnostics, 50)
        self._node.create_subscription(SimState, "sim/state", self._on_state, SENSOR)
        self._node.create_subscription(
            STATUSES[mover], f"{mover}/status", self._on_status, reliable(10)
        )
        self._next_say = 0.0
        self._held_up: set[str] = set()
        self._goal: Any = None
        self._cue_ns = self._person_end_ns = 0
        self._accepted_s = 0.0
        self._vital = [self._node.resolve_topic_name(topic) for topic in vital_topics(scenario)]

    @property
    def begun(self) -> bool:
        """Whether the run has begun: all nodes were ready."""
        return self._begun

    @property
    def reports(self) -> list[ReachReport]:
        """How the reaches that were begun have gone so far."""
        return [
            replace(report, min_clearance_m=closest if closest < FAR_M else None)
            for report, closest in zip(self._reports, self._closest, strict=False)
        ]

    @property
    def insisted(self) -> tuple[int, ...]:
        """Signals to end that have come and had no effect yet."""
        return self._signals.waiting

    def close(self) -> None:
        """Destroy node and context; signals have their effect at once again."""
        self._signals.restore()
        self._client.destroy()
        self._executor.shutdown()
        self._node.destroy_node()
        rclpy.try_shutdown()

    def break_off(self, reason: str) -> None:
        """Cancel the motion and leave the stop chain its time: nodes are stopped only afterwards.

        Another signal to end cuts that short: without the nodes the controller stops by itself.

        Args:
            reason: Why; said of the reach that is under way.
        """
        if len(self._reports) < len(self._closest):
            self._report_interrupted(reason)
        if self._goal is not None:
            self._goal.cancel_goal_async()
        fastest = [0.0]

        def note(joints: JointState) -> None:
            fastest[0] = max((abs(speed) for speed in joints.velocity), default=0.0)

        self._node.create_subscription(JointState, "joint_states", note, SENSOR)
        begin = time.monotonic()
        while not self._signals.waiting and (
            time.monotonic() < begin + STOP_S
            or (fastest[0] > REST_SPEED and time.monotonic() < begin + LONGEST_STOP_S)
        ):
            self._executor.spin_once(timeout_sec=0.02)

    # ------------------------------------------------------------------ listening
    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        self._health.update({status.hardware_id: status for status in message.status})
        for status in message.status:
            if (
                STANDSTILL in status.message
                and status.hardware_id not in self._held_up
                and self._begun
            ):
                self._held_up.add(status.hardware_id)
                self._tell(f"{status.hardware_id}: {status.message}")

    def _on_state(self, message: SimState) -> None:
        self._state = message
        if self._closest:
            self._closest[-1] = min(self._closest[-1], message.clearance)

    def _on_status(self, message: PlannerStatus | PolicyStatus) -> None:
        self._status = message

    def now_ns(self) -> int:
        """ROS time [ns]."""
        return int(self._node.get_clock().now().nanoseconds)

    def spin_until(self, done: Callable[[], bool], timeout_s: float, what: str) -> None:
        """Let messages in until ``done()``.

        Raises:
            NodeDeath: when an essential node ends, or any says of itself, before the run has begun,
                that it cannot start.
            GraphError: when it does not happen in time.
        """
        end = time.monotonic() + timeout_s
        while not done():
            self._executor.spin_once(timeout_sec=0.02)
            self._signals.release()
            for death in self._supervisor.deaths():
                refused = not self._begun and death.code > 0
                if refused or self._supervisor.is_essential(death.label):
                    raise NodeDeath(death)
                self._tell(f"{death}; the run goes on")
            if time.monotonic() > end:
                raise GraphError(f"{what} did not happen within {timeout_s:.0f} s")

    def rest(self, seconds: float) -> None:
        """Wait, listening."""
        end = time.monotonic() + seconds
        self.spin_until(lambda: time.monotonic() >= end, seconds + 5.0, "the end of a rest")

    def check_alone(self, labels: Sequence[str]) -> None:
        """Make sure that no other graph is on this ROS domain: two of them would hear each other.

        Args:
            labels: Nodes that are about to be started.

        Raises:
            GraphError: when one of them is there already.
        """
        end = time.monotonic() + DISCOVERY_S
        while time.monotonic() < end:
            self._executor.spin_once(timeout_sec=0.02)
            self._signals.release()
            present = sorted(set(labels) & set(self._node.get_node_names()))
            if present:
                raise GraphError(
                    f"another graph is running in ROS domain {self._node.context.get_domain_id()}: "
                    f"{', '.join(present)}",
                    hint="stop it, or set ROS_DOMAIN_ID to another number for one of the two",
                )

    def wait_ready(self, timeout_s: float = 60.0) -> None:
        """Wait until every node has said that it runs well, and the action is there.

        A node that only warns is waited for a little, then taken as it is.

        Raises:
            NodeDeath: when one ended instead.
            GraphError: when some are still missing; they are named.
        """
        patience = time.monotonic() + PATIENCE_S

        def absent() -> set[str]:
            labels = set(self._supervisor.pids)  # one that the run can do without may have died
            if time.monotonic() > patience:
                return labels - self._health.keys()
            well = {name for name, s in self._health.items() if s.level == DiagnosticStatus.OK}
            if "recorder" in well and not hears(self._health["recorder"], self._vital):
                well.remove("recorder")
            return labels - well

        def ready() -> bool:
            missing = absent()
            self._say(f"waiting for {', '.join(sorted(missing))}" if missing else "starting")
            return not missing and self._client.server_is_ready()

        try:
            self.spin_until(ready, timeout_s, "start-up")
        except GraphError as error:
            if isinstance(error, NodeDeath):
                raise
            missing = absent()
            raise GraphError(
                f"not ready after {timeout_s:.0f} s: {', '.join(sorted(missing)) or self._action}",
                hint=f"see the logs in {self._supervisor.folder / LOGS}",
            ) from error

    # ------------------------------------------------------------------ acting
    def run(self) -> None:
        """Conduct all reaches; ends early after one that was not reached. See :attr:`reports`."""
        self._begun = True
        for index in range(len(self._scenario.reaches)):
            self.rest(REST_S)
            self._wait_for_start(index)
            self._reach(index)
            if self._reports[-1].outcome != "reached":
                break
        self.rest(REST_S)

    def _wait_for_start(self, index: int) -> None:
        """Until it is time for a reach; the first one sets the time."""
        if index:
            start_s = self._scenario.reaches[index].start - CUE_LEAD_S
            due_ns = self._reports[0].cue_ns + seconds_to_ns(start_s)
            self.spin_until(lambda: self.now_ns() >= due_ns, start_s + 60.0, "a reach's start")

    def _reach(self, index: int) -> None:
        reach = self._scenario.reaches[index]
        cue_ns = self.now_ns() + seconds_to_ns(CUE_LEAD_S)
        cue = Cue(reach=index, delay=reach.person_delay, duration=reach.person_duration)
        cue.header.stamp = to_time(cue_ns)
        cue.header.frame_id = WORLD
        cue.person_target = reach.person_target or ""
        self._cues.publish(cue)
        self._cue_ns = cue_ns
        self._closest.append(math.inf)
        self.spin_until(lambda: self.now_ns() >= cue_ns, 5.0, "the cue")

        goal = ReachTarget.Goal(target=reach.robot_target, duration=reach.duration)
        x, y, z = self._scenario.targets[reach.robot_target]
        goal.pose.header.frame_id = WORLD
        goal.pose.pose.position.x, goal.pose.pose.position.y = x, y
        goal.pose.pose.position.z = z
        self._status = None  # what it says of the motion before does not count
        sent = self._client.send_goal_async(goal)
        self.spin_until(sent.done, 5.0, f"an answer of {self._action}")
        handle: Any = sent.result()
        if not handle.accepted:
            raise GraphError(f"{self._action} refused the goal {reach.robot_target!r}")
        self._goal, self._accepted_s = handle, time.monotonic()
        future = handle.get_result_async()

        self._leading.begin()

        def finished() -> bool:
            self._say_status(index)
            self._leading.lead(index, time.monotonic() - self._accepted_s)
            return bool(future.done())

        self.spin_until(finished, 60.0, f"the result of {self._action}")
        self._goal = None
        answer = future.result()
        result = answer.result
        if answer.status == GoalStatus.STATUS_UNKNOWN:
            raise GraphError(f"{self._action} lost the goal {reach.robot_target!r}")
        end_ns = self.now_ns()
        report = ReachReport(
            index=index,
            target=reach.robot_target,
            outcome=OUTCOMES.get(result.outcome, "failed"),
            reason=result.reason,
            cue_ns=cue_ns,
            end_ns=end_ns,
            over_ns=end_ns,
            duration_s=float(result.duration),
            replans=int(result.replans),
            goal=self._leading.place,
        )
        self._reports.append(report)
        # The person may still be on the way: the robot must stay clear of that too.
        if reach.person_target:
            seconds = reach.person_delay + 1.4 * reach.person_duration
            self._person_end_ns = cue_ns + seconds_to_ns(seconds)
        later = self._scenario.reaches[index + 1 :]
        if not later or later[0].person_target:
            left_s = (self._person_end_ns - self.now_ns()) * 1e-9
            self.spin_until(
                lambda: self.now_ns() >= self._person_end_ns, left_s + 30.0, "the person's rest"
            )
        self._reports[-1] = replace(report, over_ns=self.now_ns())

    def _report_interrupted(self, reason: str) -> None:
        index = len(self._reports)
        now_ns = self.now_ns()
        moved = self._goal is not None
        self._reports.append(
            ReachReport(
                index=index,
                target=self._scenario.reaches[index].robot_target,
                outcome=INTERRUPTED,
                reason=reason,
                cue_ns=self._cue_ns,
                end_ns=now_ns,
                over_ns=now_ns,
                duration_s=time.monotonic() - self._accepted_s if moved else 0.0,
                replans=plans_of(self._status) if moved and self._status is not None else 0,
            )
        )

    def _say_status(self, index: int) -> None:
        if time.monotonic() < self._next_say:
            return
        self._next_say = time.monotonic() + 0.1
        stages = ("idle", "moving", "waiting", "stopping", "holding")
        words = [f"reach {index + 1}/{len(self._scenario.reaches)}"]
        if self._status is not None:
            words.append(stages[min(self._status.stage, len(stages) - 1)])
            words.append(f"{self._status.distance_to_goal * 100:5.1f} cm to go")
            words.append(f"plans {plans_of(self._status)}")
        if self._state is not None and self._state.clearance < FAR_M:
            closest = self._closest[-1]
            least = f" (least {closest * 100:.1f})" if closest < FAR_M else ""
            words.append(f"clear {self._state.clearance * 100:5.1f} cm{least}")
        if self._status is not None and self._status.reason:
            words.append(self._status.reason)
        self._say(" · ".join(words))
