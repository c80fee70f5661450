"""Size of the network against detail (figure 5.4c): LSTMs trained with Adam."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from hri_sim.benchmark.report import markdown_table
from hri_sim.media.look import BLUE, GREEN, GREY, PURPLE, SKY, VERMILION
from hri_sim.policies.evaluation import evaluate, situations
from hri_sim.policies.evaluation_report import number
from hri_sim.policies.likeness_table import compared, policy_paths
from hri_sim.policy_report.laboratory import Laboratory, kept_set, kept_test
from hri_sim.policy_report.policies import Policy, large_policies
from hri_sim.reproduction.drawing import drawn

COLOURS = (SKY, GREEN, PURPLE, VERMILION)
LEARNT_SHOWN = 60
"""Encounters of those learnt from that paths are compared in."""


def measure(laboratory: Laboratory) -> dict[str, Any]:
    """Figures by policy, in tests and in what was learnt from; and the picture."""
    policies = large_policies(laboratory.config, laboratory.smoke)
    work = partial(_one, runs=laboratory.runs, smoke=laboratory.smoke)
    found = dict(laboratory.all("sizes", work, policies))
    picture = laboratory.out / "rnn" / "size.png"
    picture.parent.mkdir(parents=True, exist_ok=True)
    _draw(policies, found, laboratory, picture)
    return {"data": policies[0].job.data, "policies": found, "picture": "rnn/size.png"}


def _one(policy: Policy, runs: Path, smoke: bool) -> tuple[str, dict[str, Any]]:
    model = policy.read(runs)
    test = kept_test(policy.job.data, policy.data_seed, smoke)
    learnt = kept_set(policy.job.data, policy.data_seed).learnt
    learnt = learnt[:: max(len(learnt) // LEARNT_SHOWN, 1)]
    rng = np.random.default_rng(0)
    columns = evaluate(model, test, rng)
    return policy.name, {
        "units": list(model.network.units),
        "weights": int(sum(array.size for array in model.network.to_arrays().values())),
        "test": compared(policy_paths(model, test, rng), situations(test).human),
        "learnt": compared(policy_paths(model, learnt, rng), situations(learnt).human),
        "kl_forward": columns["kl_forward"],
        "reached_share": columns["reached_share"],
        "terminal_mm": columns["terminal_mm"],
        "step_us": columns["step_us"],
    }


def _draw(
    policies: list[Policy], found: Mapping[str, Any], laboratory: Laboratory, path: Path
) -> None:
    test = kept_test(policies[0].job.data, policies[0].data_seed, laboratory.smoke)
    # Representative: of all paths the one that is bent as much as the median one.
    bend = [
        np.linalg.norm(np.diff(one.hand, axis=0), axis=1).sum()
        / max(float(np.linalg.norm(one.hand[-1] - one.hand[0])), 1e-6)
        for one in test
    ]
    shown = test[int(np.argsort(bend)[3 * len(bend) // 4])]
    with drawn(path, 9.6, 4.2) as figure:
        left, right = figure.subplots(1, 2)
        left.plot(
            100 * shown.partner[:, 0], 100 * shown.partner[:, 1], "--", color=GREY, lw=1.2,
            label="partner",
        )  # fmt: skip
        left.plot(
            100 * shown.hand[:, 0], 100 * shown.hand[:, 1], color=BLUE, lw=3.0, alpha=0.8,
            label="person",
        )  # fmt: skip
        for policy, colour in zip(policies, COLOURS, strict=False):
            (made,) = policy_paths(policy.read(laboratory.runs), [shown], np.random.default_rng(0))
            units = "x".join(map(str, policy.job.config.units))
            left.plot(100 * made[:, 0], 100 * made[:, 1], color=colour, lw=1.6, label=units)
        left.set(xlabel="x [cm]", ylabel="y [cm]", title="One encounter from above")
        left.set_aspect("equal", adjustable="datalim")
        left.legend()
        weights = [one["weights"] for one in found.values()]
        for name, colour, marker in (("test", VERMILION, "o"), ("learnt", BLUE, "s")):
            label = {"test": "tests", "learnt": "learnt from"}[name]
            paired = [one[name]["paired"] for one in found.values()]
            right.plot(weights, paired, marker + "-", color=colour, label=label)
        right.set(
            xlabel="weights of the network", ylabel="distance to the person's path [mm]",
            title="Paired warping distance", xscale="log",
        )  # fmt: skip
        right.set_ylim(bottom=0.0)
        right.legend()


def lines(found: Mapping[str, Any]) -> list[str]:
    """Table and picture."""
    rows = [
        [
            "x".join(map(str, one["units"])),
            f"{one['weights']:,}",
            number(one["learnt"]["paired"], 4),
            number(one["test"]["paired"], 4),
            number(one["test"]["sample"], 4),
            number(one["kl_forward"]),
            number(100.0 * one["reached_share"]),
            f"{number(one['terminal_mm']['all_mean'])} / {number(one['terminal_mm']['max'])}",
            number(one["step_us"]),
        ]
        for one in found["policies"].values()
    ]
    return [
        f"LSTMs of two layers, both stages with Adam, learnt from {found['data']} and tested in its "
        "setups. Distances to the person's path are by warping [mm].\n",
        markdown_table(
            [
                "units", "weights", "paired, learnt from", "paired, tests", "sample, tests",
                "KL forward", "reached [%]", "terminal mean / max [mm]", "step [µs]",
            ],
            rows,
        ),
        f"![size against detail]({found['picture']})\n\nPath of one encounter, of those whose path is bent "
        "more than most, and distances by size (figure 5.4c of the thesis).\n",
    ]  # fmt: skip
