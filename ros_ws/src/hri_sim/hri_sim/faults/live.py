"""A launched graph, each node a process, whose robot goes to and fro for as long as somebody looks on.

Time zero of a fault is the wall clock just before the signal is sent. Joint states are taken by their
stamps, which are the simulator's wall clock on the same machine; what is said counts when it is heard here.
"""

from __future__ import annotations

import contextlib
import math
import os
import signal
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.action import ActionClient
from rclpy.context import Context
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.qos import HistoryPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import JointTrajectory

from hri_planner.robot.model import load_robot
from hri_planner.ros.authority import STATUSES
from hri_planner.ros.conversions import joints_from_message
from hri_prediction.closing import Closing
from hri_prediction.errors import GraphError
from hri_prediction.ros.conversions import WORLD
from hri_prediction.ros.diagnostics import UP_S
from hri_prediction.ros.messages import ControllerState, Cue, ReachTarget, SimState
from hri_prediction.ros.polling import PollingNode
from hri_prediction.ros.qos import reliable
from hri_prediction.ros.time import NANO, to_ns, to_time
from hri_sim.faults.own_motion import REST, OwnMotion, own_motion
from hri_sim.faults.reference import Asked, on_course
from hri_sim.faults.sent_goal import SentGoal
from hri_sim.launch.deaths import RESTART, Deaths
from hri_sim.launch.freezing import Freezes
from hri_sim.launch.health import SIMULATOR, GraphHealth
from hri_sim.launch.supervisor import NodeSpec, Supervisor
from hri_sim.launch.vital import vital_topics
from hri_sim.nodes.simulator_node import MAX_CATCH_UP
from hri_sim.scenario.schema import Scenario

FRESH_S = 0.05
"""Joint states older than this say nothing of how the robot moves now [s]."""
BURST = QoSProfile(
    history=HistoryPolicy.KEEP_LAST,
    depth=2 * MAX_CATCH_UP,
    reliability=ReliabilityPolicy.BEST_EFFORT,
)
"""A simulator that was frozen makes up for half a second in one burst: all of it is looked at."""
LEFT_S = 0.15
"""A planner's motion is under way as long as its plan goes on for more than this [s]: one that is over
before comes to rest by itself, whoever is missing. Plans of policies are always short."""
LOOK_S = 0.005
"""How often it is looked at whether what is waited for has come [s]."""
READY_S = 120.0
"""So long is waited for nodes to be well, at the start and after a fault [s]."""
SLOW_S = 20.0
"""Who is not well again by then is named in the table [s]."""
SET_OUT_S = 60.0
"""So long is tried to have the robot in mid-motion [s]."""
MENTIONED = 3
"""So many of the things that were said instead of what was wanted are kept."""


