"""Subscriptions whose messages wait in the middleware until all of them are taken at once.

An executor is woken by each message: a graph whose topics run at 250 Hz would wake some thousand times a
second, and each time find its processor's caches filled with another process' data.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from typing import Any

from rclpy.executors import Executor
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.subscription import Subscription

Store = Callable[[Any, dict[str, Any]], None]
"""Takes a message (bytes, of a raw subscription), and what the middleware says of it."""


class PollingNode(Node):
    """A node that takes the messages of some of its subscriptions when it is told to."""

    def __init__(self, name: str, **kwargs: Any) -> None:
        # What empties the queues of subscriptions, by their identity.
        self._takers: dict[int, Callable[[], None]] = {}
        super().__init__(name, **kwargs)

    def poll(self, subscription: Subscription, store: Store) -> None:
        """Take the messages of a subscription with :meth:`take` from now on, not as they come.

        Args:
            subscription: A new one of this node; its own callback is not called. Its depth is how many
                messages wait.
            store: Is called with each.
        """
        self._takers[id(subscription)] = _taker(subscription, store)

    def poll_topic(
        self, message_type: Any, topic: str, take: Callable[[Any], None], qos: QoSProfile
    ) -> None:
        """Subscribe to a topic whose messages are taken with :meth:`take`.

        Args:
            message_type: Of the topic.
            topic: Its name.
            take: Is called with each message.
            qos: Its depth is how many messages wait.
        """
        subscription = self.create_subscription(message_type, topic, take, qos)
        self.poll(subscription, lambda message, _: take(message))

    def let_in(self, executor: Executor, seconds: float) -> None:
        """Let what comes in for a time [s], then take what is polled."""
        end = time.monotonic() + seconds
        while (left_s := end - time.monotonic()) > 0.0:
            executor.spin_once(timeout_sec=left_s)
        self.take()

    def take(self) -> None:
        """Take all that has come."""
        for taker in tuple(self._takers.values()):
            taker()

    @property
    def subscriptions(self) -> Iterator[Subscription]:
        """Those whose messages an executor takes."""
        yield from (one for one in super().subscriptions if id(one) not in self._takers)

    def destroy_subscription(self, subscription: Subscription) -> bool:
        """Destroy it; what waits in its queue is dropped."""
        self._takers.pop(id(subscription), None)
        return bool(super().destroy_subscription(subscription))


def _taker(subscription: Subscription, store: Store) -> Callable[[], None]:
    """Empties the queue of a subscription."""
    handle, kind, raw = subscription.handle, subscription.msg_type, subscription.raw
    depth = subscription.qos_profile.depth

    def take() -> None:
        with handle:
            # No more than there can be: what comes meanwhile is for the next time.
            for _ in range(depth):
                taken = handle.take_message(kind, raw)
                if taken is None:
                    return
                store(*taken)

    return take
