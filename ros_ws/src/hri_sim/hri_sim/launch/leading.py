"""Moves the goal of the motion that is under way."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
from geometry_msgs.msg import PoseStamped
from numpy.typing import NDArray

from hri_prediction.ros.conversions import WORLD
from hri_prediction.ros.messages import HumanArm
from hri_prediction.ros.qos import SENSOR, reliable
from hri_prediction.ros.time import to_time
from hri_sim.launch.moving_goals import Leader
from hri_sim.scenario.schema import Scenario

FloatArray = NDArray[np.float64]

GOAL_PERIOD_S = 0.02
"""Time between two places of a goal that moves [s]."""


class Leading:
    """Publishes where a goal is that moves.

    Args:
        node: Says it.
        topic: Where.
        scenario: What is conducted.
        leader: Knows where goals are; none: all stay, and nothing is said.

    Attributes:
        place: Where the present goal has moved to [m]; none while it has not.
    """

    def __init__(self, node: Any, topic: str, scenario: Scenario, leader: Leader | None) -> None:
        self._node = node
        self._scenario = scenario
        self._leader = leader
        self._hands: dict[str, FloatArray] = {}
        self._persons = {person.id: person for person in scenario.persons}
        self._next_s = 0.0
        self.place: tuple[float, float, float] | None = None
        if leader is None:
            return
        self._goals = node.create_publisher(PoseStamped, topic, reliable(1))
        for person in scenario.persons:
            arm = f"humans/bodies/{person.id}/arm"
            node.create_subscription(HumanArm, arm, self._on_arm, SENSOR)

    def _on_arm(self, message: HumanArm) -> None:
        # Goals follow the hand that reaches.
        person = self._persons.get(message.body_id)
        if message.valid[3] and person is not None and person.reaches_with(message.side):
            self._hands[message.body_id] = np.array(message.keypoints[9:])

    def begin(self) -> None:
        """A motion begins; its goal has not moved."""
        self.place = None

    def lead(self, index: int, elapsed_s: float) -> None:
        """Say where the goal of a reach is, so long after its begin [s], if that is due."""
        now_s = time.monotonic()
        if self._leader is None or now_s < self._next_s:
            return
        self._next_s = now_s + GOAL_PERIOD_S
        place = self._leader(index, elapsed_s, self._hands.get(self._scenario.person_of(index).id))
        if place is None:
            return
        x, y, z = (float(value) for value in place)
        self.place = (x, y, z)
        message = PoseStamped()
        message.header.stamp = to_time(int(self._node.get_clock().now().nanoseconds))
        message.header.frame_id = WORLD
        position = message.pose.position
        position.x, position.y, position.z = x, y, z
        self._goals.publish(message)
