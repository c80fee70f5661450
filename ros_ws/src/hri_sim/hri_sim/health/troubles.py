"""What is wrong with a node: what it says itself, and what its figures and the graph show."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from hri_sim.health.advice import advise
from hri_sim.health.advice_table import COMPILED, DROPS, MISSES, SLOW, SOURCES, STARVED
from hri_sim.health.figures import OK, Figures, NodeStatus

DROPPED = "dropped"
LATE = "compiled_late"
_SOLE = re.compile(r"/bodies/[^/]+/(arm|prediction)$|/joint_states$|/reference$|^/clock$")
_MOST_OVERRUNS = 0.05
"""Share of ticks that may take too long [-]."""
_FEW = 3
"""Fewer late ticks, late replans or dropped messages are no trouble yet."""
_LEAST_TICKS = 0.7
"""A node that gets less than this share of its ticks is starved [-]."""


@dataclass(frozen=True)
class Trouble:
    """Something that is wrong.

    Attributes:
        key: Of the fault, or of what was seen; empty for what a node says without a key.
        text: What is wrong.
        do: What to do about it.
        seen_from_outside: Whether the node does not say it itself.
    """

    key: str
    text: str
    do: str
    seen_from_outside: bool = False


@dataclass(frozen=True)
class Past:
    """Counters of a node at a time, by name."""

    counts: Mapping[str, int]

    @classmethod
    def of(cls, figures: Figures) -> Past:
        """Those among figures."""
        late = len([name for name in figures.compiled_late.split(", ") if name])
        dropped = {f"{DROPPED} {topic}": count for topic, count in figures.dropped.items()}
        total = sum(figures.dropped.values())
        return cls({**figures.counters, **dropped, DROPPED: total, LATE: late})

    def exceeds(self, later: Past) -> bool:
        """Whether one is greater than later on: then the node was started anew."""
        return any(count > later.counts.get(name, 0) for name, count in self.counts.items())

    def since(self, earlier: Past) -> dict[str, int]:
        """By how much each has grown."""
        return {name: n - earlier.counts.get(name, 0) for name, n in self.counts.items()}


def is_sole(topic: str) -> bool:
    """Whether no two nodes may send a topic at once.

    The speed scale is none of these: planner and policy take turns.
    """
    return _SOLE.search(topic) is not None


def trouble(key: str, text: str) -> Trouble:
    """Something that was seen from outside."""
    return Trouble(key, text, advise(key, text), seen_from_outside=True)


def troubles_of(
    status: NodeStatus,
    figures: Figures,
    lately: Mapping[str, int],
    span_s: float,
    sources: Mapping[str, Sequence[str]],
) -> list[Trouble]:
    """All that is wrong with a node that speaks.

    Args:
        status: What it says.
        figures: Its figures.
        lately: Growth of its counters.
        span_s: In this time [s].
        sources: Nodes that publish a topic, by topic.
    """
    return [
        *_said(status, figures),
        *_grown(figures, lately, span_s),
        *(
            trouble(SOURCES, f"{item.topic} comes from {_named(sources[item.topic])}")
            for item in figures.inputs
            # Who does not look at the age, as a recorder, can take it from any number.
            if is_sole(item.topic)
            and len(sources.get(item.topic, ())) > 1
            and not math.isnan(item.age_s)
        ),
    ]


def _named(nodes: Sequence[str]) -> str:
    """Names of nodes, some of which may have the same."""
    if len(set(nodes)) == 1:
        return f"{len(nodes)} nodes called {nodes[0]}"
    return " and ".join(sorted(nodes))


def _said(status: NodeStatus, figures: Figures) -> list[Trouble]:
    """Faults by their keys, then what the node says beside these."""
    found = [Trouble(key, text, advise(key, text)) for key, text in figures.faults.items()]
    if status.level == OK:
        return found
    rest = status.message
    for text in figures.faults.values():
        rest = rest.replace(text, "")
    rest = rest.strip("; ")
    if rest:
        found.insert(0, Trouble("", rest, advise("", rest)))
    return found


def _grown(figures: Figures, lately: Mapping[str, int], span_s: float) -> list[Trouble]:
    found = []
    # Where the period is not known, this is NaN, and no comparison holds.
    ticks = span_s * 1e3 / figures.period_ms
    overruns = lately.get("tick_overruns", 0)
    if overruns >= _FEW and overruns > _MOST_OVERRUNS * ticks:
        text = f"{overruns} of {ticks:.0f} ticks took longer than {figures.period_ms:g} ms"
        found.append(trouble(SLOW, text))
    wanted_hz = 1e3 / figures.period_ms
    if figures.tick_hz < _LEAST_TICKS * wanted_hz:
        text = f"ticks {figures.tick_hz:.0f} times a second instead of {wanted_hz:.0f}"
        found.append(trouble(STARVED, text))
    if lately.get("deadline_misses", 0) >= _FEW:
        text = f"{lately['deadline_misses']} replans late in {span_s:.0f} s"
        found.append(trouble(MISSES, text))
    if lately.get(DROPPED, 0) >= _FEW:
        topics = [name.partition(" ")[2] for name, n in lately.items() if n and " " in name]
        text = f"{lately[DROPPED]} messages dropped in {span_s:.0f} s: {', '.join(topics)}"
        found.append(trouble(DROPS, text))
    if lately.get(LATE, 0) > 0:
        found.append(trouble(COMPILED, f"compiled while running: {figures.compiled_late}"))
    return found
