"""Something that is said again and again."""

from __future__ import annotations


class Beat:
    """When it is due.

    Args:
        period_ns: From one time to the next [ns].
    """

    def __init__(self, period_ns: int) -> None:
        self._period_ns = period_ns
        self._next_ns = 0

    def due(self, now_ns: int) -> bool:
        """Whether it is due; if so, it is said now, and due again a period later."""
        due = now_ns >= self._next_ns
        if due:
            self._next_ns = now_ns + self._period_ns
        return due

    def at_once(self, now_ns: int) -> None:
        """It is due as of now [ns]."""
        self._next_ns = now_ns
