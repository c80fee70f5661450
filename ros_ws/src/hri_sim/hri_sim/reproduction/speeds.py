"""What a slower machine, and a better or worse prediction, change."""

from __future__ import annotations

from collections.abc import Mapping

from hri_sim.benchmark.episode import SLOWDOWNS
from hri_sim.benchmark.planners import PLANNERS, PlannerSetup, find_planners
from hri_sim.benchmark.report import markdown_table, mean_table, share_text
from hri_sim.benchmark.run import Plan
from hri_sim.reproduction.bars import ITOMP, OURS, STOMP
from hri_sim.reproduction.section import FEW, Measured, Scope, extent

_SETTINGS = PLANNERS[OURS].settings
PERFECT = PlannerSetup("ptomp_perfect", "PTOMP, told the true motion", "oracle", _SETTINGS)
UNSEEN = PlannerSetup("ptomp_unseen", "PTOMP, not told of the person", "unseen", _SETTINGS)
"""The ends of the scale of predictions."""
BETWEEN = (OURS, "ptomp_velocity", "ptomp_staying")
PEERS = (ITOMP, STOMP)
_SHOWN = {"ok": "ok", "clearance_2cm": "at least 2 cm clear"}


def plans(scope: Scope) -> dict[str, Plan]:
    """Each F, with every quality of prediction, and the peers."""
    setups = (*find_planners(BETWEEN), PERFECT, UNSEEN, *find_planners(PEERS))
    return {
        f"F{slow:g}": scope.first.plan(setups, float(slow), conditions=FEW) for slow in SLOWDOWNS
    }


def lines(measured: Mapping[str, Measured]) -> list[str]:
    """Shares by prediction and F, and how they got there."""
    found = [one.results for one in measured.values()]
    slow = [f"F = {results['budget']:g}" for results in found]
    order = (PERFECT.name, *BETWEEN, UNSEEN.name, *PEERS)
    parts = [f"{extent(measured)}. PTOMP with other predictions, then its peers:\n"]
    for key, words in _SHOWN.items():
        rows = [
            [
                f"`{name}`",
                *(
                    share_text(r["planners"][name][key], r["planners"][name]["ci95"][key])
                    for r in found
                ),
            ]
            for name in order
        ]
        parts.append(markdown_table([words, *slow], rows))
    parts += [
        f"How `{OURS}` got there:\n",
        mean_table(
            {name: results["planners"][OURS] for name, results in zip(slow, found, strict=True)}
        ),
        "\n".join(f"- `{setup.name}`: {setup.text}." for setup in (PERFECT, UNSEEN)) + "\n",
    ]
    return parts
