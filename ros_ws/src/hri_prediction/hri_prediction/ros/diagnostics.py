"""What a node says of itself on /diagnostics: its level, its faults, and figures of all that it does."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.qos import ReliabilityPolicy
from std_msgs.msg import Header

from hri_prediction.flow import Flow, Increase, Rates
from hri_prediction.ros.time import NANO, to_time

if TYPE_CHECKING:
    from hri_prediction.ros.node import HriNode

OK, WARN, ERROR, STALE = (
    DiagnosticStatus.OK,
    DiagnosticStatus.WARN,
    DiagnosticStatus.ERROR,
    DiagnosticStatus.STALE,
)
FAULT_NS = 5 * NANO
"""For so long a fault is told after it was noted last [ns]."""
QUIET_S = 1.0
"""A stream of which nothing has come for longer has run dry [s]."""
KEPT_TICKS = 1000
UP_S, LEVEL_NOW = "up_s", "level_now"
"""Keys of the time since the first tick, by the node's clock, and of the level without past faults."""
OVER_NS = NANO
"""A fault that was noted longer ago, and not again, is over, though it is told [ns]."""


@dataclass(frozen=True)
class Fault:
    """Something that is wrong, until when it is told [ns]."""

    until_ns: int
    text: str
    level: bytes


class Diagnostics:
    """Collects what is said of a node, and says it.

    Streams are topics of sensor data: best effort. Others may be silent for as long as they like.

    Args:
        node: The node.
        dropped: Its messages that newer ones have pushed out, by topic; kept up to date by the node.

    Attributes:
        overruns: Ticks that took longer than their period.
    """

    def __init__(self, node: HriNode, dropped: Mapping[str, int]) -> None:
        self._node = node
        self._dropped = dropped
        self._publisher = node.create_publisher(DiagnosticArray, "/diagnostics", 10)
        self._flows: dict[str, tuple[Flow, bool]] = {}
        self._faults: dict[str, Fault] = {}
        self._tick_ms: deque[float] = deque(maxlen=KEPT_TICKS)
        self._ticks = 0
        self.overruns = 0
        self._rates = Rates()

    def listened(self, topic: str, flow: Flow, reliability: ReliabilityPolicy) -> None:
        """The node listens to a topic from now on."""
        self._flows[topic] = (flow, reliability == ReliabilityPolicy.BEST_EFFORT)

    def ignored(self, topic: str) -> None:
        """It does not any more."""
        del self._flows[topic]

    def ticked(self, took_s: float, period_s: float) -> None:
        """Note how long a tick took, and how long one may take, if that is known [s]."""
        self._tick_ms.append(took_s * 1e3)
        self._ticks += 1
        if 0.0 < period_s < took_s:
            self.overruns += 1

    def fault(self, key: str, text: str, level: bytes) -> bool:
        """Note a fault; whether it is a new one."""
        known = key in self._faults
        self._faults[key] = Fault(self._node.now_ns() + FAULT_NS, text, level)
        return not known

    @property
    def faults(self) -> tuple[str, ...]:
        """Texts of the faults of the last seconds, one a kind, the newest of each."""
        return tuple(fault.text for fault in self._faults.values())

    def tell(self, now_ns: int) -> None:
        """Say how the node is."""
        level, text, figures = self._node.health()
        self._faults = {k: fault for k, fault in self._faults.items() if fault.until_ns > now_ns}
        quiet = {
            topic: flow.quiet_s(now_ns)
            for topic, (flow, is_stream) in self._flows.items()
            if is_stream and flow.quiet_s(now_ns) > QUIET_S
        }
        faults = tuple(self._faults.values())
        recent = [fault for fault in faults if fault.until_ns - now_ns > FAULT_NS - OVER_NS]
        level_now, _ = summary(level, text, recent, quiet)
        level, text = summary(level, text, faults, quiet)
        figures[LEVEL_NOW] = int.from_bytes(level_now, "little")
        figures |= self._tick_figures()
        figures |= self._topic_figures(now_ns, figures)
        figures |= {f"quiet_s {topic}": f"{quiet_s:.1f}" for topic, quiet_s in quiet.items()}
        figures |= {f"fault {key}": fault.text for key, fault in self._faults.items()}
        status = DiagnosticStatus(
            level=level,
            name=self._node.get_fully_qualified_name(),
            hardware_id=self._node.get_name(),
            message=text,
            values=[KeyValue(key=key, value=str(value)) for key, value in figures.items()],
        )
        header = Header(stamp=to_time(now_ns))
        self._publisher.publish(DiagnosticArray(header=header, status=[status]))

    def _tick_figures(self) -> dict[str, Any]:
        figures: dict[str, Any] = {
            UP_S: f"{max(self._node.tick_ns - self._node.started_ns, 0) / NANO:.3f}",
            "period_ms": f"{self._node.period_s * 1e3:g}",
        }
        ordered = sorted(self._tick_ms)
        if ordered:
            figures["tick_ms_p50"] = f"{ordered[len(ordered) // 2]:.3f}"
            figures["tick_ms_p99"] = f"{ordered[int(len(ordered) * 0.99)]:.3f}"
        figures["tick_overruns"] = self.overruns
        figures["scheduling"] = self._node.scheduling
        figures["compiled_late"] = ", ".join(self._node.compiled_late())
        return figures

    def _topic_figures(self, now_ns: int, own: dict[str, Any]) -> dict[str, Any]:
        """Counts, rates, ages and latencies; those that the node's health counts itself get rates too."""
        node = self._node
        figures: dict[str, Any] = {f"received {name}": n for name, n in node.received.items()}
        figures |= {f"dropped {name}": n for name, n in self._dropped.items()}
        figures |= {f"sent {name}": p.sent for name, p in node.publishers_by_topic.items()}
        counted = ("received ", "sent ")
        counts = {k: v for k, v in (own | figures).items() if k.startswith(counted)}
        if node.ticks_on_own_clock:
            counts["tick"] = self._ticks
        grown = self._rates.look(now_ns, counts)
        for name, increase in grown.items():
            what, _, topic = name.partition(" ")
            figures[f"{what}_hz {topic}".rstrip()] = f"{increase.hz:.1f}"
        for topic, (flow, _) in self._flows.items():
            figures |= _flow_figures(topic, flow, grown.get(f"received {topic}"), now_ns)
        return figures


