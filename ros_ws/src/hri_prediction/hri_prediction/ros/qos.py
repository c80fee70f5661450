"""Quality-of-service profiles of the graph, by the names used in the documentation."""

from __future__ import annotations

from copy import copy

from rclpy.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    QoSProfile,
    ReliabilityPolicy,
)

from hri_prediction.arm.geometry import SIDES

SENSOR = QoSProfile(
    history=HistoryPolicy.KEEP_LAST, depth=50, reliability=ReliabilityPolicy.BEST_EFFORT
)
"""Sensor data: best effort. Deeper than ROS's preset so that a busy subscriber loses nothing for 0.2 s."""

LATCHED = QoSProfile(
    history=HistoryPolicy.KEEP_LAST,
    depth=1,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
)
"""The newest value, also for those who join late."""

LISTS = copy(LATCHED)
"""The same for who listens to what is said again and again: one that is held up for a while drops none."""
LISTS.depth = 10


def reliable(depth: int) -> QoSProfile:
    """Reliable, volatile, keep the last ``depth``."""
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST, depth=depth, reliability=ReliabilityPolicy.RELIABLE
    )


PREDICTIONS = reliable(len(SIDES))
"""The newest prediction of each arm of a body: on their common topic neither pushes the other out."""
