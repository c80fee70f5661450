"""How fast the robot may be, said again and again by whoever moves it, until a separation monitor runs."""

from __future__ import annotations

from std_msgs.msg import Float64

from hri_prediction.ros.node import HriNode
from hri_prediction.ros.qos import reliable

SPEED_SCALE = "separation/speed_scale"
SEPARATION_STATUS = "separation/status"
"""Topic of a separation monitor: whoever publishes it is one."""
LOOKING = 5
"""Beats from one look for a monitor to the next; a count needs no clock, which may go back."""


class Heartbeat:
    """The speed scale of a node that moves the robot.

    The robot goes as long as anybody says anything, and where the controller has no `heartbeat_timeout` as
    fast as the last one said: beside a monitor, this would overrule it, and keep the robot going when the
    monitor dies. As soon as there is one it says nothing
    any more, for good: a monitor that has ended stops the robot.

    Args:
        node: Publishes.
        wanted: Whether to say anything at all.
    """

    def __init__(self, node: HriNode, *, wanted: bool) -> None:
        self._node = node
        self._publisher = node.announce(Float64, SPEED_SCALE, reliable(1)) if wanted else None
        self._beats, self._left = 0, False

    def say(self, scale: float) -> None:
        """Say that the robot may go on, unless that is a monitor's business."""
        if self._publisher is None:
            return
        look = self._beats % LOOKING == 0
        self._beats += 1
        if look and self._monitored():
            self._node.withdraw(self._publisher)
            self._publisher, self._left = None, True
            self._node.get_logger().warning(
                f"a separation monitor runs: it alone publishes /{SPEED_SCALE} from now on; when it ends "
                "the robot stops, until this node is started again without it"
            )
            return
        self._publisher.publish(Float64(data=scale))

    def trouble(self) -> str:
        """Why the robot stands: the monitor is gone; empty when that is not why."""
        if self._left and not self._monitored():
            return "the separation monitor that this node left the speed scale to has ended"
        return ""

    def _monitored(self) -> bool:
        return self._node.count_publishers(self._node.resolve_topic_name(SEPARATION_STATUS)) > 0
