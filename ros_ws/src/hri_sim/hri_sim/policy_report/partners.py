"""Partners who give way otherwise than those of training."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

from hri_sim.benchmark.report import markdown_table
from hri_sim.policies.evaluation_report import PARTNER_HEAD, partner_rows
from hri_sim.policies.partners import SETUPS, beside_partners
from hri_sim.policy_report.laboratory import Laboratory
from hri_sim.policy_report.policies import Policy

SEED = 77
COUNT = 25


def measure(laboratory: Laboratory) -> dict[str, Any]:
    """Figures by policy and law."""
    work = partial(_beside, runs=laboratory.runs, count=1 if laboratory.smoke else COUNT)
    return dict(laboratory.all("partners", work, laboratory.compared()))


def _beside(policy: Policy, runs: Path, count: int) -> tuple[str, dict[str, Any]]:
    return policy.name, beside_partners(policy.read(runs), SEED, count)


def lines(found: Mapping[str, Any]) -> list[str]:
    """A table for each policy."""
    encounters = next(iter(next(iter(found.values())).values()))["encounters"]
    parts = [
        f"{encounters} encounters in {SETUPS} unseen setups, in which partner and policy answer each "
        "other: nothing is replayed, and there is no filter. `push`: the law that training data were made "
        "with; `sidestep`: to the right of the line of approach; `none`: does not give way; `hesitate`: "
        "stops until the other is gone. *People*: the simulated learner in the policy's place. Nearest: "
        "median of the smallest distances of both hands; where partners rest beside the goal all come "
        "near. Time MSE: beside the simulated person in the same encounter.\n"
    ]
    for name, partners in found.items():
        parts += [f"`{name}`:\n", markdown_table(PARTNER_HEAD, partner_rows(partners))]
    return parts
