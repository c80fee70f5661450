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
from rclpy.qos import HistoryPolicy, QoSProfile

from hri_prediction.errors import GraphError
from hri_prediction.ros.node import HriNode
from hri_prediction.ros.qos import LATCHED
from hri_prediction.ros.time import seconds_to_ns

LOG_DEPTH = 200
"""Messages of a topic that the log may be behind: it loses nothing of what is made up for in one tick."""


class TopicLog(Node):
    """Keeps the serialized messages of every counted topic, in order.

    Not logged: /diagnostics, which carries wall-clock figures, and ROS's own topics.

    Attributes:
        messages: Topic to list of (time of the step [ns], CDR bytes).
        types: Topic to message class.
        received: Topic to number of messages, as nodes have it.
    """

    def __init__(self, context: Context) -> None:
        super().__init__("topic_log", context=context, start_parameter_services=False)
        self.messages: dict[str, list[tuple[int, bytes]]] = {}
        self.types: dict[str, Any] = {}
        self.received: dict[str, int] = {}
        self.now_ns = 0

    def watch(self, topic: str, message_type: Any, qos: Any) -> None:
        """Start to keep a topic."""
        if topic in self.messages:
            return
        self.messages[topic] = []
        self.types[topic] = message_type
        self.received[topic] = 0

        def store(data: bytes) -> None:
            self.received[topic] += 1
            self.messages[topic].append((self.now_ns, bytes(data)))

        deep = QoSProfile(
            history=HistoryPolicy.KEEP_LAST,
            depth=max(qos.depth, LOG_DEPTH),
            reliability=qos.reliability,
            durability=qos.durability,
        )
        self.create_subscription(message_type, topic, store, deep, raw=True)


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
        self._start_ns = start_ns
        self._outside: dict[str, int] = defaultdict(int)
        self._periods: dict[HriNode, int] = {}
        self._known = -1  # changes of topics up to which all have found each other
        # What was said on a topic before somebody began to listen to it, who will never get it.
        self._missed: dict[tuple[Node, str], int] = {}
        self._depths: dict[tuple[Node, str], int] = {}
        # Who listens to a topic, and how much of it all of them have, as long as nobody comes or goes.
        self._listening: dict[str, list[HriNode | TopicLog]] = {}
        self._delivered: dict[str, int] = {}
        for node in self.nodes:
            period = seconds_to_ns(node.period_s)
            if period <= 0 or period % self.step_ns:
                raise GraphError(
                    f"node {node.get_name()} has a period of {node.period_s} s",
                    expected=f"a multiple of the base step, {step_s} s",
                )
            self._periods[node] = period
        self.log = TopicLog(context)
        self.executor = EventsExecutor(context=context)
        for node in self._all():
            self.executor.add_node(node)
        try:
            self._discover()
            self._deliver()
        except GraphError:
            self.executor.shutdown()
            self.log.destroy_node()
            raise

    def _all(self) -> list[HriNode | TopicLog]:
        return [*self.nodes, self.log]

    def _listeners(self, topic: str) -> list[HriNode | TopicLog]:
        found = self._listening.get(topic)
        if found is None:
            found = [node for node in self._all() if topic in node.received]
            self._listening[topic] = found
        return found

    def _forget_listeners(self) -> None:
        self._listening.clear()
        self._delivered.clear()

    def _discover(self) -> None:
        """Wait until every publisher sees all of its subscribers, also those made on the way."""
        known = sum(node.topic_changes for node in self.nodes)
        if known + len(self.log.received) == self._known:
            return
        self._forget_listeners()
        for node in self.nodes:
            for topic, publisher in node.publishers_by_topic.items():
                self.log.watch(topic, publisher.message_type, publisher.qos)
        pairs = {(node, topic) for node in self._all() for topic in node.received}
        publishers = [
            (node, publisher)
            for node in self.nodes
            for publisher in node.publishers_by_topic.values()
        ]
        self._known = known + len(self.log.received)
        deadline = time.monotonic() + self.timeout_s
        for node, publisher in publishers:
            listeners = self._listeners(publisher.topic)
            while publisher.subscription_count < len(listeners):
                self.executor.spin_once(timeout_sec=0.005)
                if time.monotonic() > deadline:
                    names = ", ".join(listener.get_name() for listener in listeners)
                    raise GraphError(
                        f"{publisher.topic} of node {node.get_name()} has "
                        f"{publisher.subscription_count} subscribers after {self.timeout_s} s",
                        expected=f"{len(listeners)}: {names}",
                        hint="check that publisher and subscribers have matching QoS",
                    )
        # Who has stopped listening begins anew when it does so again.
        self._missed = {pair: count for pair, count in self._missed.items() if pair in pairs}
        for listener, topic in pairs - self._missed.keys():
            self._missed[listener, topic] = self._lost(topic)
        self._depths = {
            (listener, subscription.topic_name): subscription.qos_profile.depth
            for listener in self._all()
            for subscription in listener.subscriptions
        }

    def _lost(self, topic: str) -> int:
        """How much of what has been said on a topic somebody who joins now will not get."""
        lost = self._outside[topic]
        for node in self.nodes:
            publisher = node.publishers_by_topic.get(topic)
            if publisher is not None:
                latched = publisher.qos.durability == LATCHED.durability
                lost += max(publisher.sent - (publisher.qos.depth if latched else 0), 0)
            lost += node.withdrawn.get(topic, 0)
        return lost

    def _sent(self) -> dict[str, int]:
        sent: dict[str, int] = defaultdict(int, self._outside)
        for node in self.nodes:
            for topic, count in _said(node).items():
                sent[topic] += count
        return sent

    def _deliver(self) -> None:
        """Spin until everything that was sent has been received everywhere.

        A queue keeps the newest only, as it does in a graph of processes: of more messages than it is deep,
        sent in one tick (a simulator that makes up for a jump of time), the first are not waited for.
        """
        deadline = time.monotonic() + self.timeout_s
        sent = {
            topic: count
            for topic, count in self._sent().items()
            if self._delivered.get(topic) != count
        }
        for topic, count in sent.items():
            for node in self._listeners(topic):
                waiting = count - self._missed[node, topic] - node.received[topic]
                self._missed[node, topic] += max(waiting - self._depths[node, topic], 0)
        for topic, count in sent.items():
            for node in self._listeners(topic):
                wanted = count - self._missed[node, topic]
                # Who has stopped listening meanwhile has all that it wants.
                while node.received.get(topic, wanted) < wanted:
                    self._spin(deadline, node, topic, wanted)
            self._delivered[topic] = count

    def _spin(self, deadline: float, node: HriNode | TopicLog, topic: str, wanted: int) -> None:
        self.executor.spin_once(timeout_sec=0.01)
        if time.monotonic() > deadline:
            raise GraphError(
                f"node {node.get_name()} has {node.received[topic]} messages of {topic} after "
                f"{self.timeout_s} s",
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
        for node in self.nodes:
            if not node.settled():
                self.spin_until(node.settled, f"what node {node.get_name()} has asked for")

    def shift(self, ns: int) -> None:
        """Let the time jump, by whole steps; nodes tick at the same intervals as before.

        Args:
            ns: Forwards, or, below zero, back [ns].
        """
        whole = round(ns / self.step_ns) * self.step_ns
        self.now_ns += whole
        self._start_ns += whole

    def spin_until(self, done: Any, what: str) -> None:
        """Let services and actions proceed, with the time standing still, until ``done()``.

        What nodes publish in doing so is delivered before the time goes on.

        Raises:
            GraphError: when it does not happen within the timeout.
        """
        deadline = time.monotonic() + self.timeout_s
        while not done():
            self.executor.spin_once(timeout_sec=0.01)
            if time.monotonic() > deadline:
                raise GraphError(f"{what} did not happen within {self.timeout_s} s")
        self._discover()
        self._deliver()

    def watch(self, topic: str, message_type: Any, qos: Any) -> None:
        """Log a topic on which something else than the graph's nodes is going to publish."""
        self.log.watch(topic, message_type, qos)
        self._discover()

    def outside(self, topic: str) -> None:
        """Count one message that was published by something else than the graph's nodes."""
        self._outside[topic] += 1
        self._deliver()

    def remove(self, node: HriNode) -> None:
        """Take a node out, as if its process had been killed: nothing of it is said any more."""
        self._deliver()
        for topic, count in _said(node).items():
            self._outside[topic] += count
        self.nodes.remove(node)
        self._known = -1
        self._forget_listeners()
        self._missed = {pair: count for pair, count in self._missed.items() if pair[0] is not node}
        self.executor.remove_node(node)
        node.close()
        node.destroy_node()

    def close(self) -> None:
        """Destroy the nodes and the executor."""
        for node in self.nodes:
            node.close()
        self.executor.shutdown()
        for node in self._all():
            node.destroy_node()


def _said(node: HriNode) -> dict[str, int]:
    """How many messages a node has sent on each topic, also by publishers that it has withdrawn."""
    said = defaultdict(int, node.withdrawn)
    for topic, publisher in node.publishers_by_topic.items():
        said[topic] += publisher.sent
    return said
