"""What a lead over another planner is made of: differences of planners that differ in one thing."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from hri_sim.benchmark.planners import find_planners
from hri_sim.benchmark.report import (
    MEAN_HEADS,
    SHARE_HEADS,
    markdown_table,
    mean_table,
    points_text,
    share_table,
    signed_text,
)
from hri_sim.benchmark.run import Plan
from hri_sim.benchmark.summary import by_task, compare
from hri_sim.reproduction.bars import ITOMP, OURS, SLOWDOWNS
from hri_sim.reproduction.section import Measured, Scope, extent
from hri_sim.reproduction.variants import with_iterations

TIMING, VELOCITY, CORE = "itomp_timing", "ptomp_velocity", "core_only"
SEARCH = with_iterations(0)
"""Ours without the optimiser: the best of the ready-made motions, direct, slowed, around, back."""
PLANNERS = (OURS, ITOMP, TIMING, VELOCITY, CORE, "stomp")
"""Who is compared beside it; stomp knows of the person what is known at the start."""
STEPS = (
    (OURS, ITOMP, "all that PTOMP has more"),
    (TIMING, ITOMP, "time scaling and ways around, at constant velocity"),
    (OURS, CORE, "time scaling and ways around, with ProMP prediction"),
    (OURS, TIMING, "ProMP prediction and PTOMP's margin, both with time scaling"),
    (OURS, VELOCITY, "another predictor, PTOMP's margin kept, which was not tuned for it"),
    (CORE, ITOMP, "ProMP prediction and PTOMP's margin, both without time scaling"),
    (OURS, SEARCH.name, "the optimiser, beside a choice among ready-made motions"),
)
"""A planner, what is subtracted, and what they differ in."""
_MEANS = ("time_to_goal_s", "accel_cost")


def leads(measured: Measured) -> dict[str, dict[str, Any]]:
    """Differences of all pairs, by ``ours - other``."""
    return {
        f"{name} - {other}": compare(by_task(measured.done, name), by_task(measured.done, other))
        for name, other, _ in STEPS
    }


def plans(scope: Scope) -> dict[str, Plan]:
    """All conditions, the first seed, for each F."""
    setups = (*find_planners(PLANNERS), SEARCH)
    return {f"F{slow:g}": scope.first.plan(setups, slow) for slow in SLOWDOWNS}


def lines(measured: Mapping[str, Measured]) -> list[str]:
    """All planners that take part, and what differences are made of, for each F."""
    parts = [f"{extent(measured)}.\n"]
    for one in measured.values():
        planners = one.results["planners"]
        parts += [f"### F = {one.results['budget']:g}\n", share_table(planners)]
        parts += [mean_table(planners), *difference_lines(one)]
    texts = next(iter(measured.values())).results["planners"].items()
    return [*parts, "\n".join(f"- `{name}`: {said['text']}." for name, said in texts) + "\n"]


def difference_lines(measured: Measured) -> list[str]:
    """The table, and in a sentence how much of the lead is due to what."""
    found = leads(measured)
    rows = []
    for name, other, text in STEPS:
        less = found[f"{name} - {other}"]
        cells = [f"`{name}` − `{other}`", text]
        cells += [points_text(less[key], less["ci95"][key]) for key in SHARE_HEADS]
        cells += [signed_text(less[key], less["ci95"][key], MEAN_HEADS[key][1]) for key in _MEANS]
        rows.append(cells)
    head = ["difference [points]", "what it is worth", *SHARE_HEADS.values()]
    head += [MEAN_HEADS[key][0] for key in _MEANS]
    return [
        _sentence(found, measured.plan.slowdown),
        markdown_table(head, rows),
    ]


def _sentence(found: Mapping[str, Mapping[str, Any]], slowdown: float) -> str:
    def points(name: str, other: str) -> str:
        less = found[f"{name} - {other}"]
        return f"{100.0 * less['ok']:+.1f} ({100.0 * less['clearance_2cm']:+.1f} at 2 cm)"

    return (
        f"What the lead over `{ITOMP}` is made of, F = {slowdown:g}, in points of ok: "
        f"{points(OURS, ITOMP)} in all. Time scaling and ways around alone, given to `{ITOMP}`, are worth "
        f"{points(TIMING, ITOMP)}. Another prediction, each with a margin of its own, is worth "
        f"{points(CORE, ITOMP)} where neither has these, {points(OURS, TIMING)} where both have them. The "
        f"optimiser is worth {points(OURS, SEARCH.name)} beside the best of the ready-made motions.\n"
    )
