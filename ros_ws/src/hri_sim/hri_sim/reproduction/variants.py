"""Sections that hold variants of one planner against it: ablations, and settings that are changed."""

from __future__ import annotations

from collections.abc import Mapping

from hri_planner.ptomp.variants import variants
from hri_sim.benchmark.planners import PLANNERS, PlannerSetup, find_planners
from hri_sim.benchmark.report import (
    MEAN_HEADS,
    SHARE_HEADS,
    markdown_table,
    points_text,
    share_text,
)
from hri_sim.benchmark.run import Plan
from hri_sim.reproduction.bars import OURS
from hri_sim.reproduction.section import FEW, Measured, Scope

ABLATIONS = (
    *(name for name, found in variants().items() if found.kind != "planner"),
    "itomp_timing",
)
"""Planners that lack something that `OURS` has, and a peer that has more than usual."""
KAPPAS = (0.0, 0.25, 1.0, 2.0)
MARGINS_M = (0.03, 0.05, 0.09, 0.12)
_LOST = "clearance_2cm"
_SHOWN_MEANS = ("time_to_goal_s", "accel_cost", "clearance_m")


def ablation_plans(scope: Scope) -> dict[str, Plan]:
    """All at once, on the reference machine and on a slow one."""
    names = (OURS, *(ABLATIONS[:1] if scope.smoke else ABLATIONS))
    return {
        f"F{slow:g}": scope.first.plan(find_planners(names), slow, conditions=FEW)
        for slow in (1.0, 64.0)
    }


def robustness_plans(scope: Scope) -> dict[str, Plan]:
    """One for each setting, on the reference machine."""
    step = len(KAPPAS) - 1 if scope.smoke else 1  # the ends
    return {
        name: scope.first.plan((PLANNERS[OURS], *setups), 1.0, conditions=FEW)
        for name, setups in (
            ("kappa", map(with_kappa, KAPPAS[::step])),
            ("margin", map(with_margin, MARGINS_M[::step])),
        )
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


def _changed(name: str, text: str, settings: tuple[tuple[str, float], ...]) -> PlannerSetup:
    ours = PLANNERS[OURS]
    # Later settings win: those of ours first.
    return PlannerSetup(
        f"{OURS}_{name}", f"{OURS} {text}", ours.observer, (*ours.settings, *settings)
    )


def lines(measured: Mapping[str, Measured]) -> list[str]:
    """A table for each plan, with what is lost against the first planner of it."""
    parts = [
        f"The first {FEW} conditions of each task, the first seed; in the last column what the first "
        "planner has more, in the same tasks.\n"
    ]
    for one in measured.values():
        planners = one.results["planners"]
        parts.append(f"F = {one.results['budget']:g}:\n")
        first = next(iter(planners))
        head = ["planner", *SHARE_HEADS.values()]
        head += [
            *(MEAN_HEADS[key][0] for key in _SHOWN_MEANS),
            f"{SHARE_HEADS[_LOST]} lost [points]",
        ]
        rows = []
        for name, found in planners.items():
            cells = [f"`{name}`", *(share_text(found[key], None) for key in SHARE_HEADS)]
            for key in _SHOWN_MEANS:
                value, form = found[key], MEAN_HEADS[key][1]
                cells.append("–" if value is None else format(value, form))
            less = one.results["differences"].get(f"{first} - {name}")
            cells.append("–" if less is None else points_text(less[_LOST], less["ci95"][_LOST]))
            rows.append(cells)
        parts.append(markdown_table(head, rows))
        parts.append(
            "\n".join(f"- `{n}`: {found['text']}." for n, found in planners.items()) + "\n"
        )
    return parts
