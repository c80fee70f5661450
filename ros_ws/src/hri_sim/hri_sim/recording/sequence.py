"""Messages that were sent and did not arrive, by the gaps in their publisher's numbers."""

from __future__ import annotations


class SequenceGaps:
    """Counts what one topic's publisher has sent and the middleware has not brought.

    Numbers of several publishers interleave, and then say nothing. A publisher that has only just come
    looks like a gap, too, until the graph knows of it: hence a gap counts only once :meth:`settle` has
    heard how many publishers there are now.

    Args:
        publishers: How many publish on the topic.

    Attributes:
        lost: Messages that were sent and did not arrive.
    """

    def __init__(self, publishers: int = 1) -> None:
        self.lost = 0
        self._publishers = publishers
        self._suspected = 0
        self._last = 0

    def take(self, sequence: int) -> None:
        """Note a message that has arrived.

        Args:
            sequence: Its number, from 1; 0 when the middleware gives none.
        """
        if sequence:
            if 0 < self._last < sequence - 1:
                self._suspected += sequence - 1 - self._last
            self._last = sequence

    @property
    def suspects(self) -> bool:
        """Whether there are gaps that do not count yet."""
        return self._suspected > 0

    def settle(self, publishers: int) -> None:
        """Count the gaps of one publisher; forget those of several.

        Args:
            publishers: How many publish on the topic now.
        """
        if max(publishers, self._publishers) <= 1:
            self.lost += self._suspected
        self._publishers = publishers
        self._suspected = 0
