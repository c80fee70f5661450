"""Bars whose figures other commands measure, read from the result files that they left."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hri_prediction.results.origin import origin_line


@dataclass(frozen=True)
class ElsewhereBar:
    """One figure of a result file.

    Attributes:
        what: In words.
        folder: Of its ``results.json``, beside the report.
        keys: Where it stands in there.
        wanted: The bar, in the unit.
        unit: Of what is printed.
        scale: The figure is multiplied by this.
        at_most: Whether the bar is the largest value, not the smallest.
    """

    what: str
    folder: str
    keys: tuple[str, ...]
    wanted: float
    unit: str
    scale: float = 1.0
    at_most: bool = False

    def read(self, results: Path) -> tuple[float, str] | None:
        """The value and where it is from; none without a usable file."""
        try:
            content = json.loads((results / self.folder / "results.json").read_text())
            value = content
            for key in self.keys:
                value = value[key]
            origin = origin_line(content["origin"])
            return self.scale * float(value), f"`{self.folder}/results.json`: {origin}"
        except (OSError, ValueError, KeyError, TypeError):
            return None


ELSEWHERE = (
    ElsewhereBar(
        "configuration in float64, NumPy ÷ ours", "kernel", ("ratios", "config", "numpy"), 60.0, "×"
    ),
    ElsewhereBar("iteration, NumPy ÷ ours", "kernel", ("ratios", "iteration", "numpy"), 20.0, "×"),
    ElsewhereBar("roll-outs", "kernel", ("rollouts_per_s",), 2e5, "1/s"),
    ElsewhereBar(
        "forecast, median: sample to bound cost model",
        "kernel",
        ("forecast_ms",),
        2.0,
        "ms",
        at_most=True,
    ),
    ElsewhereBar(
        "forecast, median: sample to prediction",
        "promp",
        ("predictor_us", "ours"),
        2.0,
        "ms",
        scale=1e-3,
        at_most=True,
    ),
    ElsewhereBar(
        "late plans in the live graph",
        "graph",
        ("replan_miss_share",),
        0.5,
        "%",
        scale=100.0,
        at_most=True,
    ),
)


def judge_elsewhere(results: Path) -> list[dict[str, Any]]:
    """All of them as :func:`.bars.judge` gives its own; ``met`` is none where nothing was measured.

    Args:
        results: Folder with the folders of result files.
    """
    judged = []
    for bar in ELSEWHERE:
        found = bar.read(results)
        value, origin = (None, None) if found is None else found
        met = None
        if value is not None:
            met = value <= bar.wanted if bar.at_most else value >= bar.wanted
        judged.append(
            {
                "what": bar.what,
                "wanted": bar.wanted,
                "unit": bar.unit,
                "at_most": bar.at_most,
                "measured": value,
                "met": met,
                "origin": origin,
            }
        )
    return judged