def _flow_figures(topic: str, flow: Flow, grown: Increase | None, now_ns: int) -> dict[str, str]:
    figures = {}
    age_s = flow.age_s(now_ns)
    if age_s is not None:
        figures[f"age_s {topic}"] = f"{age_s:.3f}"
    latency = None if grown is None else flow.latency_ms(grown.count)
    if latency is not None:
        figures[f"latency_ms_p50 {topic}"] = f"{latency[0]:.3f}"
        figures[f"latency_ms_p99 {topic}"] = f"{latency[1]:.3f}"
    return figures


def summary(
    level: bytes, text: str, faults: Sequence[Fault], quiet: Mapping[str, float]
) -> tuple[bytes, str]:
    """Level and words of a node, from its own and from what has happened to it.

    Args:
        level: Of its health.
        text: Of its health.
        faults: Those of the last seconds.
        quiet: Streams that have run dry, and for how long [s]; told where nothing else is.

    Returns:
        The worst level; all that is wrong, nothing twice. The text of a node that is well.
    """
    words = [] if level == OK else [text]
    for fault in faults:
        level = max(level, fault.level)
        if not any(fault.text in said for said in words):
            words = [said for said in words if said not in fault.text]
            words.append(fault.text)
    if quiet and not words:
        level = WARN
        words = [f"nothing on {topic} for {quiet_s:.1f} s" for topic, quiet_s in quiet.items()]
    return level, "; ".join(words) or text
