"""What a node says when it is ready: the topics, services and actions by which it can be reached."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rclpy.action import get_action_server_names_and_types_by_node

if TYPE_CHECKING:
    from hri_prediction.ros.node import HriNode

_OWN_TYPES = "hri_msgs/"
"""Services of other types are those that every node has, for its parameters."""


def ready_line(node: HriNode) -> str:
    """One line: the node's name, what it listens to, publishes and serves, with remapped names."""
    name, namespace = node.get_name(), node.get_namespace()
    services = node.get_service_names_and_types_by_node(name, namespace)
    actions = get_action_server_names_and_types_by_node(node, name, namespace)
    serves = [
        topic
        for topic, types in (*services, *actions)
        if "/_action/" not in topic and types[0].startswith(_OWN_TYPES)
    ]
    parts = {
        "listens to": list(node.received),
        "publishes": list(node.publishers_by_topic),
        "serves": serves,
    }
    said = [f"{verb} {', '.join(sorted(names))}" for verb, names in parts.items() if names]
    return f"{name} ready: {'; '.join(said)}"
