"""Ours beside the figures of the thesis, like beside like."""

from __future__ import annotations

from collections.abc import Sequence

from hri_sim.benchmark.adapted import TRAINED_AT
from hri_sim.benchmark.conditions import CONDITIONS_A_TASK, TASKS
from hri_sim.benchmark.planners import PLANNERS
from hri_sim.benchmark.report import markdown_table, share_text
from hri_sim.reproduction.bars import ITOMP, OURS
from hri_sim.reproduction.section import Measured

_CONDITIONS = TASKS * CONDITIONS_A_TASK
FIGURES = (
    ("PTOMP, parameters by Gaussian processes", "402 of 450 (89.3 %)", "ptomp_gpr"),
    ("the same, both lowered by one standard deviation", "98 %", "ptomp_gpr_lower"),
    ("–", "–", OURS),
    ("ITOMP, parameters by the same processes", "67 of 450 (14.9 %)", None),
    ("the same, both lowered by one standard deviation", "27.1 %", None),
    ("–", "–", ITOMP),
)
"""Planner of the thesis and its share without collision; ours that corresponds, if there is one."""


def lines(measured: Sequence[Measured]) -> list[str]:
    """The table.

    Args:
        measured: Plans in which these planners may be; of several, the first that has a planner counts.
    """
    ours = PLANNERS[OURS].config
    fixed = f"({ours.num_timesteps}, {ours.num_rollouts})"
    rows = []
    for theirs, share, name in FIGURES:
        one = next((m for m in measured if name in m.results["planners"]), None)
        if one is None or name is None:
            rows.append(
                [theirs, share, "–" if name is None else f"`{name}`: not measured", "–", "–"]
            )
            continue
        said, results = one.results["planners"][name], one.results
        chosen = "" if PLANNERS[name].adaptation else f", fixed {fixed}"
        motions = results["conditions"] * len(results["seeds"])
        rows.append(
            [
                theirs,
                share,
                f"`{name}`{chosen}, F = {results['budget']:g}, {motions} motions",
                share_text(said["ok"], said["ci95"]["ok"]),
                share_text(said["clearance_2cm"], said["ci95"]["clearance_2cm"]),
            ]
        )
    return [
        f"The thesis' figures are of {_CONDITIONS} conditions of its own, without collision; ours must "
        "have arrived too. Its planners had time steps and roll-outs chosen by Gaussian processes, in the "
        "second figure lowered by one standard deviation of their errors. Ours with such a choice were "
        f"trained and run at F = {TRAINED_AT}, one seed, and stand beside it; all others have {fixed} "
        "throughout. An ITOMP with such a choice there is not: those lines of the thesis have no "
        "counterpart. This is no comparison: scenes, people and robot's start differ, and so does the core "
        "that ITOMP shares here: a search for the final posture, a tuned margin that grows with the "
        "horizon, and replans that take a fraction of their interval. Which of these explains how much was "
        "not measured.\n",
        markdown_table(["thesis", "collision-free", "here", "ok", "≥ 2 cm"], rows),
    ]
