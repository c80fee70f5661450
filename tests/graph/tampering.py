"""Nodes as a user would write them: they spoil the motion capture, add bodies, slow the robot."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from std_msgs.msg import Float64, Header

from hri_prediction.ros.messages import HumanArm, IdsList
from hri_prediction.ros.node import CountedPublisher, HriNode
from hri_prediction.ros.qos import LATCHED, SENSOR, reliable
from hri_prediction.ros.time import NANO, to_ns, to_time

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
        self._ids = self.announce(IdsList, "humans/bodies/tracked", LATCHED)
        self._arm = self.announce(HumanArm, "humans/bodies/bystander/arm", SENSOR)
        self._said = False

    def on_tick(self, now_ns: int) -> None:
        header = Header(stamp=to_time(now_ns), frame_id="world")
        if not self._said:
            self._said = True
            self._ids.publish(IdsList(header=header, ids=["person1", "bystander"]))
        self._arm.publish(
            HumanArm(
                header=header,
                body_id="bystander",
                side="left",
                keypoints=self._keypoints.ravel(),
                valid=[True] * 4,
            )
        )


class Monitor(HriNode):
    """Stands in for a separation monitor: what it says of the robot's speed is the heartbeat.

    Attributes:
        scale: Said every 4 ms, 0 to 1.
    """

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("monitor", period_s=0.004, **kwargs)
        self.scale = 1.0
        self._said = self.announce(Float64, "separation/speed_scale", reliable(1))

    def on_tick(self, now_ns: int) -> None:
        self._said.publish(Float64(data=self.scale))


class Tracker(HriNode):
    """A tracker that gives whoever reappears a new id."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("tracker", period_s=0.004, **kwargs)
        self._ids = self.announce(IdsList, "humans/bodies/tracked", LATCHED)
        self._arms: dict[str, CountedPublisher] = {}

    def see(self, *ids: str) -> None:
        """From now on these and no others are tracked, all in the same place."""
        for body_id in self._arms.keys() - set(ids):
            self.withdraw(self._arms.pop(body_id))
        for body_id in set(ids) - self._arms.keys():
            self._arms[body_id] = self.announce(HumanArm, f"humans/bodies/{body_id}/arm", SENSOR)
        self._ids.publish(IdsList(ids=list(ids)))

    def on_tick(self, now_ns: int) -> None:
        header = Header(stamp=to_time(now_ns), frame_id="world")
        points = STILL.ravel()
        for body_id, arm in self._arms.items():
            arm.publish(
                HumanArm(
                    header=header,
                    body_id=body_id,
                    side="left",
                    keypoints=points,
                    valid=[True] * 4,
                )
            )
