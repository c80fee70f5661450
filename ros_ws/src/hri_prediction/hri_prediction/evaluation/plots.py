"""The plots of an evaluation."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import chi2

from hri_prediction.evaluation.folds import CONSTANT_VELOCITY, OURS, TOLD_DURATION, TOLD_TASK
from hri_prediction.evaluation.recordings import Recording
from hri_prediction.evaluation.run import Evaluation

EXAMPLES = 4


def _figure(columns: int, rows: int = 1, size: tuple[float, float] = (5.0, 3.8)) -> Any:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(size[0] * columns, size[1] * rows), layout="constrained")
    FigureCanvasAgg(figure)
    return figure, figure.subplots(rows, columns, squeeze=False)


def _style(name: str) -> dict[str, Any]:
    """Told more: dashed and dotted; ours: thick."""
    kinds = (OURS, CONSTANT_VELOCITY, "minimum_jerk", "mean_trajectory", "movement_primitives")
    kind = name.removesuffix(TOLD_TASK).removesuffix(TOLD_DURATION)
    line = ":" if name.endswith(TOLD_TASK) else "--" if name.endswith(TOLD_DURATION) else "-"
    return {
        "color": f"C{kinds.index(kind)}",
        "ls": line,
        "lw": 2.5 if name == OURS else 1.2,
        "label": name,
    }


def plot_errors(evaluation: Evaluation, path: Path) -> None:
    """Median end-point error against the observed share, and error against the time ahead."""
    figure, axes = _figure(2)
    results = evaluation.summary()
    shares = evaluation.settings.observed
    for name in evaluation.settings.predictors:
        ends = [
            results["by_observed"][f"{s:g}"][name]["endpoint_error_m"]["median"] for s in shares
        ]
        known = [(s, 1e3 * end) for s, end in zip(shares, ends, strict=True) if end is not None]
        axes[0, 0].plot(
            [100.0 * s for s, _ in known],
            [end for _, end in known],
            marker="o",
            ms=3,
            **_style(name),
        )
        ahead = results["predictors"][name]["error_at_horizon_m"]
        there = [(float(h), 1e3 * v["median"]) for h, v in ahead.items() if v["median"] is not None]
        axes[0, 1].plot(
            [h for h, _ in there], [v for _, v in there], marker="o", ms=3, **_style(name)
        )
    axes[0, 0].set(xlabel="share of the reach seen [%]", ylabel="median end-point error [mm]")
    axes[0, 1].set(
        xlabel="time ahead [s]",
        ylabel="median error [mm]",
        title=f"after {100.0 * evaluation.headline:g} %",
    )
    for axis in axes[0]:
        axis.set_yscale("log")
        axis.grid(alpha=0.3, which="both")
    figure.legend(
        *axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=4, fontsize=7
    )
    figure.savefig(path, dpi=90)


def plot_calibration(evaluation: Evaluation, path: Path) -> None:
    """Share of the true points within each central region against the region's nominal share."""
    figure, axes = _figure(1)
    axis = axes[0, 0]
    levels = np.linspace(0.0, 1.0, 101)
    for name in evaluation.settings.predictors:
        squared = evaluation.cell(name, evaluation.headline)["squared"]
        inside = chi2.cdf(squared[np.isfinite(squared)], 3)
        if inside.size:
            shares = np.searchsorted(np.sort(inside), levels, side="right") / inside.size
            axis.plot(100.0 * levels, 100.0 * shares, **_style(name))
    axis.plot([0, 100], [0, 100], color="0.5", lw=0.8)
    axis.set(
        xlabel="nominal region [%]",
        ylabel="true points within it [%]",
        title=f"after {100.0 * evaluation.headline:g} %",
    )
    axis.legend(fontsize=6)
    axis.grid(alpha=0.3)
    figure.savefig(path, dpi=90)


def plot_tubes(
    evaluation: Evaluation,
    recordings: Sequence[Recording],
    path: Path,
    rng: np.random.Generator,
) -> None:
    """What we predicted for a few reaches, with two standard deviations, over what came.

    Args:
        evaluation: The results.
        recordings: Those that were evaluated.
        path: PNG to write.
        rng: Chooses the reaches.
    """
    chosen = evaluation.cells["reach"]
    count = min(EXAMPLES, len(chosen))
    rows = np.sort(rng.choice(len(chosen), count, replace=False))
    figure, axes = _figure(3, count, (4.0, 2.3))
    config = evaluation.settings.config
    share = f"{evaluation.headline:g}"
    for row, pick in enumerate(rows):
        number, index = (int(value) for value in chosen[pick])
        track = recordings[number].track
        reach = recordings[number].reaches[index]
        now = float(evaluation.cells[f"tube_now/{share}"][pick])
        mean = evaluation.cells[f"tube_mean/{share}"][pick]
        deviation = 2.0 * evaluation.cells[f"tube_sd/{share}"][pick]
        times = now - reach.onset_s + config.step * np.arange(len(mean))
        shown = (track.time_s > reach.onset_s - 0.2) & (track.time_s < reach.end_s + 0.3)
        for column, name in enumerate("xyz"):
            axis = axes[row, column]
            axis.plot(
                track.time_s[shown] - reach.onset_s, track.keypoints[shown, 2, column], color="k"
            )
            axis.plot(times, mean[:, column], color="C0")
            axis.fill_between(
                times,
                mean[:, column] - deviation[:, column],
                mean[:, column] + deviation[:, column],
                color="C0",
                alpha=0.25,
            )
            axis.axvline(now - reach.onset_s, color="0.5", lw=0.8)
            axis.axvline(reach.duration_s, color="0.5", lw=0.8, ls=":")
            axis.set_xlim(-0.2, reach.duration_s + 0.3)
            axis.set_title(
                f"{track.subject} {track.task} {track.side}: wrist {name} [m]", fontsize=8
            )
            if row == count - 1:
                axis.set_xlabel("time since onset [s]")
    figure.suptitle(
        "black: measured; blue: predicted at the grey line, ± 2 standard deviations; dotted: end",
        fontsize=8,
    )
    figure.savefig(path, dpi=90)
