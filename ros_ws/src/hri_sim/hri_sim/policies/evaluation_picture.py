"""Paths from above: a policy, its partner, and the person whose place it takes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from hri_planner.rnn.encounters import Encounter
from hri_planner.rnn.metrics.reaching import reach_steps
from hri_planner.rnn.model import PolicyModel
from hri_sim.media.look import BLUE, GREEN, GREY, VERMILION
from hri_sim.policies.evaluation import motions, situations, until
from hri_sim.reproduction.drawing import drawn

EXAMPLES = 6
_COLUMNS = 3
_MARKED_STEPS = 8
"""Dots along the paths: about one each quarter of a second."""


def examples(encounters: Sequence[Encounter], count: int) -> list[Encounter]:
    """Those in which the hands come nearest to each other, of as many setups as there are."""
    order = sorted(
        encounters, key=lambda one: float(np.linalg.norm(one.hand - one.partner, axis=1).min())
    )
    seen: dict[str, int] = {}
    ranks = []
    for one in order:
        ranks.append(seen.setdefault(one.setup, 0))
        seen[one.setup] += 1
    by_rank = sorted(zip(ranks, range(len(order)), strict=True))
    return [order[index] for _, index in by_rank[:count]]


def draw_paths(path: Path, name: str, model: PolicyModel, encounters: Sequence[Encounter]) -> None:
    """A picture of a few encounters."""
    shown = examples(encounters, EXAMPLES)
    found = situations(shown)
    made = motions(model, found, 0.0, np.random.default_rng(0))
    steps = reach_steps(made, found.goal)
    rows = -(-len(shown) // _COLUMNS)
    with drawn(path, 3.2 * _COLUMNS, 3.0 * rows + 0.5) as figure:
        panels = figure.subplots(rows, _COLUMNS, squeeze=False).ravel()
        for axes in panels[len(shown) :]:
            axes.set_axis_off()
        for axes, one, hand, step in zip(panels, shown, made, steps, strict=False):
            paths = (
                (one.partner, GREY, "--", "partner"),
                (one.hand, BLUE, "-", "person"),
                (until(hand, step + 8), VERMILION, "-", f"policy {name}"),
            )
            for points, colour, line, label in paths:
                x, y = 100.0 * points[:, 0], 100.0 * points[:, 1]
                axes.plot(x, y, line, color=colour, lw=1.8, label=label)
                axes.plot(
                    x[::_MARKED_STEPS], y[::_MARKED_STEPS], "o", color=colour, ms=3.0, mew=0.0
                )
                axes.plot(x[0], y[0], "s", color=colour, ms=5.0, mew=0.0)
            goal = 100.0 * one.goal
            axes.plot(goal[0], goal[1], "o", ms=11, mfc="none", mec=GREEN, mew=1.6, label="goal")
            axes.set_title(f"{one.setup}{', back' if one.backward else ''}")
            axes.set_aspect("equal", adjustable="datalim")
            axes.set_xlabel("x [cm]")
            axes.set_ylabel("y [cm]")
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=4)
        figure.suptitle(
            "From above; squares: starts, a dot every 0.26 s", x=0.01, ha="left", fontsize=9
        )
