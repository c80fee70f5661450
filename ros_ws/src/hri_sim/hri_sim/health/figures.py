"""What a node says of itself on /diagnostics, taken apart."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

OK, WARN, ERROR, STALE = range(4)
"""Levels, as in diagnostic_msgs/DiagnosticStatus."""
COUNTERS = ("tick_overruns", "deadline_misses")
"""Counters whose growth says that a node does not keep up."""
_STEADY_HZ = 1.0


@dataclass(frozen=True)
class NodeStatus:
    """One status of diagnostic_msgs/DiagnosticStatus.

    Attributes:
        name: Whose; of this project's nodes the fully qualified name.
        level: :data:`OK` … :data:`STALE`.
        message: What it says.
        values: Figures by their names, as text.
    """

    name: str
    level: int
    message: str
    values: Mapping[str, str]


@dataclass(frozen=True)
class Input:
    """A topic that a node listens to.

    Attributes:
        topic: Its name.
        received: Messages so far.
        hz: Rate over the last seconds [Hz]; NaN where not known.
        age_s: Age of the newest message, by its stamp where it has one [s]; NaN where not known.
        latency_ms: From stamp to receipt, median and 99th percentile [ms]; NaN where not known.
        quiet_s: For so long a stream has been silent [s]; 0 unless the node calls it quiet.
    """

    topic: str
    received: int
    hz: float = math.nan
    age_s: float = math.nan
    latency_ms: tuple[float, float] = (math.nan, math.nan)
    quiet_s: float = 0.0

    @property
    def lateness(self) -> float:
        """How many of its own periods the newest message is old; infinite for a stream that is quiet.

        0 for what comes now and then: nobody knows when that is late.
        """
        if self.quiet_s:
            return math.inf
        return max(self.age_s, 0.0) * self.hz if self.hz >= _STEADY_HZ else 0.0


@dataclass(frozen=True)
class Figures:
    """The figures that all nodes have, and the faults.

    Attributes:
        period_ms: Of the tick [ms]; NaN where not known, as all times here.
        tick_ms: What ticks took, median and 99th percentile [ms].
        tick_hz: How often it ticks [Hz].
        inputs: What it listens to.
        sent_hz: Rates of what it sends by topic [Hz].
        dropped: Messages that were lost in the node or, of a recorder, on the way, by topic.
        counters: :data:`COUNTERS`, as far as there are any.
        compiled_late: Kernels that were compiled while the graph waited.
        faults: Texts by key.
    """

    period_ms: float
    tick_ms: tuple[float, float]
    tick_hz: float
    inputs: tuple[Input, ...]
    sent_hz: Mapping[str, float]
    dropped: Mapping[str, int]
    counters: Mapping[str, int]
    compiled_late: str
    faults: Mapping[str, str]


def _number(text: str | None) -> float:
    """A figure; NaN when it is missing or no finite number."""
    try:
        value = float(text or "nan")
    except ValueError:
        return math.nan
    return value if math.isfinite(value) else math.nan


def _count(text: str | None) -> int:
    value = _number(text)
    return int(value) if math.isfinite(value) else 0


def _by_topic(values: Mapping[str, str], what: str) -> dict[str, str]:
    """Figures named ``what topic``, by topic."""
    return {
        key[len(what) + 1 :]: value for key, value in values.items() if key.startswith(f"{what} ")
    }


def figures_of(values: Mapping[str, str]) -> Figures:
    """The figures among the values of a status; those of nodes that are not of this project are few."""
    hz, age, quiet = (_by_topic(values, what) for what in ("received_hz", "age_s", "quiet_s"))
    middle, high = (_by_topic(values, f"latency_ms_{share}") for share in ("p50", "p99"))
    inputs = tuple(
        Input(
            topic,
            _count(received),
            _number(hz.get(topic)),
            _number(age.get(topic)),
            (_number(middle.get(topic)), _number(high.get(topic))),
            _number(quiet.get(topic, "0")),
        )
        for topic, received in _by_topic(values, "received").items()
    )
    dropped: dict[str, int] = {}
    for what in ("dropped", "lost_in_transport"):
        for topic, count in _by_topic(values, what).items():
            dropped[topic] = dropped.get(topic, 0) + _count(count)
    return Figures(
        period_ms=_number(values.get("period_ms")) or math.nan,
        tick_ms=(_number(values.get("tick_ms_p50")), _number(values.get("tick_ms_p99"))),
        tick_hz=_number(values.get("tick_hz")),
        inputs=inputs,
        sent_hz={topic: _number(rate) for topic, rate in _by_topic(values, "sent_hz").items()},
        dropped=dropped,
        counters={name: _count(values[name]) for name in COUNTERS if name in values},
        compiled_late=values.get("compiled_late", ""),
        faults=_by_topic(values, "fault"),
    )
