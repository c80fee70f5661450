"""Lock-step: all nodes in one executor, time advanced by counting messages, not by waiting.

Spinning "until idle" loses messages: the middleware delivers on its own threads. So the coordinator
knows how many messages every node has sent on a topic and spins until every listener has that many.
Only then does the next node tick.
"""

from __future__ import annotations

import time
from collections import defaultdict
from collections.abc import Sequence
from typing import Any

from rclpy.context import Context
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node

from hri_prediction.errors import GraphError
from hri_prediction.ros.node import HriNode
from hri_prediction.ros.qos import LATCHED
from hri_prediction.ros.time import seconds_to_ns

class TopicLog(Node):
    """Keeps the serialized messages of every counted topic, in order.

    Not logged: /diagnostics, which carries wall-clock figures, and ROS's own topics.

    Attributes:
        messages: Topic to list of (time of the step [ns], CDR bytes).
        types: Topic to message class.
    """

    def __init__(self, context: Context) -> None:
        super().__init__("topic_log", context=context, start_parameter_services=False)
        self.messages: dict[str, list[tuple[int, bytes]]] = {}
        self.types: dict[str, Any] = {}
        self.now_ns = 0

    def watch(self, topic: str, message_type: Any, qos: Any) -> None:
        """Start to keep a topic."""
        if topic in self.messages:
            return
        self.messages[topic] = []
        self.types[topic] = message_type
        self.create_subscription(
            message_type,
            topic,
            lambda data: self.messages[topic].append((self.now_ns, bytes(data))),
            qos,
            raw=True,
        )


class LockStep:
    """Coordinator of nodes that tick on multiples of a base step.

    Args:
        nodes: In the order in which they tick within a step: sources before sinks.
        context: Their rclpy context.
        start_ns: Time before the first step [ns].
        step_s: Base step [s]; every node's period must be a multiple of it.
        timeout_s: Wall time after which a message that does not arrive is an error [s].

    Raises:
        GraphError: when a period is no multiple of the step, or a subscription is not discovered.
    """

    def __init__(
        self,
        nodes: Sequence[HriNode],
        *,
        context: Context,
        start_ns: int = 1_000_000_000,
        step_s: float = 0.004,
        timeout_s: float = 10.0,
    ) -> None:
        self.nodes = list(nodes)
        self.now_ns = start_ns
        self.step_ns = seconds_to_ns(step_s)
        self.timeout_s = timeout_s
        self.log = TopicLog(context)
        self._start_ns = start_ns
        self._outside: dict[str, int] = defaultdict(int)
        self._periods: dict[HriNode, int] = {}
        # What was said on a topic before a node began to listen to it, which it will never get.
        self._missed: dict[tuple[HriNode, str], int] = {}
        self.executor = EventsExecutor(context=context)
        for node in self.nodes:
            period = seconds_to_ns(node.period_s)
            if period <= 0 or period % self.step_ns:
                raise GraphError(
                    f"node {node.get_name()} has a period of {node.period_s} s",
                    expected=f"a multiple of the base step, {step_s} s",
                )
            self._periods[node] = period
            self.executor.add_node(node)
        self.executor.add_node(self.log)
        self._discover()
        self._deliver()

    def _listeners(self, topic: str) -> list[HriNode]:
        return [node for node in self.nodes if topic in node.received]

    def _discover(self) -> None:
        """Wait until every publisher sees all of its subscribers, also those made on the way."""
        pairs = {(node, topic) for node in self.nodes for topic in node.received}
        announced = {topic for node in self.nodes for topic in node.publishers_by_topic}
        if pairs == self._missed.keys() and announced <= self.log.messages.keys():
            return
        for node in self.nodes:
            for topic, publisher in node.publishers_by_topic.items():
                self.log.watch(topic, publisher.message_type, publisher.qos)
        deadline = time.monotonic() + self.timeout_s
        for node in self.nodes:
            for topic, publisher in node.publishers_by_topic.items():
                wanted = 1 + len(self._listeners(topic))
                while publisher.subscription_count < wanted:
                    self.executor.spin_once(timeout_sec=0.005)
                    if time.monotonic() > deadline:
                        raise GraphError(
                            f"{topic} of node {node.get_name()} has "
                            f"{publisher.subscription_count} subscribers after {self.timeout_s} s",
                            expected=f"{wanted}",
                            hint="check that publisher and subscribers have matching QoS",
                        )
        sent = self._sent()
        for node, topic in pairs - self._missed.keys():
            publishers = [n.publishers_by_topic.get(topic) for n in self.nodes]
            latched = any(p.qos.durability == LATCHED.durability for p in publishers if p)
            self._missed[node, topic] = 0 if latched else sent[topic]

    def _sent(self) -> dict[str, int]:
        sent: dict[str, int] = defaultdict(int, self._outside)
        for node in self.nodes:
            for topic, publisher in node.publishers_by_topic.items():
                sent[topic] += publisher.sent
        return sent

    def _deliver(self) -> None:
        """Spin until everything that was sent has been received everywhere."""
        deadline = time.monotonic() + self.timeout_s
        for topic, count in self._sent().items():
            if topic in self.log.messages:
                self._deliver_log(deadline, topic, count)
            for node in self._listeners(topic):
                wanted = count - self._missed[node, topic]
                while node.received[topic] < wanted:
                    self._spin(deadline, node.get_name(), topic, node.received[topic], wanted)

    def _deliver_log(self, deadline: float, topic: str, count: int) -> None:
        while len(self.log.messages[topic]) < count:
            self._spin(deadline, "topic_log", topic, len(self.log.messages[topic]), count)

    def _spin(self, deadline: float, node: str, topic: str, got: int, wanted: int) -> None:
        self.executor.spin_once(timeout_sec=0.01)
        if time.monotonic() > deadline:
            raise GraphError(
                f"node {node} has {got} messages of {topic} after {self.timeout_s} s",
                expected=f"{wanted}",
                hint="a callback is blocked, or the queue of this subscription is too short",
            )

    def step(self) -> None:
        """Advance the time by one base step; each node whose period is due ticks once."""
        self.now_ns += self.step_ns
        self.log.now_ns = self.now_ns
        for node in list(self.nodes):
            if (self.now_ns - self._start_ns) % self._periods[node] == 0:
                node.tick(self.now_ns)
                self._discover()
                self._deliver()

    def spin_until(self, done: Any, what: str) -> None:
        """Let services and actions proceed, with the time standing still, until ``done()``.

        Raises:
            GraphError: when it does not happen within the timeout.
        """
        deadline = time.monotonic() + self.timeout_s
        while not done():
            self.executor.spin_once(timeout_sec=0.01)
            if time.monotonic() > deadline:
                raise GraphError(f"{what} did not happen within {self.timeout_s} s")

    def outside(self, topic: str) -> None:
        """Count one message that was published by something else than the graph's nodes."""
        self._outside[topic] += 1

    def remove(self, node: HriNode) -> None:
        """Take a node out, as if its process had been killed: nothing of it is said any more."""
        for topic, publisher in node.publishers_by_topic.items():
            self._outside[topic] += publisher.sent
        self.nodes.remove(node)
        self._missed = {pair: count for pair, count in self._missed.items() if pair[0] is not node}
        self.executor.remove_node(node)
        node.close()
        node.destroy_node()

    def close(self) -> None:
        """Destroy the nodes and the executor."""
        for node in self.nodes:
            node.close()
        self.executor.shutdown()
        for node in (*self.nodes, self.log):
            node.destroy_node()
