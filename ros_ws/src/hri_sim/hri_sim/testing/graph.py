"""A graph of nodes in this process, for tests: build, run, command, kill, look at what was said."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from typing import Any

import rclpy
from rclpy.action import ActionClient
from rclpy.context import Context
from rclpy.node import Node
from rclpy.serialization import deserialize_message

from hri_prediction.closing import Closing
from hri_prediction.errors import GraphError
from hri_prediction.ros.messages import ReachTarget
from hri_prediction.ros.node import HriNode
from hri_sim.testing.domain import own_domain
from hri_sim.testing.lockstep import LockStep

NodeFactory = Callable[..., HriNode]


class ReachHandle:
    """A goal that was sent: its acceptance, and its result once there is one.

    Attributes:
        accepted: Whether the node took the goal.
        feedback: Feedback messages so far.
    """

    def __init__(self, goal_handle: Any, feedback: list[Any]) -> None:
        self.accepted = bool(goal_handle.accepted)
        self.feedback = feedback
        self.goal_handle = goal_handle
        self._result = goal_handle.get_result_async() if self.accepted else None

    @property
    def done(self) -> bool:
        """Whether the result has arrived (or the goal was refused)."""
        return self._result is None or self._result.done()

    @property
    def result(self) -> ReachTarget.Result | None:
        """The result, or none while the motion goes on or when the goal was refused."""
        if self._result is None or not self._result.done():
            return None
        return self._result.result().result


class Graph(Closing):
    """Nodes in one context and one executor, advanced in lock-step.

    Args:
        factories: Callables ``f(context=…, lockstep_ns=…) -> HriNode``, in ticking order.
        start_s: Time before the first step [s].
        step_s: Base step [s].
        domain_id: ROS domain; by default one that is this process' own, so that parallel test
            runs do not hear each other.
        timeout_s: Wall time after which a message that does not arrive is an error [s].

    Raises:
        GraphError: when a node's period does not fit, or a subscription not its publisher.
        HriError: what a factory raises; the nodes made before it are destroyed.

    Attributes:
        nodes: By name.
    """

    def __init__(
        self,
        factories: Sequence[NodeFactory],
        *,
        start_s: float = 1.0,
        step_s: float = 0.004,
        domain_id: int | None = None,
        timeout_s: float = 10.0,
    ) -> None:
        os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
        self.context = Context()
        rclpy.init(context=self.context, domain_id=domain_id or own_domain())
        start_ns = round(start_s * 1e9)
        made: list[HriNode] = []
        try:
            for factory in factories:
                made.append(factory(context=self.context, lockstep_ns=start_ns))
            self.lockstep = LockStep(
                made, context=self.context, start_ns=start_ns, step_s=step_s, timeout_s=timeout_s
            )
        except BaseException:
            for node in made:
                node.close()
                node.destroy_node()
            rclpy.try_shutdown(context=self.context)
            raise
        self.nodes: dict[str, HriNode] = {node.get_name(): node for node in made}
        self._client_node = Node("test_client", context=self.context)
        self.lockstep.executor.add_node(self._client_node)
        self._clients: dict[str, ActionClient] = {}
        self._decoded: dict[str, list[Any]] = {}

    def close(self) -> None:
        """Destroy everything; further calls do nothing."""
        if not self.context.ok():
            return
        for client in self._clients.values():
            client.destroy()
        self.lockstep.close()
        self._client_node.destroy_node()
        rclpy.try_shutdown(context=self.context)

    @property
    def now_s(self) -> float:
        """The time of the last step [s]."""
        return self.lockstep.now_ns * 1e-9

    @property
    def log(self) -> dict[str, list[tuple[int, bytes]]]:
        """Topic to (time [ns], CDR bytes) of everything that was said."""
        return self.lockstep.log.messages

    def messages(self, topic: str) -> list[Any]:
        """The logged messages of a topic, deserialized once: they are not to be changed.

        Raises:
            GraphError: when no node announces the topic; the known ones are listed.
        """
        if topic not in self.log:
            raise GraphError(
                f"no node announces {topic}", expected="one of " + ", ".join(sorted(self.log))
            )
        decoded, message_type = self._decoded.setdefault(topic, []), self._type_of(topic)
        for _, data in self.log[topic][len(decoded) :]:
            decoded.append(deserialize_message(data, message_type))
        return list(decoded)

    def newest(self, topic: str) -> Any:
        """The newest logged message of a topic, deserialized.

        Raises:
            GraphError: when nothing has been said on it.
        """
        if not self.log.get(topic):
            raise GraphError(f"nothing has been said on {topic}")
        return deserialize_message(self.log[topic][-1][1], self._type_of(topic))

    def overhear(
        self, message_type: Any, topic: str, handler: Callable[[Any], None], qos: Any = 10
    ) -> None:
        """Listen to a topic that is not logged, such as /diagnostics; nothing is waited for.

        Args:
            message_type: Its type.
            topic: Its name.
            handler: Takes each message, sooner or later.
            qos: Of the subscription.
        """
        self._client_node.create_subscription(message_type, topic, handler, qos)

    def shift_clock(self, seconds: float) -> None:
        """Let the clock that all nodes share jump, to the nearest step.

        Args:
            seconds: Forwards, or, below zero, back; not to before the first step [s].
        """
        self.lockstep.shift(round(seconds * 1e9))

    def _type_of(self, topic: str) -> Any:
        return self.lockstep.log.types[topic]

    def run(self, seconds: float) -> None:
        """Advance by a time [s]."""
        for _ in range(round(seconds * 1e9 / self.lockstep.step_ns)):
            self.lockstep.step()

    def run_until(self, done: Callable[[], bool], timeout_s: float) -> None:
        """Advance until ``done()``.

        Raises:
            GraphError: when it does not happen within ``timeout_s`` of the graph's time.
        """
        end = self.lockstep.now_ns + round(timeout_s * 1e9)
        while not done():
            if self.lockstep.now_ns >= end:
                raise GraphError(f"not done after {timeout_s} s of the graph's time")
            self.lockstep.step()

    def publish(self, message_type: Any, topic: str, message: Any, qos: Any = 10) -> None:
        """Publish one message from outside and wait until its listeners have it."""
        publisher = self._client_node.create_publisher(message_type, topic, qos)
        self.lockstep.watch(publisher.topic_name, message_type, qos)
        listeners = [n for n in self.nodes.values() if publisher.topic_name in n.received]
        before = [node.received[publisher.topic_name] for node in listeners]
        self.lockstep.spin_until(
            lambda: publisher.get_subscription_count() > len(listeners), f"a listener of {topic}"
        )
        publisher.publish(message)
        self.lockstep.spin_until(
            lambda: all(
                node.received[publisher.topic_name] > count
                for node, count in zip(listeners, before, strict=True)
            ),
            f"delivery on {topic}",
        )
        self.lockstep.outside(publisher.topic_name)
        self._client_node.destroy_publisher(publisher)

    def call(self, service_type: Any, name: str, request: Any) -> Any:
        """Call a service, with the time standing still."""
        client = self._client_node.create_client(service_type, name)
        self.lockstep.spin_until(client.service_is_ready, f"service {name}")
        future = client.call_async(request)
        self.lockstep.spin_until(future.done, f"an answer of {name}")
        self._client_node.destroy_client(client)
        return future.result()

    def reach(self, goal: ReachTarget.Goal, action: str = "/ptomp/reach_target") -> ReachHandle:
        """Send a goal and wait for its acceptance, with the time standing still."""
        client = self._clients.get(action)
        if client is None:
            client = self._clients[action] = ActionClient(self._client_node, ReachTarget, action)
            self.lockstep.spin_until(client.server_is_ready, f"action server {action}")
        feedback: list[Any] = []
        future = client.send_goal_async(
            goal, feedback_callback=lambda message: feedback.append(message.feedback)
        )
        self.lockstep.spin_until(future.done, f"an answer of {action}")
        return ReachHandle(future.result(), feedback)

    def cancel(self, handle: ReachHandle) -> None:
        """Cancel a goal, with the time standing still."""
        future = handle.goal_handle.cancel_goal_async()
        self.lockstep.spin_until(future.done, "the answer to a cancellation")

    def kill(self, name: str) -> None:
        """Take a node out of the graph, as if its process had been killed.

        Raises:
            GraphError: when there is no node of that name.
        """
        if name not in self.nodes:
            raise GraphError(f"no node {name!r}", expected="one of " + ", ".join(self.nodes))
        self.lockstep.remove(self.nodes.pop(name))
