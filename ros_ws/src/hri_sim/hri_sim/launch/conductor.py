"""Conducts a scenario over a live graph: cues the person, sends the robot's goals, watches."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import rclpy
from action_msgs.msg import GoalStatus
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.action import ActionClient
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.signals import SignalHandlerOptions

from hri_planner.ros.authority import STATUSES
from hri_prediction.errors import GraphError
from hri_prediction.ros.messages import Cue, PlannerStatus, PolicyStatus, ReachTarget, SimState
from hri_prediction.ros.polling import PollingNode
from hri_prediction.ros.qos import SENSOR, reliable
from hri_prediction.ros.time import seconds_to_ns
from hri_sim.launch.alone import check_alone
from hri_sim.launch.deaths import STOP, Deaths, NodeDeath
from hri_sim.launch.folder import LOGS
from hri_sim.launch.freezing import Freezes
from hri_sim.launch.health import GraphHealth
from hri_sim.launch.held_signals import HeldSignals
from hri_sim.launch.leading import Leading
from hri_sim.launch.moving_goals import Leader
from hri_sim.launch.reach_messages import cue_message, goal_message
from hri_sim.launch.reports import INTERRUPTED, OUTCOMES, ReachReport, plans_of
from hri_sim.launch.resting import wait_for_rest
from hri_sim.launch.status_words import FAR_M, status_words
from hri_sim.launch.supervisor import Supervisor
from hri_sim.launch.vital import vital_topics
from hri_sim.launch.withdrawing import PERSON, Withdrawing
from hri_sim.scenario.schema import ReachSpec, Scenario

CUE_LEAD_S = 0.1
"""The cue is sent this long before the reach begins, so that everyone has it in time [s]."""
PATIENCE_S = 20.0
"""How long a node may warn before the run begins all the same [s]."""
READY_AGAIN_S = 60.0
"""A node that was started again may take so long [s]."""
TURN_S = 0.01
"""So long messages are let in before nodes and their processes are looked at again [s]."""
REST_S = 0.5
"""Rest between reaches, in which the predictor sees that nobody moves [s]."""


class Conductor:
    """The launching process's own node.

    Args:
        scenario: What is to be done.
        supervisor: Whose nodes to watch.
        say: Takes the one-line live status.
        tell: Takes what must not be missed, such as the death of a node.
        mover: The node that moves the robot, one of :data:`STATUSES`.
        leader: Moves goals while the robot is on its way; none: they stay.
        on_death: What is done when a node dies, one of :data:`hri_sim.launch.deaths.ON_DEATH`.
    """

    def __init__(
        self,
        scenario: Scenario,
        supervisor: Supervisor,
        say: Callable[[str], None],
        tell: Callable[[str], None],
        mover: str = "ptomp",
        leader: Leader | None = None,
        on_death: str = STOP,
    ) -> None:
        self._scenario = scenario
        self._supervisor = supervisor
        self._say = say
        self._mover = mover
        self._deaths = Deaths(supervisor, tell, on_death)
        self._signals = HeldSignals()
        # Ctrl-C must not take ROS away: the robot is stopped over it first.
        rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
        self._node = PollingNode("conductor", start_parameter_services=False)
        self._executor = EventsExecutor()
        self._executor.add_node(self._node)
        self._cues = self._node.create_publisher(Cue, "sim/cue", reliable(10))
        self._action = f"{mover}/reach_target"
        self._client = ActionClient(self._node, ReachTarget, self._action)
        self._leading = Leading(self._node, f"{mover}/goal", scenario, leader)
        self._begun = False
        self._health = GraphHealth(tell)
        self._freezes = Freezes(tell)
        self._made_s = time.monotonic()
        self._state: SimState | None = None
        self._status: PlannerStatus | PolicyStatus | None = None
        self._reports: list[ReachReport] = []
        self._closest: list[float] = []
        self._node.create_subscription(DiagnosticArray, "/diagnostics", self._on_diagnostics, 50)
        self._node.poll_topic(SimState, "sim/state", self._on_state, SENSOR)
        self._node.create_subscription(
            STATUSES[mover], f"{mover}/status", self._on_status, reliable(10)
        )
        self._next_say = self._accepted_s = 0.0
        self._goal: Any = None
        self._cue_ns = 0
        self._withdrawing = Withdrawing(scenario.persons, self._cues.publish, tell)
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
    def stopped_s(self) -> dict[str, float]:
        """How long nodes were stopped by signals so far [s], of those that were, by name."""
        return self._freezes.stopped_s(self._made_s, time.monotonic())

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
            since_s = self._accepted_s if self._goal is not None else self._made_s
            self._report_interrupted(self._freezes.because(reason, since_s, time.monotonic()))
        if self._goal is not None:
            self._goal.cancel_goal_async()
        wait_for_rest(self._node, self._executor, lambda: bool(self._signals.waiting))

    # ------------------------------------------------------------------ listening
    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        self._health.take(message.status, time.monotonic(), begun=self._begun)

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
            self._turn()
            self._look()
            if time.monotonic() > end:
                raise GraphError(
                    f"{what} did not happen within {timeout_s:.0f} s", hint=self._freezes.hint()
                )

    def _look(self) -> None:
        """What is looked at in every turn."""
        self._deaths.look(begun=self._begun)
        now_s, pids = time.monotonic(), self._supervisor.pids
        self._freezes.look(now_s, pids)
        # Who is being started again has a reason to be silent.
        self._health.look(now_s, pids.keys() - set(self._freezes.labels) - self._deaths.again)
        if self._goal is not None and PERSON in pids:
            self._take_back()

    def _take_back(self) -> bool:
        """A person takes a hand back that was left on the robot; whether that begins now."""
        reason = "" if self._status is None else self._status.reason
        nearest = "" if self._state is None else self._state.human_part
        return self._withdrawing.look(self.now_ns(), reason, nearest)

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
        check_alone(self._node, self._turn, labels)

    def _turn(self) -> None:
        self._node.let_in(self._executor, TURN_S)
        self._signals.release()

    def wait_ready(self, timeout_s: float = 60.0) -> None:
        """Wait until every node has said that it runs well, and the action is there.

        A node that only warns is waited for a little, then taken as it is.

        Raises:
            NodeDeath: when one ended instead.
            GraphError: when some are still missing; they are named.
        """
        began = time.monotonic()

        def absent() -> set[str]:
            # One that the run can do without may have died.
            labels = {*self._supervisor.pids, *self._deaths.due}
            patient = time.monotonic() <= began + PATIENCE_S
            return self._health.missing(labels, self._vital, patient=patient)

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
        """Conduct all reaches; ends early after one that was not reached. See :attr:`reports`.

        A reach in which a node died, and was started again, does not count as an end.
        """
        self._begun = True
        for index in range(len(self._scenario.reaches)):
            self.rest(REST_S)
            self._wait_for_the_dead()
            self._wait_for_start(index)
            self._reach(index)
            if self._reports[-1].outcome != "reached" and not self._deaths.again:
                break
        self.rest(REST_S)

    def _wait_for_the_dead(self) -> None:
        """Until nodes that were started again are ready."""
        while self._deaths.again:
            for label in self._deaths.again:
                self._health.forget(label)
            self._deaths.forget()
            self._say("waiting for what was started again")
            self.wait_ready(READY_AGAIN_S)

    def _wait_for_start(self, index: int) -> None:
        """Until it is time for a reach; the first one sets the time."""
        if index:
            start_s = self._scenario.reaches[index].start - CUE_LEAD_S
            due_ns = self._reports[0].cue_ns + seconds_to_ns(start_s)
            self.spin_until(lambda: self.now_ns() >= due_ns, start_s + 60.0, "a reach's start")

    def _cue(self, number: int, reach: ReachSpec) -> int:
        """Tell everyone of a reach, wait until it begins, and say when that was [ns]."""
        cue_ns = self.now_ns() + seconds_to_ns(CUE_LEAD_S)
        self._cues.publish(cue_message(number, reach, cue_ns))
        self._withdrawing.begin(number, reach, cue_ns)
        self._cue_ns = cue_ns
        self._closest.append(math.inf)
        self.spin_until(lambda: self.now_ns() >= cue_ns, 5.0, "the cue")
        return cue_ns

    def _send(self, target: str, place: Sequence[float], duration_s: float) -> Any:
        """Send a goal; the future of its result, or none when the node that moves the robot has died."""
        self._status = None  # what it says of the motion before does not count
        sent = self._client.send_goal_async(goal_message(target, place, duration_s))
        again = self._deaths.again
        self.spin_until(
            lambda: sent.done() or self._mover in again, 5.0, f"an answer of {self._action}"
        )
        if not sent.done():
            return None
        handle: Any = sent.result()
        if not handle.accepted:
            raise GraphError(f"{self._action} refused the goal {target!r}")
        self._goal, self._accepted_s = handle, time.monotonic()
        return handle.get_result_async()

    def _reach(self, index: int) -> None:
        reach = self._scenario.reaches[index]
        cue_ns = self._cue(index, reach)
        place = self._scenario.targets[reach.robot_target]
        future = self._send(reach.robot_target, place, reach.duration)
        if future is None:
            self._report_interrupted(f"{self._mover} died")
            return
        self._leading.begin()
        title = f"reach {index + 1}/{len(self._scenario.reaches)}"

        def finished() -> bool:
            self._say_status(title, self._closest[-1])
            self._leading.lead(index, time.monotonic() - self._accepted_s)
            return bool(future.done()) or self._mover in self._deaths.again

        self.spin_until(finished, 60.0, f"the result of {self._action}")
        if not future.done():
            self._report_interrupted(f"{self._mover} died")
            self._goal = None
            return
        self._goal = None
        result = self._result_of(future, reach.robot_target)
        reason = result.reason
        if result.outcome != ReachTarget.Result.REACHED:
            reason = self._freezes.because(reason, self._accepted_s, time.monotonic())
        end_ns = self.now_ns()
        report = ReachReport(
            index=index,
            target=reach.robot_target,
            outcome=OUTCOMES.get(result.outcome, "failed"),
            reason=reason,
            cue_ns=cue_ns,
            end_ns=end_ns,
            over_ns=end_ns,
            duration_s=float(result.duration),
            replans=int(result.replans),
            goal=self._leading.place,
        )
        self._reports.append(report)
        # The person may still be on the way: the robot must stay clear of that too.
        later = self._scenario.reaches[index + 1 :]
        if not later or later[0].person_target:
            self._wait_for_the_person()
        self._reports[-1] = replace(report, over_ns=self.now_ns())

    def _wait_for_the_person(self) -> None:
        """Until the hand rests, whatever it was last told."""
        rests_ns = self._withdrawing.rests_ns
        left_s = (rests_ns - self.now_ns()) * 1e-9
        self.spin_until(lambda: self.now_ns() >= rests_ns, left_s + 30.0, "the person's rest")

    def _result_of(self, future: Any, target: str) -> Any:
        """The result that has come of a goal."""
        answer = future.result()
        if answer.status == GoalStatus.STATUS_UNKNOWN:
            raise GraphError(f"{self._action} lost the goal {target!r}")
        return answer.result

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

    def _say_status(self, title: str, closest_m: float) -> None:
        if time.monotonic() >= self._next_say:
            self._next_say = time.monotonic() + 0.1
            needed = self._freezes.needed
            # What the node that moves the robot has said last is not so any more, or not why.
            status = None if needed else self._status
            title = f"{title} · {needed} stopped by a signal" if needed else title
            self._say(status_words(title, status, self._state, closest_m))
