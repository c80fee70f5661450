"""Brings faults about in a running graph, one after the other, and notes what came of each."""

from __future__ import annotations

import signal
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from std_msgs.msg import Header

from hri_prediction.ros.conversions import WORLD
from hri_prediction.ros.messages import HumanArm
from hri_prediction.ros.qos import SENSOR
from hri_prediction.ros.time import to_time
from hri_sim.launch.supervisor import Supervisor
from hri_sim.scenario.schema import PersonSpec
from hri_sim.soak.faults import (
    CANCEL,
    GROUPS,
    KILL,
    PAUSE,
    PREEMPT,
    UNREACHABLE,
    Fault,
    FaultPlan,
)
from hri_sim.soak.mad_samples import PERIOD_S, mad_sample
from hri_sim.soak.rest import RestWatch

MOCAP, GOALS = GROUPS["mocap"], GROUPS["goals"]
BY_ITSELF = ("reached", "lost_input")
"""A goal may have ended so just before it could be taken back."""
WANTED = {
    CANCEL: (("cancelled", *BY_ITSELF),),
    PREEMPT: (("preempted", *BY_ITSELF), ("reached",)),
    UNREACHABLE: (("preempted", *BY_ITSELF), ("unreachable",)),
}
"""How goals may end that a fault is about, the one that was under way first."""


@dataclass
class Happening:
    """A fault that has come, and what came of it; times in seconds since the begin of the soak.

    Attributes:
        fault: Which.
        at_s: When it came.
        moving: Whether the robot moved then.
        rest: Watches the robot come to rest.
        over_s: When its cause was over; none: it still is there.
        seen_dead: Whether a node that it killed was seen to have ended.
        named_ms: From a kill to when the launcher said so [ms].
        ready_s: From a kill to when all nodes were ready again [s].
        reached_s: From the fault to the first goal reached after its cause was over [s].
        outcomes: Of the goals that ended before that.
        as_wanted: Whether goals that it is about ended as they should; none: it is about none.
    """

    fault: Fault
    at_s: float
    moving: bool
    rest: RestWatch
    over_s: float | None = None
    seen_dead: bool = False
    named_ms: float | None = None
    ready_s: float | None = None
    reached_s: float | None = None
    outcomes: list[str] = field(default_factory=list)
    as_wanted: bool | None = None

    def to_mapping(self) -> dict[str, Any]:
        """As a record has it."""
        return {
            "s": round(self.at_s, 3),
            "fault": self.fault.kind,
            "node": self.fault.node,
            "seconds": round(self.fault.seconds, 3),
            "moving": self.moving,
            "rest_ms": self.rest.rest_ms,
            "named_ms": self.named_ms,
            "ready_s": self.ready_s,
            "reached_s": self.reached_s,
            "outcomes": self.outcomes,
            "as_wanted": self.as_wanted,
        }


