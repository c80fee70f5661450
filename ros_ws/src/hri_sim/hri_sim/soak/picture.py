"""A soak over time: memory, latency and size of the bags, with the faults."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib
import numpy as np

from hri_sim.media.look import BLUE, GREEN, GREY, PURPLE, SKY, STYLE, VERMILION
from hri_sim.soak.faults import GROUPS
from hri_sim.soak.judging import latencies
from hri_sim.soak.log import FAULT, SAMPLE, SoakRecord
from hri_sim.soak.memory import lives

_GROUP_COLOURS = {"kills": VERMILION, "pauses": PURPLE, "mocap": GREEN, "goals": GREY}
_NODE_COLOURS = (BLUE, VERMILION, GREEN, PURPLE, SKY, (0.90, 0.62, 0.0), GREY)
_WINDOWS = 60
"""Parts of the run whose latencies are put together."""


def draw_soak(record: SoakRecord, path: Path) -> None:
    """Draw a soak into a file."""
    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    samples = record.of(SAMPLE)
    with plt.rc_context(STYLE):
        figure, (memory, latency, files) = plt.subplots(
            3, 1, figsize=(9.0, 7.5), sharex=True, layout="constrained", height_ratios=(3, 2, 2)
        )
        _draw_memory(memory, samples)
        _draw_latency(latency, samples)
        minutes = [s["s"] / 60.0 for s in samples]
        files.plot(minutes, [sum(s["bags"].values()) / 1e6 for s in samples], color=BLUE)
        files.set(title="Size of the bags", ylabel="MB", xlabel="minutes")
        files.set_ylim(bottom=0.0)
        _draw_faults((memory, latency, files), record.of(FAULT))
        figure.savefig(path, dpi=130)
        plt.close(figure)


def _draw_memory(axes: Any, samples: list[dict[str, Any]]) -> None:
    by_label: dict[str, list[tuple[list[float], list[float]]]] = {}
    for (label, _), points in lives(samples).items():
        life = ([s / 60.0 for s, _ in points], [f["memory_mb"] for _, f in points])
        by_label.setdefault(label, []).append(life)
    for index, (label, parts) in enumerate(sorted(by_label.items())):
        colour = _NODE_COLOURS[index % len(_NODE_COLOURS)]
        for number, (times, values) in enumerate(parts):
            axes.plot(times, values, color=colour, label="" if number else label)
    axes.set(title="Memory of each process", ylabel="MB")
    axes.set_ylim(bottom=0.0)
    if by_label:
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))


def _draw_latency(axes: Any, samples: list[dict[str, Any]]) -> None:
    axes.set(title="Newest sample used to trajectory", ylabel="ms")
    times, values = latencies(samples)
    if not len(times):
        return
    edges = np.linspace(times.min(), times.max() + 1e-9, _WINDOWS + 1)
    number = np.digitize(times, edges)
    for share, colour in ((50, BLUE), (99, SKY)):
        found = [
            (np.mean(times[number == n]) / 60.0, np.percentile(values[number == n], share))
            for n in np.unique(number)
        ]
        name = "median" if share == 50 else "99th percentile"
        axes.plot(*np.transpose(found), color=colour, marker=".", markersize=3, label=name)
    axes.set_ylim(bottom=0.0)
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))


def _draw_faults(all_axes: tuple[Any, ...], faults: list[dict[str, Any]]) -> None:
    for group, kinds in GROUPS.items():
        own = [f["s"] / 60.0 for f in faults if f["fault"] in kinds]
        for axes in all_axes:
            for number, minute in enumerate(own):
                label = group if axes is all_axes[-1] and not number else ""
                axes.axvline(
                    minute, color=_GROUP_COLOURS[group], linewidth=0.7, alpha=0.6, label=label
                )
    if faults:
        all_axes[-1].legend(title="faults", loc="center left", bbox_to_anchor=(1.0, 0.5))
