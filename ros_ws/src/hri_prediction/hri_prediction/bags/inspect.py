"""What is in a bag, and how well it was recorded: counts, rates, gaps, latencies."""

from __future__ import annotations

import array
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from hri_prediction.bags.cdr import read_stamp, starts_with_stamp
from hri_prediction.bags.condition import Condition, salvage_command
from hri_prediction.bags.metadata import TopicInfo
from hri_prediction.bags.reader import BagReader
from hri_prediction.errors import DataError

_LAST_NS = 2**63 - 1  # ROS counts in 63 bits, MCAP in 64
_EVERY_NODES = ("/parameter_events", "/rosout")  # each has a publisher of its own in every node
_LATE_S = 60.0  # a stamp further from the log time is of another clock


@dataclass(frozen=True)
class Latency:
    """Percentiles of a latency [s]."""

    p50: float
    p99: float
    worst: float


@dataclass(frozen=True)
class TopicReport:
    """How one topic was recorded.

    Attributes:
        topic: Name.
        type: Message type.
        type_hash: Type hash, empty when not known.
        reliability: What its publishers offered ("mixed" when they differ, "" when not known).
        durability: Likewise.
        count: Messages.
        bytes: Serialised size of all messages.
        rate_hz: Messages a second between the first and the last, NaN for fewer than two.
        period_s: Median time between messages, NaN for fewer than two.
        longest_gap_s: Longest time between two messages, NaN for fewer than two.
        longest_gap_at_s: When that gap began, from the start of the bag.
        missing: Sequence numbers missing between those that are there; None when the recorder did
            not write them or several publishers mixed theirs, as those of parameters and logs do.
        transport: Log time − publish time.
        stamp: Log time − header stamp of those that have one; None where none has, or of another clock.
    """

    topic: str
    type: str
    type_hash: str
    reliability: str
    durability: str
    count: int
    bytes: int
    rate_hz: float
    period_s: float
    longest_gap_s: float
    longest_gap_at_s: float
    missing: int | None
    transport: Latency | None
    stamp: Latency | None


@dataclass(frozen=True)
class BagReport:
    """Summary of a bag.

    Attributes:
        path: The bag.
        closed: All its files were closed in order.
        damage: What is wrong with a bag of which only parts can be read; empty when all can.
        conditions: Of the files that are not whole, or may not be: which part is, and which is missing.
        files: File names with their sizes [bytes].
        start_ns: First log time [ns], 0 for an empty bag.
        duration_s: From the first to the last log time.
        messages: Number of messages that can be read.
        topics: One report a topic, by name.
        custom_data: Provenance strings.
        attachments: Names of attachments with their sizes [bytes].
        warnings: What is wrong with the bag, in words.
    """

    path: str
    closed: bool
    damage: str
    conditions: tuple[Condition, ...]
    files: dict[str, int]
    start_ns: int
    duration_s: float
    messages: int
    topics: tuple[TopicReport, ...]
    custom_data: dict[str, str]
    attachments: dict[str, int]
    warnings: tuple[str, ...]

    def to_mapping(self) -> dict[str, Any]:
        """Plain data for JSON; NaN becomes None."""
        return {key: _plain(value) for key, value in asdict(self).items()}


@dataclass
class _Series:
    """What is kept of each message of a topic."""

    log: array.array[int] = field(default_factory=lambda: array.array("q"))
    publish: array.array[int] = field(default_factory=lambda: array.array("q"))
    stamp: array.array[int] = field(default_factory=lambda: array.array("q"))
    sequence: array.array[int] = field(default_factory=lambda: array.array("q"))
    bytes: int = 0


def inspect_bag(path: str | Path, *, allow_damaged: bool = False) -> BagReport:
    """Read a whole bag, closed or not, and report on it.

    Args:
        path: Bag folder, or an .mcap file.
        allow_damaged: Of a damaged bag, report on what can be salvaged.

    Raises:
        DataError: there is no bag, or it is damaged (not merely cut), or nothing of it can be read.
    """
    try:
        return _report(BagReader(path, allow_unclosed=True), "")
    except DataError as error:
        if not allow_damaged:
            raise
        try:
            return _report(BagReader(path, allow_damaged=True), error.problem)
        except DataError:
            raise error from None


