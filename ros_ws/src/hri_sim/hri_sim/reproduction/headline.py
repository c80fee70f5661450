"""The planners side by side in all conditions with all seeds, beside the figures of the thesis."""

from __future__ import annotations

from collections.abc import Mapping

from hri_sim.benchmark.conditions import CONDITIONS_A_TASK, TASKS
from hri_sim.benchmark.planners import NOMINAL, find_planners
from hri_sim.benchmark.report import (
    KINDS,
    MEANINGS,
    difference_table,
    markdown_table,
    mean_table,
    share_table,
    share_text,
)
from hri_sim.benchmark.run import Plan
from hri_sim.reproduction.bars import ITOMP, OURS, STOMP
from hri_sim.reproduction.section import Measured, Scope

PLANNERS = (OURS, ITOMP, STOMP, "stomp", NOMINAL)
"""Who takes part, ours first."""
SLOWDOWNS = (1.0, 64.0)
THESIS = {
    OURS: ("PTOMP", 402, "98 %"),
    ITOMP: ("ITOMP", 67, "27.1 %"),
}
"""Of 450 conditions of the thesis: collision-free, and the share after both parameters were lowered by
one standard deviation, by the planner of ours that corresponds."""


def plans(scope: Scope) -> dict[str, Plan]:
    """One for each F."""
    return {f"F{slow:g}": scope.plan(find_planners(PLANNERS), slow) for slow in SLOWDOWNS}


def lines(measured: Mapping[str, Measured]) -> list[str]:
    """Tables of each F."""
    found = list(measured.values())
    parts = [_thesis_table(found[0])]
    for one in found:
        results = one.results
        feasible = share_text(results["oracle_feasible"], None)
        parts += [
            f"### F = {results['budget']:g}\n",
            f"{results['conditions']} conditions of {results['tasks']} tasks, "
            f"seeds {', '.join(map(str, results['seeds']))}. PTOMP that knows the person's motion and has "
            f"a large budget is ok in {feasible} of them.\n",
            share_table(results["planners"]),
            mean_table(results["planners"]),
            difference_table(results["differences"]),
        ]
        for kind, text in KINDS.items():
            some = {name: said[kind] for name, said in results["planners"].items() if said[kind]}
            if some:
                share = share_text(results["shares"][kind], None)
                parts += [f"{text} ({share} of the conditions) alone:\n", share_table(some)]
    parts += [
        MEANINGS + "\n",
        "\n".join(
            f"- `{name}`: {said['text']}." for name, said in found[0].results["planners"].items()
        )
        + "\n",
    ]
    return parts


def _thesis_table(measured: Measured) -> str:
    """Collision-free in the thesis, and ours, which must have arrived too."""
    rows = []
    conditions = TASKS * CONDITIONS_A_TASK
    for name, (theirs, count, lowered) in THESIS.items():
        said = measured.results["planners"][name]
        rows.append(
            [
                f"{theirs}: {count} of {conditions} ({100.0 * count / conditions:.1f} %)",
                lowered,
                f"`{name}`: {share_text(said['ok'], said['ci95']['ok'])}",
                share_text(said["clearance_2cm"], said["ci95"]["clearance_2cm"]),
            ]
        )
    head = ["thesis, collision-free", "parameters lowered", "here, ok", "≥ 2 cm"]
    return markdown_table(head, rows)
