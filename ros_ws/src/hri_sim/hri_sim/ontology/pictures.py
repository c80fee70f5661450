"""Pictures of what was taken for what, and of where people sit in each case."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from hri_prediction.ontology.evaluation import Confusion
from hri_sim.ontology.layouts import Layout, undisturbed

_COLOURS = ("#d9a400", "#2b6cb0")


def draw_confusions(path: Path, shown: Mapping[str, Confusion], order: Sequence[int]) -> None:
    """Normalised confusion matrices side by side.

    Args:
        path: PNG.
        shown: By title.
        order: Of the classes.
    """
    figure, all_axes = plt.subplots(
        1, len(shown), figsize=(5.2 * len(shown), 5.0), squeeze=False, layout="constrained"
    )
    for axes, (title, one) in zip(all_axes[0], shown.items(), strict=True):
        rows = np.searchsorted(one.classes, order)
        shares = 100.0 * one.normalised[np.ix_(rows, rows)]
        axes.imshow(shares, cmap="Blues", vmin=0.0, vmax=100.0)
        for (row, column), share in np.ndenumerate(shares):
            if share >= 0.5:
                colour = "white" if share > 55.0 else "black"
                size = 8 if len(order) < 10 else 5
                axes.text(
                    column, row, f"{share:.0f}", ha="center", va="center", color=colour, size=size
                )
        axes.set_xticks(range(len(order)), list(map(str, order)), size=7)
        axes.set_yticks(range(len(order)), list(map(str, order)), size=7)
        axes.set_xlabel("taken for")
        axes.set_ylabel("what it was")
        axes.set_title(f"{title}: {100 * one.overall:.1f} %", size=9)
    figure.savefig(path, dpi=110)
    plt.close(figure)


def draw_layouts(path: Path, layouts: Mapping[str, Layout]) -> None:
    """Where people and their action spaces are, from above, with the ways of their hands and elbows.

    Args:
        path: PNG.
        layouts: By title.
    """
    columns = 5
    rows = -(-len(layouts) // columns)
    figure, grid = plt.subplots(
        rows, columns, figsize=(13.0, 2.7 * rows), squeeze=False, layout="constrained"
    )
    for axes in grid.flat[len(layouts) :]:
        axes.set_axis_off()
    for axes, (title, layout) in zip(grid.flat, layouts.items(), strict=False):
        arms = undisturbed(layout)
        for agent, colour in enumerate(_COLOURS):
            tips, elbows = arms[agent, :, 3], arms[agent, :, 1]
            axes.plot(tips[:, 0], tips[:, 1], color=colour, linewidth=1.5)
            axes.plot(elbows[:, 0], elbows[:, 1], "--", color=colour, linewidth=0.8)
            for arm in arms[agent][::7]:
                axes.plot(arm[:, 0], arm[:, 1], color=colour, linewidth=0.6, alpha=0.5)
            spaces = layout.spaces[agent]
            size = 90 if agent == 0 else 35
            axes.scatter(
                spaces[:, 0], spaces[:, 1], s=size, color=colour, edgecolor="black", zorder=3
            )
            axes.scatter(*layout.shoulders[agent, :2], marker="s", s=40, color=colour)
            if np.linalg.norm(layout.bow[agent]) > 0.05:
                middle = 0.5 * (spaces[0] + spaces[1])
                axes.scatter(*middle[:2], marker="X", s=40, color="#444444", zorder=2)
        axes.set_title(title, size=7)
        axes.set_aspect("equal")
        axes.set_xlim(-0.75, 0.75)
        axes.set_ylim(-0.8, 0.8)
        axes.tick_params(labelsize=5)
    figure.suptitle(
        "Each case as it is simulated, from above [m]. Discs: action spaces (shared: one in the other), "
        "lines: of hands, dashed: of elbows, crosses: what is gone round, squares: shoulders.",
        fontsize=8,
    )
    figure.savefig(path, dpi=110)
    plt.close(figure)
