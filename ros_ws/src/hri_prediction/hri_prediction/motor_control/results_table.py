"""Tables and pictures of explained reaches."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from hri_prediction.motor_control.batch import Outcome
from hri_prediction.motor_control.costs import ABBREVIATIONS


def summary_rows(outcomes: Sequence[Outcome], names: Sequence[str]) -> list[tuple[str, ...]]:
    """Mean and standard deviation over all reaches, a row for each cost and one for the mix.

    Returns:
        Rows of (model, alpha, its uncertainty, hand [cm], joints [deg]).
    """
    done = [each for each in outcomes if not each.error]
    if not done:
        return []
    alpha = np.array([each.alpha for each in done])
    sd = np.array([each.sd for each in done])
    single = np.array([each.single_cm for each in done], dtype=float)
    joints = np.array([each.single_joint_deg for each in done], dtype=float)
    rows = [
        (
            f"{name.replace('_', ' ')} ({ABBREVIATIONS[name]})",  # so it is called in the picture
            _spread(alpha[:, i]),
            # At a corner of the simplex it is another figure: how much more, or less, a weight may be.
            _median(sd[(alpha[:, i] > 0.0) & (alpha[:, i] < 1.0), i]),
            _spread(single[:, i]),
            _spread(joints[:, i]),
        )
        for i, name in enumerate(names)
    ]
    whole = np.array([each.distance_cm for each in done])
    turned = np.array([each.joint_distance_deg for each in done])
    return [*rows, ("composite", "1", "–", _spread(whole), _spread(turned))]


HEAD = ("model", "alpha", "uncertainty (median)", "hand [cm]", "joints [deg]")


def _median(values: np.ndarray) -> str:
    return f"{np.median(values):.3f}" if len(values) else "–"


def _spread(values: np.ndarray) -> str:
    values = values[np.isfinite(values)]
    if not len(values):
        return "–"
    if len(values) == 1:
        return f"{values[0]:.3g}"
    return f"{values.mean():.3g} ± {values.std():.2g}"


def markdown(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table in Markdown."""
    lines = ["| " + " | ".join(head) + " |", "|" + " --- |" * len(head)]
    return "\n".join([*lines, *("| " + " | ".join(row) + " |" for row in rows)]) + "\n"


def draw(outcomes: Sequence[Outcome], names: Sequence[str], path: Path) -> None:
    """Draw errors of each cost alone and of the mix, and the weights of all reaches (like figure 2.7).

    Args:
        outcomes: At least one that was explained.
        names: The costs.
        path: PNG to write.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    done = [each for each in outcomes if not each.error]
    labels = [ABBREVIATIONS[name] for name in names]
    figure = Figure(figsize=(12.0, 3.8), layout="constrained")
    FigureCanvasAgg(figure)
    hand, joints, weights = figure.subplots(1, 3)
    for axis, alone, mixed, title in (
        (hand, [e.single_cm for e in done], [e.distance_cm for e in done], "hand [cm]"),
        (
            joints,
            [e.single_joint_deg for e in done],
            [e.joint_distance_deg for e in done],
            "joints [deg]",
        ),
    ):
        columns = [*np.array(alone, dtype=float).T, np.array(mixed)]
        columns = [column[np.isfinite(column)] for column in columns]
        axis.boxplot(columns, showfliers=False)
        axis.set_xticks(range(1, len(columns) + 1), [*labels, "mix"])
        axis.set_title(f"distance to what was seen, {title}", fontsize=9)
        axis.set_ylim(bottom=0.0)
    weights.boxplot(list(np.array([each.alpha for each in done]).T), showfliers=False)
    weights.set_xticks(range(1, len(labels) + 1), labels)
    weights.set_ylim(0.0, 1.0)
    weights.set_title("weights", fontsize=9)
    figure.suptitle(f"{len(done)} reaches; boxes: quartiles", fontsize=9)
    figure.savefig(path, dpi=110)