class LiveGraph(Closing):
    """Node processes, and a node of one's own that sends goals and listens; a context manager.

    Args:
        folder: For logs and parameters; it is there.
        scenario: The scene.
        mover: The node that moves the robot.
        specs: What is started.

    Attributes:
        told: What the launcher has told its user: when [s], and what.
        late: Who was not well again in time, the last time that somebody was not.
        goal: The newest one; none: none was sent.
    """

    def __init__(
        self, folder: Path, scenario: Scenario, mover: str, specs: Sequence[NodeSpec]
    ) -> None:
        self.folder, self.scenario, self.mover = folder, scenario, mover
        self.supervisor = Supervisor(folder)
        self.told: list[tuple[float, str]] = []
        self.late = ""
        self.reasons: list[tuple[float, str]] = []
        self._last: dict[str, str] = {}
        self._spoke_s: dict[str, float] = {}
        self._deaths = Deaths(self.supervisor, self._tell, RESTART)
        self._health, self._freezes = GraphHealth(self._tell), Freezes(self._tell)
        self._context = Context()
        rclpy.init(context=self._context)
        self._node = PollingNode("onlooker", context=self._context, start_parameter_services=False)
        self._executor = EventsExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._cues = self._node.create_publisher(Cue, "sim/cue", reliable(10))
        action = f"{self.mover}/reach_target"
        self._client = ActionClient(self._node, ReachTarget, action)
        self.goal: SentGoal | None = None
        self._moving = False
        self._planned_until_s = 0.0
        self._robot, self._q = load_robot(), np.array(scenario.robot_start)
        self.speeds: list[tuple[float, float]] = []
        self.forget()
        for kind, topic, take in (
            (JointState, "joint_states", self._on_joints),
            (ControllerState, "joint_trajectory_controller/reference", self._on_reference),
            (SimState, "sim/state", self._on_state),
        ):
            self._node.poll_topic(kind, topic, take, BURST)
        listen = self._node.create_subscription
        planned = "joint_trajectory_controller/joint_trajectory"
        listen(JointTrajectory, planned, self._on_trajectory, reliable(1))
        listen(DiagnosticArray, "/diagnostics", self._on_diagnostics, 100)
        listen(STATUSES[self.mover], f"{self.mover}/status", self._on_reason, reliable(10))
        self._vital = [self._node.resolve_topic_name(t) for t in vital_topics(self.scenario)]
        try:
            self.supervisor.start(specs)
            self.wait_ready()
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """End all nodes."""
        for pid in self.supervisor.pids.values():
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGCONT)
        self.supervisor.stop()
        self._client.destroy()
        self._executor.shutdown()
        self._node.destroy_node()
        rclpy.try_shutdown(context=self._context)

    # ------------------------------------------------------------------ listening
    def forget(self) -> None:
        """Drop what has been heard: a fault is about to begin. Whether the robot moves is remembered."""
        if self.speeds:
            self._moving = self.own_motion().moves
        self.speeds = []
        self._asked: list[tuple[float, float]] = []
        self._touches: list[tuple[float, float, float]] = []
        self.reasons = self.reasons[-1:]
        self.references: list[Asked] = []
        self._speak: list[tuple[float, float, str]] = []

    def _tell(self, text: str) -> None:
        self.told.append((time.time(), text))

    def _on_joints(self, message: JointState) -> None:
        fastest = max((abs(v) for v in message.velocity), default=0.0)
        self.speeds.append((to_ns(message.header.stamp) / NANO, fastest))
        self._q, _ = joints_from_message(message, self._robot.joint_names)

    def _on_reason(self, message: Any) -> None:
        if message.reason:
            self.reasons.append((time.time(), f"/{self.mover}/status: {message.reason}"))

    def _on_reference(self, message: ControllerState) -> None:
        stamp_s = to_ns(message.header.stamp) / NANO
        self.references.append(Asked.of(message, stamp_s))
        self._asked.append(
            (stamp_s, max((abs(v) for v in message.reference_velocity), default=0.0))
        )
        if message.reason and message.state == ControllerState.STOPPING:
            self.reasons.append((time.time(), f"controller: {message.reason}"))

    def _on_trajectory(self, message: JointTrajectory) -> None:
        lasts_ns = to_ns(message.points[-1].time_from_start) if message.points else 0  # 0: a stop
        self._planned_until_s = (to_ns(message.header.stamp) + lasts_ns) / NANO

    def _on_state(self, message: SimState) -> None:
        time_s = to_ns(message.header.stamp) / NANO
        self._touches.append((time_s, float(message.contacts_human), message.approach))

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        self._health.take(message.status, time.monotonic(), begun=True)
        stamp_s = to_ns(message.header.stamp) / NANO
        for status in message.status:
            up_s = next((float(item.value) for item in status.values if item.key == UP_S), 0.0)
            self._speak.append((stamp_s, stamp_s - up_s, status.hardware_id))
            self._spoke_s[status.hardware_id] = time.monotonic()
            self._last[status.hardware_id] = f"{status.hardware_id}: {status.message}"
            if status.level != DiagnosticStatus.OK:
                said = f"/diagnostics of {status.hardware_id}: {status.message}"
                self.reasons.append((time.time(), said))

    def spin(self, seconds: float, until: Callable[[], bool] = lambda: False) -> bool:
        """Listen, and start dead nodes again; whether ``until()`` became true before the time was over."""
        end = time.monotonic() + seconds
        while (now_s := time.monotonic()) < end:
            # All messages of some time, then one look: they are a thousand in a second.
            self._node.let_in(self._executor, min(LOOK_S, end - now_s))
            self._deaths.look(begun=True)
            self._health.look(time.monotonic(), self.supervisor.pids)
            self._freezes.look(time.monotonic(), self.supervisor.pids)
            if until():
                return True
        return False

    def wait_ready(self) -> None:
        """Until all nodes say that nothing is wrong now, each of them since the call.

        Raises:
            GraphError: when some do not; they are named.
        """
        for label in self._deaths.again:
            self._health.forget(label)
        # Each death counts anew: many are wanted here.
        self._deaths.forget(starts=True)
        begin_s = time.monotonic()

        def absent() -> set[str]:
            labels = set(self.supervisor.labels)
            missing = self._health.missing(labels, self._vital, patient=True, past=False)
            if self._health.holds:
                missing.discard(SIMULATOR)
            spoke = {label for label, when_s in self._spoke_s.items() if when_s > begin_s}
            return missing | (labels - spoke)

        def ready() -> bool:
            return not absent() and self._client.server_is_ready()

        if self.spin(SLOW_S, ready):
            return
        late = sorted(absent()) or ["the server of goals"]
        last = "; ".join(filter(None, (self._last.get(label, "") for label in late)))
        self.late = f"not well again within {SLOW_S:.0f} s: {', '.join(late)} ({last})"
        self._tell(self.late)
        if not self.spin(READY_S - SLOW_S, ready):
            missing = sorted(absent())
            said = "; ".join(
                text for label in missing for text in [self._last.get(label, "")] if text
            )
            raise GraphError(f"not ready after {READY_S:.0f} s: {', '.join(missing)} ({said})")

    def ready_after(self, since_s: float) -> float | None:
        """How long after a time all nodes are well again [s]; none when some are not."""
        try:
            self.wait_ready()
        except GraphError as error:
            self._tell(str(error))
            return None
        return time.time() - since_s

    # ------------------------------------------------------------------ acting
    def under_way(self, rng: np.random.Generator, latest_s: float = 0.6) -> None:
        """Let the robot set out, and move for a random time.

        Args:
            rng: Draws the time.
            latest_s: The longest [s].

        Raises:
            GraphError: when the robot does not set out.
        """
        end_s, kept, said = time.monotonic() + SET_OUT_S, "", dict[str, None]()
        while time.monotonic() < end_s:
            self._set_out()
            self.spin(10.0, lambda: self.speed() > 0.1)
            self.spin(rng.uniform(0.0, latest_s))
            kept = self._not_under_way(time.time())
            if not kept:
                return
            said |= dict.fromkeys(text for _, text in self.reasons)
        goal = self.goal.outcome if self.goal is not None else ""
        raise GraphError(
            f"the robot was not seen in mid-motion within {SET_OUT_S:.0f} s: at last {kept}; "
            f"the last goal: {goal or 'not over'}; said meanwhile: {_or_nothing([*said])}"
        )

    def _not_under_way(self, now_s: float) -> str:
        """Why nobody can say that the robot is in mid-motion; empty when it is.

        Args:
            now_s: The present [s].
        """
        if not self.speeds:
            return "no joint states since it was to set out"
        # On a busy machine what is heard may be old: then nobody knows.
        if (old_s := now_s - self.speeds[-1][0]) >= FRESH_S:
            return f"joint states are {old_s:.3f} s old"
        if self.speed() <= REST:
            return f"its fastest joint goes at {self.speed():.3f} rad/s"
        if self.mover == "ptomp" and (left_s := self._planned_until_s - now_s) <= LEFT_S:
            return f"its plan is over in {left_s:.2f} s, more than {LEFT_S} are wanted"
        return ""

    def _set_out(self) -> None:
        """Send the robot to the farther one of its targets.

        A motion that a fault has broken off may have hardly begun: the way back would end right after it.
        """
        tool = self._robot.frames(self._q)[-1]
        far = [
            float(np.linalg.norm(tool - self.scenario.targets[reach.robot_target]))
            for reach in self.scenario.reaches
        ]
        index = int(np.argmax(far))
        wanted = self.scenario.reaches[index]
        cue = Cue(reach=index, delay=wanted.person_delay, duration=wanted.person_duration)
        cue.header.stamp = to_time(time.time_ns())
        cue.header.frame_id = WORLD
        cue.person_target = wanted.person_target or ""
        self._cues.publish(cue)
        self.spin(0.1)
        goal = ReachTarget.Goal(target=wanted.robot_target, duration=wanted.duration)
        x, y, z = self.scenario.targets[wanted.robot_target]
        goal.pose.header.frame_id = WORLD
        point = goal.pose.pose.position
        point.x, point.y, point.z = x, y, z
        self.forget()
        self.goal = SentGoal(self._client, goal)

    def send(self, label: str, number: signal.Signals) -> float:
        """Send a signal to a node; the time just before [s]."""
        pid = self.supervisor.pids[label]
        self.forget()
        now_s = time.time()
        os.kill(pid, number)
        return now_s

    # ------------------------------------------------------------------ looking
    def speed(self) -> float:
        """Fastest joint at present [rad/s]."""
        return self.speeds[-1][1] if self.speeds else 0.0

    def own_motion(self) -> OwnMotion:
        """How the robot has moved of its own since :meth:`forget`."""
        return own_motion(self.speeds, self._asked, self._touches, moving=self._moving)

    def back_s(self, label: str, since_s: float) -> float:
        """When a node that died at a time ticked again [s]; infinite when it is not known to.

        Others may hear it before its first status is heard here.
        """
        back = (
            began_s for stamp_s, began_s, who in self._speak if who == label and stamp_s > since_s
        )
        return min((began_s for began_s in back if began_s > since_s), default=math.inf)

    def rest_ms(self, since_s: float, until_s: float = math.inf) -> float | None:
        """From a time to rest [ms]: 0 when the robot was at rest; none when it moves until the end.

        Args:
            since_s: From when on [s].
            until_s: The end: then it may move again [s].
        """
        found = own_motion(
            [state for state in self.speeds if state[0] <= until_s],
            self._asked,
            self._touches,
            moving=self._moving,
        )
        if found.moves:
            return None
        return 0.0 if found.rest_s is None else max(found.rest_s - since_s, 0.0) * 1e3

    def on_course(self) -> dict[str, float | None]:
        """Whether the reference jumped or left its limits since :meth:`forget`."""
        return on_course(self.references, self._robot)

    def first_said(
        self, since_s: float, words: tuple[str, ...], said: list[tuple[float, str]]
    ) -> tuple[float | None, str]:
        """After how long one of some words was said [ms], and in what.

        None when never: then what was said instead, before and after.
        """
        for when_s, text in said:
            if when_s >= since_s and any(word in text for word in words):
                return (when_s - since_s) * 1e3, text
        before = [text for when_s, text in said if when_s < since_s][-1:]
        after = dict.fromkeys(text for when_s, text in said if when_s >= since_s)
        return None, f"before: {_or_nothing(before)}; afterwards: {_or_nothing([*after])}"


def _or_nothing(texts: Sequence[str]) -> str:
    return " | ".join(texts[:MENTIONED]) or "nothing"
