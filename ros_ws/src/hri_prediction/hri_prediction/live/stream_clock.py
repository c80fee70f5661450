"""When a frame was captured, on the clock of the receiver.

The source counts time from the start of its measurement; the two clocks are not synchronised. What a
packet took on its way varies, but is never less than some least time, so the offset between the
clocks is the least difference between receipt and count of the last seconds. What the fastest packet
takes cannot be told from the packets alone: it is a parameter.
"""

from __future__ import annotations

from collections import deque

WINDOW_NS = 10 * 10**9
"""Time over which the least difference is taken [ns]: crystals drift by less than 1 ms in it."""
STEP_NS = 10**8
"""The receiver's clock was set back when it goes back by more than this [ns]."""


class StreamClock:
    """Turns the source's times into capture times on the receiver's clock.

    Args:
        latency_ns: What the fastest packet takes from capture to receipt [ns].
    """

    def __init__(self, latency_ns: int = 0) -> None:
        self._latency_ns = latency_ns
        # (receipt, difference), differences increasing: the first is the least of the window.
        self._least: deque[tuple[int, int]] = deque()
        self._last_source_ns: int | None = None
        self._last_received_ns = 0
        self._last_stamp_ns: int | None = None
        self.restarts = 0

    def stamp(self, source_ns: int, received_ns: int) -> int | None:
        """Capture time of a frame [ns]; never after its receipt.

        Args:
            source_ns: Time of the frame on the source's clock [ns]. When it goes back, a new
                measurement has begun.
            received_ns: Time of receipt [ns].

        Returns:
            The capture time; None for a frame that is not newer than the one before, or whose stamp
            would not be: that happens when a faster packet shows that earlier stamps were too late.
        """
        if received_ns < self._last_received_ns - STEP_NS:
            self.restart()
            self._last_stamp_ns = None
        elif self._last_source_ns is not None and source_ns < self._last_source_ns:
            self.restart()
        elif source_ns == self._last_source_ns:
            return None
        self._last_source_ns, self._last_received_ns = source_ns, received_ns
        difference = received_ns - source_ns
        while self._least and self._least[-1][1] >= difference:
            self._least.pop()
        self._least.append((received_ns, difference))
        while self._least[0][0] < received_ns - WINDOW_NS:
            self._least.popleft()
        stamp = source_ns + self._least[0][1] - self._latency_ns
        if self._last_stamp_ns is not None and stamp <= self._last_stamp_ns:
            return None
        self._last_stamp_ns = stamp
        return stamp

    def restart(self) -> None:
        """Forget the offset, as another measurement begins; stamps still go on increasing."""
        self._least.clear()
        self.restarts += self._last_source_ns is not None
        self._last_source_ns = None
