"""Sections that hold variants of one planner against it: ablations, and settings that are changed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from hri_planner.ptomp.variants import variants
from hri_sim.benchmark.planners import PLANNERS, PlannerSetup, find_planners
from hri_sim.benchmark.report import (
    MEAN_HEADS,
    SHARE_HEADS,
    difference_table,
    markdown_table,
    paired_table,
    share_text,
)
from hri_sim.benchmark.run import Plan
from hri_sim.reproduction.bars import OURS
from hri_sim.reproduction.bars import SLOWDOWNS as HEADLINE_SLOWDOWNS
from hri_sim.reproduction.section import FEW, Measured, Scope, extent

ABLATIONS = (
    *(name for name, found in variants().items() if found.kind != "planner"),
    "itomp_timing",
)
"""Planners that lack something that `OURS` has, and a peer that has more than usual."""
SLOWDOWNS = (1.0, 8.0, 64.0)
KAPPAS = (0.0, 0.25, 1.0, 2.0, 3.0)
MARGINS_M = (0.03, 0.05, 0.09, 0.12)
ITERATIONS = (0, 5, 20, 40, 80)
"""Most of a replan; 40 is what the live node ships with."""
_SHOWN_MEANS = ("time_to_goal_s", "accel_cost", "clearance_m")


def ablation_plans(scope: Scope) -> dict[str, Plan]:
    """All at once, on the reference machine and on slower ones."""
    names = (OURS, *(ABLATIONS[:1] if scope.smoke else ABLATIONS))
    return {
        f"F{slow:g}": scope.first.plan(find_planners(names), slow, conditions=FEW)
        for slow in SLOWDOWNS
    }


def robustness_plans(scope: Scope) -> dict[str, Plan]:
    """One for each setting and machine."""
    changed = {
        "kappa": [with_kappa(kappa) for kappa in KAPPAS],
        "margin": [with_margin(margin) for margin in MARGINS_M],
        "iterations": [with_iterations(most) for most in ITERATIONS],
    }
    return {
        f"{name}, F = {slow:g}": scope.first.plan(
            (PLANNERS[OURS], *(setups[:: len(setups) - 1] if scope.smoke else setups)),
            slow,
            conditions=FEW,
        )
        for slow in HEADLINE_SLOWDOWNS
        for name, setups in changed.items()
    }


def with_kappa(kappa: float) -> PlannerSetup:
    """Ours with another kappa, which may not fall below it when the robot is late."""
    least = min(PLANNERS[OURS].config.kappa_min, kappa)
    settings = (("kappa", kappa), ("kappa_min", least))
    return _changed(f"kappa_{kappa:g}", f"with kappa {kappa:g}", settings)


def with_margin(margin: float) -> PlannerSetup:
    """Ours with another margin [m], which may not grow when the robot is late."""
    least = min(PLANNERS[OURS].config.margin_min, margin)
    settings = (("margin", margin), ("margin_min", least))
    return _changed(f"margin_{margin:g}", f"with a margin of {100.0 * margin:g} cm", settings)


def with_iterations(most: int) -> PlannerSetup:
    """Ours with so many iterations a replan at most, whatever the budget pays for."""
    text = f"with at most {most} iterations a replan"
    return replace(_changed(f"iterations_{most}", text, ()), max_iterations=most)


def _changed(name: str, text: str, settings: tuple[tuple[str, float], ...]) -> PlannerSetup:
    ours = PLANNERS[OURS]
    # Later settings win: those of ours first.
    return PlannerSetup(
        f"{OURS}_{name}", f"{OURS} {text}", ours.observer, (*ours.settings, *settings)
    )


def lines(measured: Mapping[str, Measured]) -> list[str]:
    """For each plan how good they are, and what the first planner has more, motion by motion."""
    parts = [
        f"{extent(measured)}. Below each table: what the first "
        "planner has more than each other, in the same conditions.\n"
    ]
    for name, one in measured.items():
        planners, differences = one.results["planners"], one.results["differences"]
        slowdown = f"F = {one.results['budget']:g}"
        parts += [
            f"### {slowdown if slowdown not in name else name[0].upper() + name[1:]}\n",
            _values_table(planners),
            difference_table(differences),
            paired_table(differences),
        ]
    texts = {n: f["text"] for one in measured.values() for n, f in one.results["planners"].items()}
    return [*parts, "\n".join(f"- `{name}`: {text}." for name, text in texts.items()) + "\n"]


def _values_table(planners: Mapping[str, Mapping[str, Any]]) -> str:
    """Shares and means; their intervals are in the differences."""
    rows = []
    for name, found in planners.items():
        cells = [f"`{name}`", *(share_text(found[key], None) for key in SHARE_HEADS)]
        for key in _SHOWN_MEANS:
            value, form = found[key], MEAN_HEADS[key][1]
            cells.append("–" if value is None else format(value, form))
        rows.append(cells)
    head = [*SHARE_HEADS.values(), *(MEAN_HEADS[key][0] for key in _SHOWN_MEANS)]
    return markdown_table(["planner", *head], rows)