def _report(reader: BagReader, damage: str) -> BagReport:
    stamped = {name for name, text in reader.definitions.items() if starts_with_stamp(text)}
    series: dict[str, _Series] = {name: _Series() for name in reader.topics}
    for message in reader.messages():
        one = series.setdefault(message.topic, _Series())
        one.log.append(min(message.log_time_ns, _LAST_NS))
        one.publish.append(min(message.publish_time_ns, _LAST_NS))
        one.sequence.append(message.sequence)
        one.bytes += len(message.data)
        if message.type in stamped:
            one.stamp.append(read_stamp(message.data) or 0)
    stamps = [np.asarray(one.log) for one in series.values() if one.log]
    start = int(min((log.min() for log in stamps), default=0))
    end = int(max((log.max() for log in stamps), default=0))
    infos = reader.topics
    topics = tuple(
        _topic_report(infos.get(name, TopicInfo(name, "")), series[name], start)
        for name in sorted(series)
    )
    return BagReport(
        path=str(reader.path),
        closed=not reader.unclosed,
        damage=damage,
        conditions=reader.conditions,
        files={file.name: file.stat().st_size for file in reader.files},
        start_ns=start,
        duration_s=(end - start) * 1e-9,
        messages=sum(topic.count for topic in topics),
        topics=topics,
        custom_data=reader.custom_data,
        attachments={item.name: len(item.data) for item in reader.attachments()},
        warnings=_warnings(reader, damage, topics),
    )


def _topic_report(info: TopicInfo, one: _Series, start_ns: int) -> TopicReport:
    log = np.sort(np.asarray(one.log, dtype=np.int64))
    gaps = np.diff(log) * 1e-9
    several = gaps.size > 0
    span = (log[-1] - log[0]) * 1e-9 if several else 0.0
    longest = int(np.argmax(gaps)) if several else 0
    return TopicReport(
        topic=info.name,
        type=info.type,
        type_hash=info.type_hash,
        reliability=_common([qos.reliability for qos in info.qos]),
        durability=_common([qos.durability for qos in info.qos]),
        count=len(one.log),
        bytes=one.bytes,
        rate_hz=float(gaps.size / span) if span > 0 else float("nan"),
        period_s=float(np.median(gaps)) if several else float("nan"),
        longest_gap_s=float(gaps[longest]) if several else float("nan"),
        longest_gap_at_s=float(log[longest] - start_ns) * 1e-9 if several else float("nan"),
        missing=_missing(info.name, np.asarray(one.sequence, dtype=np.int64)),
        transport=_latency(one.log, one.publish),
        stamp=_latency(one.log, one.stamp),
    )


def _common(values: list[str]) -> str:
    unique = sorted(set(values))
    return "mixed" if len(unique) > 1 else "".join(unique)


def _missing(topic: str, sequence: np.ndarray) -> int | None:
    """Numbers left out; a restart of the publisher begins a new count."""
    # Few messages of one node, then some of another's, look like a hole between the two.
    if topic in _EVERY_NODES:
        return None
    if sequence.size < 2 or not sequence.all():
        return 0 if sequence.size == 1 and sequence[0] > 0 else None
    steps = np.diff(sequence)
    restarts = steps <= 0
    # One publisher restarts now and then; numbers that run back again and again are those of
    # several publishers mixed.
    if np.count_nonzero(restarts) > 0.01 * steps.size + 1:
        return None
    return int(np.sum(steps[~restarts] - 1))


def _latency(log: array.array[int], sent: array.array[int]) -> Latency | None:
    if len(sent) == 0 or len(sent) != len(log):
        return None
    stamps = np.asarray(sent, dtype=np.int64)
    given = stamps != 0  # e.g. trajectories that begin at once
    if not given.any():
        return None
    values = (np.asarray(log, dtype=np.int64) - stamps)[given] * 1e-9
    if np.abs(np.median(values)) > _LATE_S:
        return None
    p50, p99 = np.percentile(values, [50, 99])
    return Latency(float(p50), float(p99), float(values.max()))


def _warnings(reader: BagReader, damage: str, topics: tuple[TopicReport, ...]) -> tuple[str, ...]:
    found = [damage] if damage else []
    found += [text for condition in reader.conditions for text in condition.words()]
    if found and any(topic.count for topic in topics):
        found.append(
            f"counted here is what can be read; {salvage_command(reader.path)} makes a whole bag of that"
        )
    if reader.outdated:
        found.append(
            "metadata.yaml is that of the beginning of the recording; "
            f"{salvage_command(reader.path)} makes it anew"
        )
    listed = {topic.name: topic.message_count for topic in reader.metadata.topics}
    for topic in topics:
        if topic.missing:
            found.append(f"{topic.topic}: {topic.missing} messages are missing")
        if listed.get(topic.topic, topic.count) != topic.count:
            found.append(
                f"{topic.topic}: metadata.yaml says {listed[topic.topic]} messages, "
                f"the files hold {topic.count}"
            )
        if topic.count and not reader.definitions.get(topic.type):
            found.append(f"{topic.topic}: the bag has no definition of {topic.type}")
    return tuple(found)


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    return None if isinstance(value, float) and not np.isfinite(value) else value
