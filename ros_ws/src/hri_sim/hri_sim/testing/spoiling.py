"""Nodes that make motion capture go wrong, as sources do: for tests, and for the table of faults."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from std_msgs.msg import Header

from hri_prediction.ros.messages import HumanArm
from hri_prediction.ros.node import HriNode
from hri_prediction.ros.qos import SENSOR
from hri_prediction.ros.time import NANO, to_ns, to_time
from hri_prediction.ros.tracked import TrackedList

RAW = "raw/arm"
ARM = "humans/bodies/person1/arm"
REMAP = {"person": {ARM: RAW}}
"""Puts the person's tracked arm where :class:`Tamper` takes it from."""

STILL = np.array([[0.1, 0.9, 0.5], [0.15, 0.65, 0.45], [0.2, 0.40, 0.40], [0.2, 0.31, 0.40]])
"""Keypoints of a left arm that is held still next to the robot [m]."""

Spoil = Callable[[HumanArm], HumanArm | None]


class Tamper(HriNode):
    """Passes the tracked arm on, spoilt for as long as a test wants it."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("tamper", period_s=0.004, **kwargs)
        self._arm = self.announce(HumanArm, ARM, SENSOR)
        self._from_ns = self._until_ns = 0
        self._spoil: Spoil = lambda message: message
        self._ready: list[HumanArm] = []
        self.listen(HumanArm, RAW, self._ready.append, SENSOR)

    def spoil(self, how: Spoil, seconds: float) -> None:
        """From the next sample on, for a time [s]."""
        self._spoil = how
        self._until_ns = self.now_ns() + round(seconds * NANO)

    def on_tick(self, now_ns: int) -> None:
        """Hand on what has come."""
        for message in self._ready:
            spoilt = self._spoil(message) if now_ns <= self._until_ns else message
            if spoilt is not None:
                self._arm.publish(spoilt)
        self._ready.clear()


def blind(message: HumanArm) -> HumanArm:
    """No keypoint is seen."""
    message.keypoints = np.zeros(12)
    message.valid = [False] * 4
    return message


def not_a_number(message: HumanArm) -> HumanArm:
    """NaN, said to be valid, by a source that does not keep the rules."""
    message.keypoints = np.full(12, np.nan)
    message.valid = [True] * 4
    return message


def swapped(message: HumanArm) -> HumanArm:
    """Elbow and wrist are exchanged."""
    points = np.array(message.keypoints).reshape(4, 3)
    message.keypoints = points[[0, 2, 1, 3]].ravel()
    return message


def wrist_jump(message: HumanArm) -> HumanArm:
    """The wrist is half a metre away."""
    points = np.array(message.keypoints).reshape(4, 3)
    points[2] += (0.0, 0.0, 0.5)
    message.keypoints = points.ravel()
    return message


def millimetres(message: HumanArm) -> HumanArm:
    """The source has the wrong unit."""
    message.keypoints = 1000.0 * np.array(message.keypoints)
    return message


def silent(message: HumanArm) -> None:
    """Nothing comes."""


def outliers(rng: np.random.Generator, share: float = 0.1) -> Spoil:
    """A share of the samples has a keypoint that is 0.2 to 2 m away, in any direction."""

    def spoil(message: HumanArm) -> HumanArm:
        if rng.random() < share:
            points = np.array(message.keypoints).reshape(4, 3)
            away = rng.normal(size=3)
            points[rng.integers(4)] += rng.uniform(0.2, 2.0) * away / np.linalg.norm(away)
            message.keypoints = points.ravel()
        return message

    return spoil


def late_and_reordered(rng: np.random.Generator, kept: int = 8) -> Spoil:
    """Samples come up to some tens of milliseconds late, and in any order; none is lost."""
    held: list[HumanArm] = []

    def spoil(message: HumanArm) -> HumanArm | None:
        held.append(message)
        return held.pop(int(rng.integers(kept))) if len(held) > kept else None

    return spoil


def shifted_clock(seconds: float) -> Spoil:
    """The stamps are off by a time [s]."""

    def spoil(message: HumanArm) -> HumanArm:
        message.header.stamp = to_time(to_ns(message.header.stamp) + round(seconds * NANO))
        return message

    return spoil


def in_frame(frame: str) -> Spoil:
    """The frame is another."""

    def spoil(message: HumanArm) -> HumanArm:
        message.header.frame_id = frame
        return message

    return spoil


class Bystander(HriNode):
    """A second tracked body that keeps still."""

    def __init__(self, keypoints: np.ndarray, **kwargs: Any) -> None:
        super().__init__("bystander", period_s=0.004, **kwargs)
        self._keypoints = keypoints
        self._arm = self.announce(HumanArm, "humans/bodies/bystander/arm", SENSOR)
        self._list: TrackedList | None = None

    def on_tick(self, now_ns: int) -> None:
        """Say where the arm is."""
        header = Header(stamp=to_time(now_ns), frame_id="world")
        if self._list is None:
            self._list = TrackedList(self, ["person1", "bystander"])
        self._list.say(now_ns)
        self._arm.publish(
            HumanArm(
                header=header,
                body_id="bystander",
                side="left",
                keypoints=self._keypoints.ravel(),
                valid=[True] * 4,
            )
        )


class EmptyRoom(HriNode):
    """A source that says that nobody is there, or who else is, from when it is told to.

    Attributes:
        says_so: Whether it is told to.
        ids: Of the bodies that it lists from its next tick on.
    """

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("empty_room", period_s=0.02, **kwargs)
        self.says_so = False
        self.ids: list[str] = []
        self._said: list[str] = []
        self._list: TrackedList | None = None

    def on_tick(self, now_ns: int) -> None:
        """Say so."""
        if self.says_so and self._list is None:
            self._list = TrackedList(self, self._said)
        if self._list is not None:
            if self.ids != self._said:
                self._list.change(self.ids)
                self._said = list(self.ids)
            self._list.say(now_ns)
