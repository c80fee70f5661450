"""Pictures of the hybrid predictor on trial, like figures 3.9 and 3.10 of the thesis."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from hri_prediction.motor_control.costs import ABBREVIATIONS
from hri_sim.hybrid.first_guesses import GUESSES

DPI = 110
_FEW = 8
"""Names of more people than these are written small."""


def _figure(width: float, height: float) -> Figure:
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def errors(found: Mapping[str, Any], path: Path) -> None:
    """Errors by reaches seen of each person, for each target; first guesses; divergences (figure 3.9)."""
    targets = sorted({target for by_target in found["errors_cm"].values() for target in by_target})
    many = len(found["errors_cm"]) > _FEW
    figure = _figure(12.0, 6.4)
    axes = figure.subplots(2, max(len(targets), 2))
    for axis, target in zip(axes[0], targets, strict=False):
        for person, by_target in found["errors_cm"].items():
            if target not in by_target:
                continue
            seen = [int(count) for count in by_target[target]]
            axis.plot(seen, list(by_target[target].values()), "o-", ms=3, lw=1, label=person)
        axis.set_xscale("symlog")
        axis.set_xticks(seen, [str(count) for count in seen])
        axis.set_title(f"{target}, from optimal control", fontsize=9)
        axis.set_xlabel("reaches seen")
        axis.set_ylim(bottom=0.0)
    axes[0][0].set_ylabel("error of the rest [cm]")
    axes[0][0].legend(fontsize=6 if many else 7, ncols=3 if many else 1)
    means, divergence = axes[1][0], axes[1][1]
    for guess in GUESSES:
        curve = found["curves"][guess]["warped_cm"]
        seen = [int(count) for count in curve]
        means.plot(seen, list(curve.values()), "o-", ms=3, label=guess)
    means.set_xscale("symlog")
    means.set_xticks(seen, [str(count) for count in seen])
    means.set_xlabel("reaches seen")
    means.set_ylabel("error of the rest [cm]")
    means.set_ylim(bottom=0.0)
    means.set_title("first guesses, mean over all", fontsize=9)
    means.legend(fontsize=7)
    updates = np.arange(1, len(found["divergence"]) + 1)
    divergence.semilogy(updates, found["divergence"], ".-", ms=3)
    divergence.axhline(0.05, color="k", lw=0.8, ls="--")
    divergence.set_xlabel("update")
    divergence.set_title("KL divergence by weight, median", fontsize=9)
    for axis in axes[1][2:]:
        axis.set_axis_off()
    figure.savefig(path, dpi=DPI)


def weights(found: Mapping[str, Any], names: list[str], path: Path) -> None:
    """Errors with guessed and new weights, and the new weights, of each person (figure 3.10).

    Where people have true weights, these are beside the new ones.
    """
    people = found["people"]
    true = all(each["truth"] for by_target in people.values() for each in by_target.values())
    targets = sorted({target for by_target in people.values() for target in by_target})
    figure = _figure(12.0, 6.0)
    axes = np.atleast_2d(figure.subplots(2, max(len(targets), 1), squeeze=False))
    for column, target in enumerate(targets):
        own = {name: by[target] for name, by in people.items() if target in by}
        places = np.arange(len(own))
        above, below = axes[0][column], axes[1][column]
        # Weights that have no optimum have no bar.
        before = [
            np.nan if each["before_cm"] is None else each["before_cm"] for each in own.values()
        ]
        above.bar(places - 0.2, before, 0.4, label="guessed")
        above.bar(places + 0.2, [each["after_cm"] for each in own.values()], 0.4, label="new")
        above.set_title(target, fontsize=9)
        bottom, true_bottom = np.zeros(len(own)), np.zeros(len(own))
        for i, name in enumerate(names):
            new = np.array([each["alpha"][i] for each in own.values()])
            below.bar(
                places - 0.2, new, 0.36, bottom=bottom, color=f"C{i}", label=ABBREVIATIONS[name]
            )
            bottom = bottom + new
            if true:
                truth = np.array([each["truth"][i] for each in own.values()])
                below.bar(places + 0.2, truth, 0.36, bottom=true_bottom, color=f"C{i}", alpha=0.45)
                true_bottom = true_bottom + truth
        for axis in (above, below):
            turned = {"rotation": 90, "fontsize": 7} if len(own) > _FEW else {}
            axis.set_xticks(places, list(own), **turned)
    axes[0][0].set_ylabel("optimum to mean path [cm]")
    axes[1][0].set_ylabel("weights: new, and (pale) true" if true else "new weights")
    axes[0][0].legend(fontsize=7)
    # Bars fill all of the lower row: costs are named beside it.
    figure.legend(*axes[1][0].get_legend_handles_labels(), fontsize=7, loc="outside right lower")
    figure.savefig(path, dpi=DPI)
