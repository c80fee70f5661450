"""How long training took, and how long a step takes."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from hri_prediction.results.origin import origin_line
from hri_sim.benchmark.report import markdown_table
from hri_sim.policies.evaluation import step_time_us
from hri_sim.policies.evaluation_report import number
from hri_sim.policy_report.laboratory import Laboratory
from hri_sim.policy_report.policies import Policy, large_policies, seed_policies

_OF_EACH = ("cell", "units", "seed", "optimiser")
"""Parameters of training that differ from policy to policy."""


def measure(laboratory: Laboratory) -> dict[str, Any]:
    """Seconds of training and of steps, by policy; one after the other, on one core."""
    laboratory.progress.say("times")
    policies = [
        *seed_policies(laboratory.config, laboratory.smoke),
        *large_policies(laboratory.config, laboratory.smoke),
    ]
    return {policy.name: _one(policy, laboratory.runs) for policy in policies}


def _one(policy: Policy, runs: Path) -> dict[str, Any]:
    model, record = policy.read(runs), policy.record(runs)
    return {
        "cell": model.network.kind,
        "units": list(model.network.units),
        "step_us": step_time_us(model),
        "training_s": record.get("processor_seconds"),
        "rounds": len(record.get("rounds", ())) or None,
        "origin": record.get("origin"),
        "parameters": {
            name: value for name, value in record.get("config", {}).items() if name not in _OF_EACH
        },
    }


def lines(found: Mapping[str, Any]) -> list[str]:
    """By network: the slowest of its policies."""
    groups: dict[tuple[str, str], list[Mapping[str, Any]]] = {}
    for one in found.values():
        groups.setdefault((one["cell"], "x".join(map(str, one["units"]))), []).append(one)
    rows = []
    for (cell, units), some in sorted(groups.items()):
        seconds = [one["training_s"] for one in some if one["training_s"] is not None]
        rows.append(
            [
                f"{cell} {units}",
                str(len(some)),
                number(float(np.median(seconds)) if seconds else None),
                number(max(seconds) if seconds else None),
                number(max(one["step_us"] for one in some)),
            ]
        )
    return [
        "Processor time of training [s] as the policies' files say, on one core (a training that was "
        "broken off counts from when it went on); a step is the median of 400, in NumPy, one hand.\n",
        markdown_table(
            ["network", "policies", "training, median [s]", "slowest [s]", "step, slowest [µs]"],
            rows,
        ),
        *_provenance(found),
    ]


def _provenance(found: Mapping[str, Any]) -> list[str]:
    """With which parameters and sources the policies were trained."""
    parameters = {json.dumps(one["parameters"]) for one in found.values() if one["parameters"]}
    origins = {origin_line(one["origin"]) for one in found.values() if one["origin"]}
    if not parameters or not origins:
        return ["With which parameters these policies were trained, their files do not say.\n"]
    said = ", ".join(f"{k} {v}" for k, v in json.loads(min(parameters)).items())
    many = "All" if len(parameters) == 1 else f"With {len(parameters)} sets of parameters, one:"
    return [f"{many} trained with: {said}. Trained at: {' '.join(sorted(origins))}\n"]
