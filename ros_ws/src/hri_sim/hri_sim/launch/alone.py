"""Whether another graph is there already: two of them would hear each other."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

from rclpy.node import Node

from hri_prediction.errors import GraphError

DISCOVERY_S = 1.0
"""How long to look for another graph before the start [s]."""


def check_alone(node: Node, turn: Callable[[], None], labels: Sequence[str]) -> None:
    """Make sure that no other graph is on this ROS domain.

    Args:
        node: Looks.
        turn: Lets messages in for a moment.
        labels: Nodes that are about to be started.

    Raises:
        GraphError: when one of them is there already.
    """
    end = time.monotonic() + DISCOVERY_S
    while time.monotonic() < end:
        turn()
        present = sorted(set(labels) & set(node.get_node_names()))
        if present:
            raise GraphError(
                f"another graph is running in ROS domain {node.context.get_domain_id()}: "
                f"{', '.join(present)}",
                hint="stop it, or set ROS_DOMAIN_ID to another number for one of the two",
            )
