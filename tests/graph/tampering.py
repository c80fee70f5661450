"""Nodes as a user would write them: they command the robot's speed, track two arms, and rename people."""

from __future__ import annotations

from typing import Any

import numpy as np
from std_msgs.msg import Float64, Header

from hri_prediction.ros.messages import HumanArm, IdsList
from hri_prediction.ros.node import CountedPublisher, HriNode
from hri_prediction.ros.qos import LATCHED, SENSOR, reliable
from hri_prediction.ros.time import to_time
from hri_sim.testing.spoiling import STILL


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


class BothArms(HriNode):
    """Motion capture of one person with two arms that keep still.

    Attributes:
        seen: Keypoints (4, 3) [m] of the arms that are said every 4 ms, by side.
    """

    def __init__(self, seen: dict[str, np.ndarray], body_id: str = "ann", **kwargs: Any) -> None:
        super().__init__("both_arms", period_s=0.004, **kwargs)
        self.seen = dict(seen)
        self._body_id = body_id
        self._arms = self.announce(HumanArm, f"humans/bodies/{body_id}/arm", SENSOR)
        self._ids = self.announce(IdsList, "humans/bodies/tracked", LATCHED)
        self._ids.publish(IdsList(ids=[body_id]))

    def on_tick(self, now_ns: int) -> None:
        for side, keypoints in self.seen.items():
            self._arms.publish(
                HumanArm(
                    header=Header(stamp=to_time(now_ns), frame_id="world"),
                    body_id=self._body_id,
                    side=side,
                    keypoints=keypoints.ravel(),
                    valid=[True] * 4,
                )
            )


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
