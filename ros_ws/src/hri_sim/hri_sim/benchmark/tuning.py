"""Margins of every planner, tuned in the same way: as many trials each, on the tuning tasks alone.

Two settings of each planner are varied on a grid of nine cells: the margin, and what widens it (kappa by
the prediction's uncertainty, or growth with the horizon where the prediction says little of it). What is
wanted is clearance: the mean over the machines of the share of motions that arrive with 2 cm and more,
then that with 5 cm, then the time to the goal.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

from hri_sim.benchmark.planners import PLANNERS, PlannerSetup
from hri_sim.benchmark.report import markdown_table, share_text
from hri_sim.benchmark.run import SMOKE_TASKS, Plan

SPLIT = "tuning"
SLOWDOWNS = (1.0, 64.0)
CONDITIONS = 3
"""Of each task."""
MARGINS_M = (0.04, 0.07, 0.10)
WIDE_MARGINS_M = (0.07, 0.10, 0.13)
"""For PTOMP's peers, which know less of what comes, or plan but once."""
KAPPAS = (0.25, 0.5, 1.0)
GROWTHS_MS = (0.02, 0.10, 0.25)


@dataclass(frozen=True)
class Grid:
    """What is varied of a planner.

    Attributes:
        planner: Its name.
        setting: The second setting, beside the margin.
        values: Of it.
        margins: Of it [m].
    """

    planner: str
    setting: str
    values: tuple[float, ...]
    margins: tuple[float, ...] = MARGINS_M

    @property
    def cells(self) -> list[PlannerSetup]:
        """The planner with the settings of each cell."""
        return [self._cell(margin, value) for margin, value in product(self.margins, self.values)]

    def _cell(self, margin: float, value: float) -> PlannerSetup:
        base = PLANNERS[self.planner]
        least = min(base.config.margin_min, margin)
        settings: dict[str, Any] = {
            **dict(base.settings), "margin": margin, "margin_min": least, self.setting: value,
        }  # fmt: skip
        if self.setting == "kappa":
            settings["kappa_min"] = min(base.config.kappa_min, value)
        name = f"{self.planner}: margin {100.0 * margin:g} cm, {self.setting} {value:g}"
        return PlannerSetup(name, base.text, base.observer, tuple(settings.items()))

    def shipped(self) -> tuple[float, float]:
        """Margin and second setting that the planner ships with."""
        config = PLANNERS[self.planner].config
        return config.margin, float(getattr(config, self.setting))


GRIDS = (
    Grid("ptomp", "kappa", KAPPAS),
    Grid("itomp", "margin_growth", GROWTHS_MS, WIDE_MARGINS_M),
    Grid("itomp_timing", "margin_growth", GROWTHS_MS, WIDE_MARGINS_M),
    Grid("stomp", "kappa", KAPPAS, WIDE_MARGINS_M),
    Grid("stomp_prior", "kappa", KAPPAS, WIDE_MARGINS_M),
)
"""Planners that are tuned."""


def plans(grid: Grid, *, seed: int, smoke: bool) -> dict[float, Plan]:
    """The work for one planner, by F."""
    cells = grid.cells[:: len(grid.cells) - 1] if smoke else grid.cells
    tasks: dict[str, Any] = {"tasks": SMOKE_TASKS, "conditions": 1} if smoke else {}
    sizes = tasks or {"conditions": CONDITIONS}
    return {
        slow: Plan(tuple(cells), SPLIT, slow, (seed,), **sizes)
        for slow in (SLOWDOWNS[:1] if smoke else SLOWDOWNS)
    }


def score(found: Sequence[Mapping[str, Any]]) -> tuple[float, float, float]:
    """What is compared of a cell, from its figures on each machine; larger is better."""
    # Where no motion arrives, the mean time has no value: the last of all.
    times = [float("inf") if f["time_to_goal_s"] is None else f["time_to_goal_s"] for f in found]
    late = sum(times) / len(times)
    shares = (sum(f[key] for f in found) / len(found) for key in ("clearance_2cm", "clearance_5cm"))
    two, five = shares
    return two, five, -late


def rows(results: Mapping[float, Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Cells of one planner with their figures by F, the best first."""
    machines = list(results.values())
    names = list(machines[0]["planners"])
    names.sort(
        key=lambda name: score([machine["planners"][name] for machine in machines]), reverse=True
    )
    return [
        {
            "cell": name,
            "by_slowdown": {
                f"{slow:g}": {
                    key: machine["planners"][name][key]
                    for key in ("ok", "clearance_2cm", "clearance_5cm", "time_to_goal_s")
                }
                for slow, machine in results.items()
            },
        }
        for name in names
    ]


def table(found: Sequence[Mapping[str, Any]]) -> str:
    """The cells of one planner."""
    slows = list(found[0]["by_slowdown"])
    head = ["cell"]
    for slow in slows:
        head += [f"ok, F = {slow}", "≥ 2 cm", "≥ 5 cm", "time to goal [s]"]
    lines = []
    for row in found:
        cells = [str(row["cell"]).split(": ", 1)[1]]
        for slow in slows:
            said = row["by_slowdown"][slow]
            late = said["time_to_goal_s"]
            cells += [share_text(said[k], None) for k in ("ok", "clearance_2cm", "clearance_5cm")]
            cells.append("–" if late is None else f"{late:.2f}")
        lines.append(cells)
    return markdown_table(head, lines)
