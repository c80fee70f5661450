"""Simulated people as two nodes publish them: truth, tracked arms, and who is tracked."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from hri_prediction.ros.conversions import ArmEncoder
from hri_prediction.ros.messages import HumanArm
from hri_prediction.ros.node import CountedPublisher, HriNode
from hri_prediction.ros.qos import SENSOR
from hri_prediction.ros.time import NANO
from hri_prediction.ros.tracked import TrackedList
from hri_sim.people.capture import Capture, CapturedArm

LONGEST_GAP_NS = 60 * NANO
"""People who were not asked for longer begin anew, as what they did meanwhile takes long to find out."""


class CapturedBodies:
    """Publishes bodies with the ticks of a node.

    Args:
        node: That publishes.
        ids: Of the bodies; these never change.
        people: Makes the arms of the bodies, as they are in the beginning; these bodies have no others.
    """

    def __init__(
        self,
        node: HriNode,
        ids: Sequence[str],
        people: Callable[[], Mapping[str, Sequence[CapturedArm]]],
    ) -> None:
        self._node, self._people = node, people
        self._encoder = ArmEncoder()
        self._truth: dict[str, CountedPublisher] = {}
        self._tracked: dict[str, CountedPublisher] = {}
        for body_id in ids:
            self._truth[body_id] = node.announce(HumanArm, f"sim/bodies/{body_id}/arm", SENSOR)
            self._tracked[body_id] = node.announce(HumanArm, f"humans/bodies/{body_id}/arm", SENSOR)
        self.skipped = 0
        self._begun = False
        self.restart()
        self._list = TrackedList(node, ids)

    def restart(self) -> None:
        """Begin anew."""
        self._last_ns = self._node.now_ns()
        self._capture = Capture(self._people(), self._last_ns)

    def seconds(self, stamp_ns: int) -> float:
        """Time of the people at a stamp [s]."""
        return self._capture.seconds(stamp_ns)

    def tick(self, now_ns: int) -> None:
        """Say the truth, capture it, and deliver what the tracking latency has let through."""
        if not self._begun:
            self._begun = True
            self.restart()
        passed_ns = now_ns - self._last_ns
        if not -NANO <= passed_ns <= LONGEST_GAP_NS:
            way = "back" if passed_ns < 0 else f"on by {passed_ns / NANO:.0f} s"
            self._node.fault("clock", f"the clock went {way}: the people start again")
            self.restart()
        self._last_ns = max(self._last_ns, now_ns)
        self._list.say(now_ns)
        if skipped := self._capture.skip(now_ns):
            self.skipped += skipped
            self._node.fault("late", f"{skipped} captures skipped: this node was held up")
        for body_id, sample in self._capture.truth(now_ns):
            self._truth[body_id].publish(self._encoder.encoded(sample, body_id))
        for body_id, sample in self._capture.tracked(now_ns):
            self._tracked[body_id].publish(self._encoder.encoded(sample, body_id))
