"""The planners side by side in all conditions with all seeds."""

from __future__ import annotations

from collections.abc import Mapping

from hri_sim.benchmark.planners import NOMINAL, find_planners
from hri_sim.benchmark.report import (
    MEANINGS,
    difference_table,
    kind_tables,
    mean_table,
    paired_table,
    share_table,
    share_text,
)
from hri_sim.benchmark.run import Plan
from hri_sim.reproduction import starts
from hri_sim.reproduction.bars import ITOMP, OURS, SLOWDOWNS, STOMP
from hri_sim.reproduction.section import Measured, Scope

PLANNERS = (OURS, ITOMP, STOMP, NOMINAL)
"""Who takes part, ours first."""


def plans(scope: Scope) -> dict[str, Plan]:
    """One for each F."""
    return {f"F{slow:g}": scope.plan(find_planners(PLANNERS), slow) for slow in SLOWDOWNS}


def lines(measured: Mapping[str, Measured]) -> list[str]:
    """Tables of each F."""
    found = list(measured.values())
    parts = []
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
            paired_table(results["differences"]),
            *kind_tables(results),
            "A robot that sets off late meets less of the person. When each does, and in how many "
            "conditions the nominal motion would still collide then, whoever plans:\n",
            starts.table(starts.starts(one.plan)),
        ]
    parts += [
        MEANINGS + "\n",
        "\n".join(
            f"- `{name}`: {said['text']}." for name, said in found[0].results["planners"].items()
        )
        + "\n",
    ]
    return parts
