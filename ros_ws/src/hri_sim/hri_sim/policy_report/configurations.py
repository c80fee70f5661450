"""Table 5.2, and the same of further seeds."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from hri_sim.benchmark.report import markdown_table
from hri_sim.policies.evaluation import evaluate
from hri_sim.policies.evaluation_report import floor_text, number
from hri_sim.policy_report import thesis
from hri_sim.policy_report.laboratory import Laboratory, kept_test
from hri_sim.policy_report.policies import Policy, seed_policies

_KL_NOTE = (
    "Divergences (in nats) are those of ProMPs of paths from their starts on, with eight basis functions "
    "and a shrinkage that are the same throughout; the thesis says of neither, so its divergences and "
    "ours are of different scales. *People*: the median divergence of a random half of the people's "
    "paths from the other half, which nobody can be expected to fall below."
)

COLUMNS = (
    "KL backward",
    "KL forward",
    "reach time MSE [s²]",
    "terminal, reached [mm]",
    "reached [%]",
    "terminal, all [mm]",
    "terminal, max [mm]",
)


def measure(laboratory: Laboratory) -> dict[str, Any]:
    """All columns of all policies, by ``seed_N/CK``."""
    policies = seed_policies(laboratory.config, laboratory.smoke)
    policies.sort(key=lambda policy: (policy.data_seed, policy.job.data))
    work = partial(_evaluate, runs=laboratory.runs, smoke=laboratory.smoke)
    return dict(laboratory.all("configurations", work, policies))


def _evaluate(policy: Policy, runs: Path, smoke: bool) -> tuple[str, dict[str, Any]]:
    test = kept_test(policy.job.data, policy.data_seed, smoke)
    found = evaluate(policy.read(runs), test, np.random.default_rng(policy.data_seed))
    return policy.name, {"data": policy.job.data, "seed": policy.data_seed, **found}


def by_number(found: Mapping[str, Any], seed: int) -> list[tuple[str, Mapping[str, Any]]]:
    """Configurations of a seed in the order of the table."""
    mine = [(name.rpartition("/")[2], one) for name, one in found.items() if one["seed"] == seed]
    return sorted(mine, key=lambda pair: int(pair[0].removeprefix("C")))


def lines(found: Mapping[str, Any]) -> list[str]:
    """Tables of the first seed beside the thesis' and of the others."""
    rows, floors = [], {}
    for name, one in by_number(found, 0):
        theirs = thesis.LEARNT[name]
        floors[one["data"]] = f"{one['data']}: {floor_text(one)}"
        rows.append(
            [
                name,
                one["cell"],
                "x".join(map(str, one["units"])),
                f"{one['data']}",
                *(f"{mine} ({his})" for mine, his in zip(_columns(one), theirs, strict=True)),
                *_further(one),
            ]
        )
    parts = [
        "Without / with noise N(0, 9 mm²) for each axis and step on goal and partner's hand, in brackets "
        "the thesis' figures of its own recordings. Reached: within 30 mm of the goal from some time on, "
        "of 200 steps of 32 ms. D1 and D2 are tested in setups, and with people, from which nothing was "
        "learnt; D3 in those learnt from.\n",
        markdown_table(
            ["", "cell", "units", "data", *COLUMNS],
            rows,
        ),
        f"{_KL_NOTE} People: {'; '.join(floors.values())}.\n",
    ]
    others = [
        [f"{name}, seed {seed}", one["cell"], one["data"], *_columns(one), *_further(one)]
        for seed in sorted({one["seed"] for one in found.values()} - {0})
        for name, one in by_number(found, seed)
    ]
    if others:
        parts += [
            "Further seeds, each with people and setups of its own and another start of the weights:\n",
            markdown_table(["", "cell", "data", *COLUMNS], others),
        ]
    return parts


def _columns(one: Mapping[str, Any]) -> list[str]:
    pairs = [
        (found["kl_backward"], found["kl_forward"], found["reach_time_mse_s2"],
         found["terminal_mm"]["reached_mean"], 100.0 * found["reached_share"])
        for found in (one, one["noise"])
    ]  # fmt: skip
    return [f"{number(exact)} / {number(noisy)}" for exact, noisy in zip(*pairs, strict=True)]


def _further(one: Mapping[str, Any]) -> list[str]:
    return [
        f"{number(one['terminal_mm'][name])} / {number(one['noise']['terminal_mm'][name])}"
        for name in ("all_mean", "max")
    ]
