"""When the robot came to rest after a fault, from joint speeds as they are heard."""

from __future__ import annotations

REST_SPEED = 0.02
"""Joint speed below which the robot counts as at rest [rad/s]."""
STILL_NS = 40_000_000
"""It counts as at rest when it stays so for so long [ns]."""
WATCH_NS = 2_000_000_000
"""After that long it is not waited for any more [ns]."""


class RestWatch:
    """Watches joint speeds from a fault on.

    Args:
        fault_ns: When the fault came [ns].
        moving: Whether the robot moved then.

    Attributes:
        rest_ms: From the fault to rest [ms]; 0 when the robot did not move; none: not (yet) at rest.
    """

    def __init__(self, fault_ns: int, *, moving: bool) -> None:
        self._fault_ns = fault_ns
        self._since_ns: int | None = None
        self.rest_ms: float | None = None if moving else 0.0

    def hear(self, stamp_ns: int, speed: float) -> None:
        """Take the largest joint speed [rad/s] at a time [ns]."""
        if self.over(stamp_ns) or stamp_ns <= self._fault_ns:
            return
        if speed >= REST_SPEED:
            self._since_ns = None
        elif self._since_ns is None:
            self._since_ns = stamp_ns
        elif stamp_ns - self._since_ns >= STILL_NS:
            self.rest_ms = (self._since_ns - self._fault_ns) / 1e6

    def over(self, now_ns: int) -> bool:
        """Whether there is nothing more to wait for."""
        return self.rest_ms is not None or now_ns - self._fault_ns > WATCH_NS
