"""What a node has received since its last tick."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Any

Handler = Callable[[Any], None]


class Inbox:
    """Keeps messages for a tick: of each topic as many as were asked for, the newest.

    Attributes:
        dropped: Messages that newer ones have pushed out, by topic.
    """

    def __init__(self) -> None:
        # Stamp, topic and number of arrival, by which messages are ordered; then what is called with what.
        self._queues: dict[str, deque[tuple[int, str, int, Handler, Any]]] = {}
        self._arrivals = 0
        self.dropped: dict[str, int] = {}

    def open(self, topic: str, depth: int, handler: Handler) -> Callable[[int, Any], bool]:
        """Begin to keep a topic.

        Args:
            topic: Its full name.
            depth: How many messages are kept; 0 for all.
            handler: What the messages are for.

        Returns:
            Takes a stamp [ns] and a message; says whether the topic was still open.
        """
        queue = self._queues[topic] = deque(maxlen=depth or None)

        def store(stamp_ns: int, message: Any) -> bool:
            if self._queues.get(topic) is not queue:
                return False
            if len(queue) == queue.maxlen:
                self.dropped[topic] = self.dropped.get(topic, 0) + 1
            self._arrivals += 1
            queue.append((stamp_ns, topic, self._arrivals, handler, message))
            return True

        return store

    def close(self, topic: str) -> None:
        """End a topic and drop what has come on it."""
        del self._queues[topic]
        self.dropped.pop(topic, None)

    def hand_over(self) -> None:
        """Call the handlers with what has come, ordered by (stamp, topic).

        A handler may open topics, whose messages wait for the next time, and close them.
        """
        taken = [item for queue in self._queues.values() for item in queue]
        for queue in self._queues.values():
            queue.clear()
        taken.sort(key=lambda item: item[:3])
        for _, topic, _, handler, message in taken:
            if topic in self._queues:
                handler(message)
