"""Recorded handovers, each pair of people left out once."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from hri_prediction.errors import ConfigError
from hri_sim.benchmark.report import markdown_table
from hri_sim.policies.datasets import handovers_file
from hri_sim.policies.evaluation import evaluate
from hri_sim.policies.evaluation_report import number
from hri_sim.policies.handovers import load_handovers, without_pair
from hri_sim.policy_report.laboratory import Laboratory
from hri_sim.policy_report.policies import HANDOVER_CELLS, PAIR, Policy, handover_policies

SOURCE = (
    "708 handovers of eight pairs by Khanna et al. (dyad_handover_kth, MIT); the taker is learnt from, its "
    "goal is where its hand was at the end. The recordings are of 24 Hz and begin in motion. Each line: "
    "a policy (2x9) that learnt from the other seven pairs, in this pair's encounters. d*: distance from "
    "which on partners are felt. With the thesis' 0.4 m, GRU3t and GRU are lost in the four encounters of "
    "pair 7 whose giver ends nearer than that to the taker's goal, as nobody's did from whom they "
    "learnt; that was seen first, and d* = 0.6 m chosen then."
)


def pairs() -> list[str]:
    """Names of the recorded pairs; none where there are no recordings."""
    try:
        return sorted({one.pair for one in load_handovers(handovers_file())})
    except ConfigError:
        return []


def measure(laboratory: Laboratory) -> dict[str, Any]:
    """Columns of table 5.2 by cell and pair, or why there are none."""
    try:
        handovers_file()
    except ConfigError as error:
        return {"skipped": str(error)}
    policies = handover_policies(laboratory.config, pairs(), laboratory.smoke)
    work = partial(_evaluate, runs=laboratory.runs)
    by_cell: dict[str, dict[str, Any]] = {}
    for cell, pair, one in laboratory.all("handovers", work, policies):
        by_cell.setdefault(cell, {})[pair] = one
    return {"cells": by_cell}


def _evaluate(policy: Policy, runs: Path) -> tuple[str, str, dict[str, Any]]:
    pair = policy.job.name.removeprefix(PAIR)
    own = without_pair(load_handovers(handovers_file()), pair)[1]
    return policy.job.config.cell, pair, evaluate(policy.read(runs), own, np.random.default_rng(0))


def _every(found: Mapping[str, Any]) -> list[tuple[str, str, Mapping[str, Any]]]:
    """Cell, pair and figures of all policies; none where nothing was measured."""
    cells = found.get("cells", {})
    return [(cell, pair, one) for cell, some in cells.items() for pair, one in some.items()]


def lines(found: Mapping[str, Any]) -> list[str]:
    """The table."""
    if "skipped" in found:
        return [f"Not measured: {found['skipped']}.\n"]
    rows = []
    for cell, pair, one in _every(found):
        noisy = one["noise"]
        rows.append(
            [
                f"{cell}, {HANDOVER_CELLS[cell]:g}",
                pair,
                str(one["encounters"]),
                f"{number(100.0 * one['reached_share'])} / {number(100.0 * noisy['reached_share'])}",
                *(
                    f"{number(one['terminal_mm'][name])} / {number(noisy['terminal_mm'][name])}"
                    for name in ("all_mean", "max")
                ),
                f"{number(one['reach_time_mse_s2'])} / {number(noisy['reach_time_mse_s2'])}",
                f"{number(one['kl_forward'])} / {number(noisy['kl_forward'])}",
                number(one["kl_floor"]["forward"]),
            ]
        )
    return [
        SOURCE + "\n",
        markdown_table(
            [
                "cell, d* [m]", "pair", "encounters", "reached [%]", "terminal, all [mm]", "max [mm]",
                "reach time MSE [s²]", "KL", "KL of people",
            ],
            rows,
        ),
    ]  # fmt: skip
