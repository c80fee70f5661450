"""Who is tracked, as a source of motion capture says: when it changes, and again and again."""

from __future__ import annotations

from collections.abc import Iterable

from std_msgs.msg import Header

from hri_prediction.beat import Beat
from hri_prediction.ros.conversions import WORLD
from hri_prediction.ros.messages import IdsList
from hri_prediction.ros.node import HriNode
from hri_prediction.ros.qos import LATCHED
from hri_prediction.ros.time import to_ns, to_time
from hri_prediction.tracked_lists import TrackedLists

TRACKED = "humans/bodies/tracked"
SAID_AGAIN_NS = 40_000_000
"""So often a list is said [ns]: who listens is to notice when its source is dead or hangs."""


class TrackedList:
    """The list of a source.

    Its stamp is of when the list became so: those who listen tell the lists of several sources apart by it,
    and take them together.

    Args:
        node: Publishes, and calls :meth:`say` with its ticks.
        ids: Of the bodies; said at once.
    """

    def __init__(self, node: HriNode, ids: Iterable[str]) -> None:
        self._node = node
        self._beat = Beat(SAID_AGAIN_NS)
        self._publisher = node.announce(IdsList, TRACKED, LATCHED)
        self.change(ids)

    def change(self, ids: Iterable[str]) -> None:
        """From now on these are tracked; said at once."""
        self._ids, self._said_ns = list(ids), self._node.now_ns()
        self._beat.at_once(self._said_ns)
        self.say(self._said_ns)

    def say(self, now_ns: int) -> None:
        """Say it again, if it is time."""
        if not self._beat.due(now_ns):
            return
        header = Header(stamp=to_time(self._said_ns), frame_id=WORLD)
        self._publisher.publish(IdsList(header=header, ids=self._ids))


def take_list(lists: TrackedLists, message: IdsList, now_ns: int) -> None:
    """Take what a source says.

    Args:
        lists: Of all sources.
        message: What one says.
        now_ns: When it was heard [ns].
    """
    lists.heard(to_ns(message.header.stamp), message.ids, now_ns)
