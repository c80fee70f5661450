"""One topic that is recorded: its subscription, what was offered, and what became of its messages."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.subscription import Subscription

from hri_prediction.bags.metadata import INFINITE_NS, OfferedQos, TopicInfo
from hri_sim.recording.recorder_core import RecorderCore
from hri_sim.recording.sequence import SequenceGaps


class RecordedTopic:
    """One topic: its subscription, and the callback that queues its messages.

    Args:
        core: Takes the messages.
        info: Name, type, QoS.
        log_time: Gives the time of log and sending [ns]; None: as the middleware says.
        publishers: How many publish on it.
    """

    def __init__(
        self,
        core: RecorderCore,
        info: TopicInfo,
        log_time: Callable[[], int] | None,
        publishers: int,
    ) -> None:
        self.info = info
        self.number = core.add_topic(info)
        self.subscription: Subscription | None = None
        self.qos: tuple[ReliabilityPolicy, DurabilityPolicy] | None = None
        self.gaps = SequenceGaps(publishers)
        self.received = 0
        self._push = core.push
        self._log_time = log_time

    def take(self, taken: Any, info: dict[str, Any] | None = None) -> None:
        """Queue one message.

        The events executor, on simulated time, hands (message, info) over as one argument, others as two.
        """
        data, info = taken if info is None else (taken, info)
        self.received += 1
        sequence = info["publication_sequence_number"] or 0
        if self._log_time is None:
            log_ns, publish_ns = info["received_timestamp"], info["source_timestamp"]
        else:
            log_ns = publish_ns = self._log_time()
        self.gaps.take(sequence)
        self._push(self.number, data, log_ns, publish_ns, sequence)


def offered_qos(profile: QoSProfile) -> OfferedQos:
    """What a publisher offers, in rosbag2's words."""
    return OfferedQos(
        history=profile.history.name.lower(),
        depth=profile.depth,
        reliability=profile.reliability.name.lower(),
        durability=profile.durability.name.lower(),
        deadline_ns=_finite(profile.deadline.nanoseconds),
        lifespan_ns=_finite(profile.lifespan.nanoseconds),
        liveliness=profile.liveliness.name.lower(),
        liveliness_lease_ns=_finite(profile.liveliness_lease_duration.nanoseconds),
        avoid_ros_namespace_conventions=profile.avoid_ros_namespace_conventions,
    )


def _finite(nanoseconds: int) -> int:
    return min(nanoseconds, INFINITE_NS)
