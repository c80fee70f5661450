"""How a topic flows: how often messages come, how old the newest is, how long they were under way."""

from __future__ import annotations

from array import array
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

NANO = 1_000_000_000
KEPT = 1024
"""Delays that are kept of a topic: four seconds of one at 250 Hz."""
WINDOW_NS = 5 * NANO
"""Rates and latencies are of the last seconds, no more than this [ns]."""
COMPARABLE_NS = 10 * NANO
"""Stamps and receipts farther apart than this are not of one clock, or not of one time: no latency [ns]."""


class Flow:
    """What has come on one topic. Noting a message writes three numbers in place.

    Args:
        delays: Whether the time from stamp to receipt says something: not where what was said earlier is
            handed to those who join, and not where the stamp says when a command is to take effect.

    Attributes:
        received_ns: When the newest message was received [ns]; none before the first.
        stamp_ns: Stamp of the newest message [ns]; 0 where it has none.
    """

    __slots__ = ("_count", "_delays", "_has_delays", "received_ns", "stamp_ns")

    def __init__(self, *, delays: bool) -> None:
        self.received_ns: int | None = None
        self.stamp_ns = 0
        self._has_delays = delays
        self._delays = array("q", bytes(8 * KEPT)) if delays else array("q")
        self._count = 0

    def note(self, received_ns: int, stamp_ns: int) -> None:
        """Note a message, received at a time [ns], with its stamp [ns], 0 for none."""
        self.received_ns = received_ns
        self.stamp_ns = stamp_ns
        if stamp_ns and self._has_delays:
            self._delays[self._count % KEPT] = received_ns - stamp_ns
            self._count += 1

    def age_s(self, now_ns: int) -> float | None:
        """Age of the newest message [s]: since its stamp, or its receipt where that does not say it."""
        if self.received_ns is None:
            return None
        since_ns = self.stamp_ns if self._has_delays and self.stamp_ns else self.received_ns
        return (now_ns - since_ns) / NANO

    def quiet_s(self, now_ns: int) -> float:
        """Time since the newest message was received [s]; 0 before the first."""
        return 0.0 if self.received_ns is None else max(now_ns - self.received_ns, 0) / NANO

    def latency_ms(self, newest: int) -> tuple[float, float] | None:
        """Median and 99th percentile of the time from stamp to receipt [ms].

        Args:
            newest: How many messages to look at, the newest ones; :data:`KEPT` at most.

        Returns:
            None without a message, or when the clocks cannot be compared.
        """
        count = min(newest, self._count, KEPT)
        if count <= 0:
            return None
        last = np.arange(self._count - count, self._count) % KEPT
        ordered = np.sort(np.frombuffer(self._delays, dtype=np.int64)[last])
        middle, high = int(ordered[count // 2]), int(ordered[int(count * 0.99)])
        return None if abs(middle) > COMPARABLE_NS else (middle / 1e6, high / 1e6)


@dataclass(frozen=True)
class Increase:
    """By how much a counter has grown.

    Attributes:
        count: By so much.
        seconds: In this time [s].
    """

    count: int
    seconds: float

    @property
    def hz(self) -> float:
        """Rate [Hz]."""
        return self.count / self.seconds


class Rates:
    """Rates of counters that are looked at every second or so."""

    def __init__(self) -> None:
        self._looks: deque[tuple[int, dict[str, int]]] = deque()

    def look(self, now_ns: int, counts: Mapping[str, int]) -> dict[str, Increase]:
        """Note counters, and compare them with what they were :data:`WINDOW_NS` ago or when looked at last.

        Args:
            now_ns: The time [ns]; when it goes back, rates begin anew.
            counts: The counters by name.

        Returns:
            By how much each has grown; without those that were not there before, or have been set back.
        """
        if self._looks and now_ns <= self._looks[-1][0]:
            self._looks.clear()
        while len(self._looks) > 1 and now_ns - self._looks[0][0] > WINDOW_NS:
            self._looks.popleft()
        found: dict[str, Increase] = {}
        for name, count in counts.items():
            for then_ns, then in self._looks:
                if then.get(name, count + 1) <= count:
                    found[name] = Increase(count - then[name], (now_ns - then_ns) / NANO)
                    break
        self._looks.append((now_ns, dict(counts)))
        return found
