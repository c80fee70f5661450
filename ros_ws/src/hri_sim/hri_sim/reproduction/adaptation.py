"""Time steps and roll-outs chosen when the motion starts, beside those that are always the same."""

from __future__ import annotations

from collections.abc import Mapping

from hri_planner.adaptation.origin import warning
from hri_sim.benchmark.adapted import ADAPTED, TRAINED_AT
from hri_sim.benchmark.planners import find_planners
from hri_sim.benchmark.report import difference_table, mean_table, share_table
from hri_sim.benchmark.run import Plan
from hri_sim.reproduction.bars import OURS
from hri_sim.reproduction.section import FEW, Measured, Scope, extent

FIXED = "ptomp_fixed"
"""What adaptation has to beat."""
SLOWDOWN = float(TRAINED_AT)
"""F at which the models that ship were trained."""


def plans(scope: Scope) -> dict[str, Plan]:
    """The best fixed cell first, then the default, then what chooses."""
    names = (FIXED, OURS, *(name for name, _, _ in ADAPTED if name != FIXED))
    chosen = names[:3] if scope.smoke else names
    return {
        f"F{SLOWDOWN:g}": scope.first.plan(find_planners(chosen), SLOWDOWN, conditions=FEW),
    }


def lines(measured: Mapping[str, Measured]) -> list[str]:
    """Shares, means, and how much less than the best fixed cell."""
    (one,) = measured.values()
    planners, outdated = one.results["planners"], one.results["trained_for_another_planner"]
    return [
        *([warning(outdated) + "\n"] if outdated else []),
        f"{extent(measured)}, F = {SLOWDOWN:g}. The best fixed cell "
        "stands first: adaptation has to beat it. [adaptation.md](adaptation.md) has the figures of the "
        "training.\n",
        share_table(planners),
        mean_table(planners),
        difference_table(one.results["differences"]),
        "\n".join(f"- `{name}`: {found['text']}." for name, found in planners.items()) + "\n",
    ]