class Injector:
    """Brings about what a plan says.

    Args:
        node: Publishes as motion capture that has gone mad.
        person: Whose arm that is about.
        supervisor: Whose nodes are killed and paused.
        plan: Draws the faults.
        note: Takes each fault with what came of it, once that is known.
        kills_until_s: Nobody is killed after that [s].
        until_s: No fault comes after that [s].
    """

    def __init__(
        self,
        node: Any,
        person: PersonSpec,
        supervisor: Supervisor,
        plan: FaultPlan,
        note: Callable[[Happening], None],
        *,
        kills_until_s: float,
        until_s: float,
    ) -> None:
        self._node, self._person, self._supervisor = node, person, supervisor
        self._plan, self._note = plan, note
        self._kills_until_s, self._until_s = kills_until_s, until_s
        self._publisher = node.create_publisher(HumanArm, f"humans/bodies/{person.id}/arm", SENSOR)
        self._next: Fault | None = plan.next()
        self._free_s = 0.0
        self._next_sample_s = 0.0
        self.happening: Happening | None = None

    def begin(self, now_s: float) -> None:
        """From now on faults may come."""
        self._free_s = now_s

    # ------------------------------------------------------------------ turns
    def turn(
        self, now_s: float, now_ns: int, motion_s: float | None, *, moving: bool, well: bool
    ) -> Fault | None:
        """What is to be done now.

        Args:
            now_s: Time since the begin of the soak [s].
            now_ns: ROS time [ns].
            motion_s: Since when a goal is under way [s]; none: none is.
            moving: Whether the robot moves.
            well: Whether all nodes are ready.

        Returns:
            A fault about goals that has come: the caller carries it out.
        """
        if self.happening is not None:
            self._go_on(self.happening, now_s, now_ns)
            return None
        fault = self._next
        if fault is None or now_s > self._until_s:
            return None
        if fault.kind == KILL and now_s > self._kills_until_s:
            self._next = self._plan.next(kills=False)
            return None
        due = now_s - self._free_s >= fault.wait_s
        if not (due and well and motion_s is not None and motion_s >= fault.into_motion_s):
            return None
        self._next = self._plan.next(kills=now_s <= self._kills_until_s)
        happening = Happening(fault, now_s, moving, RestWatch(now_ns, moving=moving))
        self.happening = happening
        if fault.kind == KILL:
            self._supervisor.kill(fault.node)
            happening.over_s = now_s
        elif fault.kind == PAUSE:
            self._supervisor.send(fault.node, signal.SIGSTOP)
        elif fault.kind in GOALS:
            happening.over_s = now_s
            return fault
        return None

    def _go_on(self, happening: Happening, now_s: float, now_ns: int) -> None:
        fault = happening.fault
        if happening.over_s is None:
            if now_s - happening.at_s >= fault.seconds:
                self._end_cause(happening, now_s)
            elif fault.kind in MOCAP and now_s >= self._next_sample_s:
                self._next_sample_s = now_s + PERIOD_S
                self._send(fault.kind, now_ns)
        elif fault.kind == KILL and happening.ready_s is None:
            return
        elif happening.reached_s is not None and happening.rest.over(now_ns):
            self._close(now_s)

    def _end_cause(self, happening: Happening, now_s: float) -> None:
        happening.over_s = now_s
        if happening.fault.kind == PAUSE:
            self._supervisor.send(happening.fault.node, signal.SIGCONT)

    def _send(self, kind: str, now_ns: int) -> None:
        sample = mad_sample(kind, self._person)
        stamp = to_time(now_ns - sample.back_ns)
        self._publisher.publish(
            HumanArm(
                header=Header(stamp=stamp, frame_id=sample.frame or WORLD),
                body_id=self._person.id,
                side=self._person.side,
                keypoints=sample.keypoints.ravel(),
                valid=[True] * 4,
            )
        )

    def _close(self, now_s: float) -> None:
        assert self.happening is not None
        self._note(self.happening)
        self.happening = None
        self._free_s = now_s

    # ------------------------------------------------------------------ what comes of them
    def joints(self, stamp_ns: int, speed: float) -> None:
        """The robot's largest joint speed at a time [rad/s]."""
        if self.happening is not None:
            self.happening.rest.hear(stamp_ns, speed)

    def died(self, label: str) -> bool:
        """A node has died; whether it was killed here."""
        happening = self.happening
        if happening is None or happening.fault.kind != KILL or happening.seen_dead:
            return False
        if happening.fault.node != label:
            return False
        happening.seen_dead = True
        return True

    def told(self, text: str, now_s: float) -> None:
        """Something was said to the user: it may be that the killed node was ended."""
        happening = self.happening
        if happening is None or happening.fault.kind != KILL or happening.named_ms is not None:
            return
        if text.startswith(f"node {happening.fault.node} was ended by"):
            happening.named_ms = round((now_s - happening.at_s) * 1e3, 1)

    def ready(self, now_s: float) -> None:
        """All nodes are ready again."""
        if self.happening is not None and self.happening.fault.kind == KILL:
            self.happening.ready_s = round(now_s - self.happening.at_s, 2)

    def goals_ended(self, *outcomes: str) -> None:
        """How goals ended that the fault is about, the one that was under way first."""
        assert self.happening is not None
        wanted = WANTED[self.happening.fault.kind]
        self.happening.as_wanted = len(outcomes) == len(wanted) and all(
            outcome in allowed for outcome, allowed in zip(outcomes, wanted, strict=True)
        )
        self.happening.outcomes += outcomes

    def reach_over(self, outcome: str, now_s: float) -> None:
        """A reach that no fault about goals has changed has ended."""
        happening = self.happening
        if happening is None or happening.reached_s is not None:
            return
        happening.outcomes.append(outcome)
        if outcome == "reached" and happening.over_s is not None:
            happening.reached_s = round(now_s - happening.at_s, 2)

    def end(self, now_s: float) -> None:
        """The soak is over: nothing stands still any more, and what is not over yet is noted so."""
        if self.happening is not None:
            if self.happening.over_s is None:
                self._end_cause(self.happening, now_s)
            self._close(now_s)
