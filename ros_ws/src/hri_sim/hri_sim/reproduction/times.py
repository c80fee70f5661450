"""How long the work took in real time."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from hri_sim.benchmark.report import markdown_table
from hri_sim.benchmark.run import ORACLE_SLOWDOWN, marks
from hri_sim.reproduction.section import Measured


def times(measured: Iterable[Measured]) -> dict[str, Any]:
    """Milliseconds a condition by F and planner, and hours of one core in all; work counts once."""
    spent: dict[tuple[float, str], dict[Any, tuple[float, int]]] = {}
    for one in measured:
        mark = marks(one.plan)
        for unit, result in one.done.items():
            key = (one.plan.slowdown_of(unit.planner), unit.planner)
            wall = (result.wall_s, len(result.outcomes))
            spent.setdefault(key, {})[mark[unit.planner], unit] = wall
    sums = {key: _sums(found.values()) for key, found in sorted(spent.items())}
    return {
        "ms_per_condition": {
            f"{slow:g}": {
                name: round(1e3 * wall / count, 1)
                for (other, name), (wall, count) in sums.items()
                if other == slow
            }
            for slow in sorted({slow for slow, _ in sums})
        },
        "conditions": sum(count for _, count in sums.values()),
        "core_hours": round(sum(wall for wall, _ in sums.values()) / 3600.0, 3),
    }


def _sums(found: Iterable[tuple[float, int]]) -> tuple[float, int]:
    """Sums of both numbers."""
    walls, counts = zip(*found, strict=True)
    return sum(walls), sum(counts)


def lines(found: dict[str, Any]) -> list[str]:
    """The table and the total."""
    by_slow = found["ms_per_condition"]
    names = list(dict.fromkeys(name for times in by_slow.values() for name in times))
    rows = [
        [f"`{name}`", *(f"{t[name]:.0f}" if name in t else "–" for t in by_slow.values())]
        for name in names
    ]
    return [
        markdown_table(["ms a condition, one core", *(f"F = {slow}" for slow in by_slow)], rows),
        f"In all {found['conditions']} conditions and {found['core_hours']:.2f} hours of one core, beside "
        f"whatever else the machine did; F = {ORACLE_SLOWDOWN:g} is that of the oracle; pictures are not "
        "counted.\n",
    ]
