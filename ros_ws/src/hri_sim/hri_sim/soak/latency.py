"""Newest sample used to trajectory heard, from two streams that come in any order."""

from __future__ import annotations

from collections import OrderedDict

KEPT = 64
"""Hand-overs that wait for the other stream; older ones are dropped."""


class LatencyMatch:
    """Puts trajectories and the planner's status of the same hand-over together.

    Args:
        delay_ms: Simulated delay of the sensor, which is not counted [ms].
    """

    def __init__(self, delay_ms: float) -> None:
        self._delay_ms = delay_ms
        self._heard: OrderedDict[int, int] = OrderedDict()
        self._samples: OrderedDict[int, int] = OrderedDict()
        self._found: list[float] = []

    def trajectory(self, handover_ns: int, heard_ns: int) -> None:
        """A trajectory for a hand-over was heard at a time [ns]; 0 as hand-over: it is none."""
        if handover_ns:
            self._put(self._heard, handover_ns, heard_ns)
            self._match(handover_ns)

    def planned(self, handover_ns: int, sample_ns: int) -> None:
        """The plan for a hand-over is of a sample captured at a time [ns]; 0: of none."""
        if handover_ns and sample_ns:
            self._put(self._samples, handover_ns, sample_ns)
            self._match(handover_ns)

    @staticmethod
    def _put(store: OrderedDict[int, int], key: int, value: int) -> None:
        store.setdefault(key, value)
        if len(store) > KEPT:
            store.popitem(last=False)

    def _match(self, key: int) -> None:
        if key in self._heard and key in self._samples:
            taken_ns = self._heard.pop(key) - self._samples.pop(key)
            self._found.append(taken_ns / 1e6 - self._delay_ms)

    def take(self) -> list[float]:
        """Latencies that were found since the last call [ms]."""
        found, self._found = self._found, []
        return found
