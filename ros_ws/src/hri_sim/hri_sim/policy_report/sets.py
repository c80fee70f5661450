"""Table 5.1: the sizes of the sets, and how exactly labels replay them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import partial
from typing import Any

import numpy as np

from hri_planner.rnn.encounters import Encounter
from hri_planner.rnn.integration import accelerations, initial_velocity, integrate
from hri_planner.rnn.model import STEP_S
from hri_prediction.errors import ConfigError
from hri_sim.benchmark.report import markdown_table
from hri_sim.policies.datasets import SETS, handovers_file
from hri_sim.policies.handovers import load_handovers
from hri_sim.policy_report import thesis
from hri_sim.policy_report.laboratory import Laboratory, kept_set
from hri_sim.policy_report.policies import SEEDS

HANDOVERS = "handovers"


def measure(laboratory: Laboratory) -> dict[str, Any]:
    """Sizes, and the largest error of a replay, of each set and of the recorded handovers."""
    names = ["D2"] if laboratory.smoke else [name for name in SETS if name not in ("D3-2", "D3-3")]
    seeds = SEEDS[:1] if laboratory.smoke else SEEDS
    sized = laboratory.all("sets", partial(_sizes, seeds=seeds), names)
    found: dict[str, Any] = dict(sized)
    try:
        encounters = load_handovers(handovers_file())
        found[HANDOVERS] = {
            "samples": sum(map(len, encounters)),
            "encounters": len(encounters),
            "longest": max(map(len, encounters)),
            "replay_error_m": replay_error(encounters),
        }
    except ConfigError as error:
        found[HANDOVERS] = {"skipped": str(error)}
    return found


def _sizes(name: str, seeds: tuple[int, ...]) -> tuple[str, dict[str, Any]]:
    worst = 0.0
    for seed in reversed(seeds):
        found = kept_set(name, seed)
        everything = (*found.learnt, *found.validation, *found.test)
        worst = max(worst, replay_error(everything))
    return name, {
        "samples": sum(map(len, found.learnt)),
        "encounters": len(found.learnt),
        "longest": max(map(len, found.learnt)),
        "validation": len(found.validation),
        "tests": len(found.test),
        "seeds": len(seeds),
        "replay_error_m": worst,
    }


def replay_error(encounters: Iterable[Encounter]) -> float:
    """Largest distance of a recorded hand from the one that its own accelerations lead to [m]."""
    worst = 0.0
    for one in encounters:
        asked = accelerations(one.hand, STEP_S)
        replayed = integrate(one.hand[0], initial_velocity(one.hand, STEP_S), asked, STEP_S)
        worst = max(worst, float(np.linalg.norm(replayed - one.hand, axis=1).max()))
    return worst


def lines(found: Mapping[str, Any]) -> list[str]:
    """The table."""
    rows = []
    for name, one in found.items():
        if "skipped" in one:
            rows.append([name, f"skipped: {one['skipped']}", *5 * ["–"]])
            continue
        his = "{:,} / {} / {}".format(*thesis.SETS[name]) if name in thesis.SETS else "–"
        rows.append(
            [
                name,
                f"{one['samples']:,}",
                str(one["encounters"]),
                str(one["longest"]),
                str(one.get("tests", "–")),
                his,
                f"{one['replay_error_m']:.1e}",
            ]
        )
    return [
        "Samples and encounters that are learnt from are counted with the three rotations (handovers "
        "without them). D3-2 and D3-3 are of the size of D3-1. People are simulated: two hands that give "
        "way to each other. Replay: the largest distance of a recorded hand from the one that its labels "
        "lead to, over all encounters of all seeds.\n",
        markdown_table(
            [
                "set", "samples", "encounters", "longest [steps]", "tests",
                "thesis (samples / longest / tests)", "replay [m]",
            ],
            rows,
        ),
    ]  # fmt: skip
