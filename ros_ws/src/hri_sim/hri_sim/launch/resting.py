"""A run that is broken off leaves the stop chain its time before nodes are stopped."""

from __future__ import annotations

import time
from collections.abc import Callable

from rclpy.executors import Executor
from sensor_msgs.msg import JointState

from hri_prediction.ros.polling import PollingNode
from hri_prediction.ros.qos import SENSOR

STOP_S = 0.4
"""Time for the robot to come to rest when a run is broken off [s]."""
LONGEST_STOP_S = 2.0
"""The same for one that still moves after that, on a machine that is busy [s]."""
REST_SPEED = 0.02
"""Joint speed below which the robot counts as at rest [rad/s]."""


def wait_for_rest(node: PollingNode, executor: Executor, cut_short: Callable[[], bool]) -> None:
    """Until the robot has come to rest, or should have.

    Args:
        node: Listens to the joints.
        executor: Has the node.
        cut_short: Whether not to wait any longer.
    """
    fastest = [0.0]

    def note(joints: JointState) -> None:
        fastest[0] = max((abs(speed) for speed in joints.velocity), default=0.0)

    node.poll_topic(JointState, "joint_states", note, SENSOR)
    begin = time.monotonic()
    while not cut_short() and (
        time.monotonic() < begin + STOP_S
        or (fastest[0] > REST_SPEED and time.monotonic() < begin + LONGEST_STOP_S)
    ):
        node.let_in(executor, 0.02)
