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
        """Whether it is due; if so, it is said now, and due again a period later.

        Who asks in steps that the period is no multiple of is told so in time on the average. A clock that
        has gone back makes it due at once: who listens would wait for long.
        """
        late_ns = now_ns - self._next_ns
        due = late_ns >= 0 or -late_ns > self._period_ns
        if due:
            in_time = 0 <= late_ns < self._period_ns
            self._next_ns = (self._next_ns if in_time else now_ns) + self._period_ns
        return due

    def at_once(self, now_ns: int) -> None:
        """It is due as of now [ns]."""
        self._next_ns = now_ns
