"""The table of nodes and what to do, for people and for programs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from rich.console import Group, RenderableType
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from hri_sim.health.figures import ERROR, OK, STALE, WARN, Input
from hri_sim.health.troubles import DROPPED
from hri_sim.health.watch import Row

STATES = {OK: "OK", WARN: "WARN", ERROR: "ERROR", STALE: "STALE"}
COLOURS = {OK: "green", WARN: "yellow", ERROR: "bold red", STALE: "magenta"}
_NOTHING = "–"
_WIDE = 100
"""A table that is at least so wide has room for inputs [characters]."""
_LARGE = 1e7
"""Larger numbers are rounded [-]."""
_LONGEST = 20
"""Topics with longer names are shown by the end of these [characters]."""


def screen(rows: Sequence[Row], head: str, width: int) -> RenderableType:
    """The table, and below it what to do about each thing that is wrong.

    Args:
        rows: The nodes.
        head: Line above it.
        width: Columns that there are [characters]; where these are few, inputs are left out.
    """
    inputs = width >= _WIDE
    table = Table(box=None, pad_edge=False, header_style="bold", padding=(0, 1, 0, 0))
    table.add_column("node", no_wrap=True)
    table.add_column("state", no_wrap=True)
    table.add_column("what it says", overflow="fold", ratio=1)
    table.add_column("tick\n[ms]", justify="right", no_wrap=True)
    table.add_column("\np99", justify="right", no_wrap=True)
    table.add_column("\nof", justify="right", no_wrap=True)
    table.add_column("over-\nruns", justify="right")
    table.add_column("\ndrops", justify="right")
    if inputs:
        table.add_column("oldest input", overflow="fold")
    for row in rows:
        colour = COLOURS[row.level]
        table.add_row(
            escape(row.name),
            f"[{colour}]{STATES[row.level]}[/]",
            escape(row.says) if row.level == OK else f"[{colour}]{escape(row.says)}[/]",
            *_ticks(row),
            _counted(row, "tick_overruns"),
            _counted(row, DROPPED),
            *([_input(row.worst_input)] if inputs else []),
        )
    return Group(Text(head), table, *_what_to_do(rows))


def _what_to_do(rows: Sequence[Row]) -> list[RenderableType]:
    """Advices, the worst first, each once with the nodes that it is for."""
    found: dict[str, tuple[int, list[str]]] = {}
    for row in sorted(rows, key=lambda row: -row.level):
        for trouble in row.troubles:
            level, names = found.setdefault(trouble.do, (row.level, []))
            if row.name not in names:
                names.append(row.name)
    if not found:
        return []
    grid = Table.grid(padding=(0, 1))
    grid.add_column(overflow="fold", max_width=24)
    grid.add_column(overflow="fold", ratio=1)
    for do, (level, names) in found.items():
        grid.add_row(f"[{COLOURS[level]}]{escape(', '.join(names))}[/]", escape(do))
    return [Text("\nwhat to do", style="bold"), grid]


def _ticks(row: Row) -> list[str]:
    """What ticks take, median and 99th percentile, and their period."""
    if row.figures is None:
        return [_NOTHING] * 3
    times = (*row.figures.tick_ms, row.figures.period_ms)
    return [_number(value) for value in times]


def _number(value: float) -> str:
    """A number of few characters, however large."""
    if math.isnan(value):
        return _NOTHING
    if abs(value) >= _LARGE:
        return f"{value:.1e}"
    return f"{value:.2g}" if abs(value) < 10.0 else f"{value:.0f}"


def _counted(row: Row, name: str) -> str:
    """A counter, and by how much it has grown lately."""
    if row.figures is None:
        return _NOTHING
    total = row.dropped if name == DROPPED else row.figures.counters.get(name, 0)
    grown = row.lately.get(name, 0)
    grew = f" [yellow](+{_number(grown)})[/]" if grown else ""
    return f"{_number(total)}{grew}"


def _input(item: Input | None) -> str:
    if item is None:
        return _NOTHING
    topic = escape(_short(item.topic))
    if item.quiet_s:
        return f"[yellow]{topic} nothing for {item.quiet_s:.1f} s[/]"
    ms = _number(item.age_s * 1e3)
    age = f"{ms} ms" if item.age_s < 1.0 else f"{_number(item.age_s)} s"
    return f"{topic}\n{_number(item.hz)} Hz, {age}"


def _short(topic: str) -> str:
    """The end of a long name, from a slash on."""
    parts = topic.split("/")
    while len(parts) > 2 and len("/".join(parts)) > _LONGEST:
        parts = parts[1:]
    found = "/".join(parts)
    return found if found == topic else f"…/{found}"


def to_mapping(row: Row) -> dict[str, Any]:
    """A row for programs: numbers as they came, null where there is none."""
    figures = row.figures
    told: dict[str, Any] = {
        "node": row.name,
        "state": STATES[row.level],
        "says": row.says,
        "silent_s": row.silent_s,
        "troubles": [{"key": t.key, "text": t.text, "do": t.do} for t in row.troubles],
    }
    if figures is None:
        return told
    return _without_nan(
        told
        | {
            "period_ms": figures.period_ms,
            "tick_ms": {"p50": figures.tick_ms[0], "p99": figures.tick_ms[1]},
            "tick_hz": figures.tick_hz,
            "counters": dict(figures.counters),
            "lately": dict(row.lately),
            "inputs": {
                item.topic: {
                    "received": item.received,
                    "hz": item.hz,
                    "age_s": item.age_s,
                    "latency_ms": dict(zip(("p50", "p99"), item.latency_ms, strict=True)),
                    "quiet_s": item.quiet_s,
                }
                for item in figures.inputs
            },
            "sent_hz": dict(figures.sent_hz),
            "dropped": dict(figures.dropped),
        }
    )


def _without_nan(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _without_nan(part) for key, part in value.items()}
    return None if isinstance(value, float) and math.isnan(value) else value
