"""What is wanted of the predictor, held against what was measured."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from hri_prediction.evaluation.folds import LEAVE_ONE_OUT, OURS, WITHIN
from hri_prediction.evaluation.report import figure

END_POINT_MM = {f"adl_{WITHIN}": 41.0, f"adl_{LEAVE_ONE_OUT}": 47.0}
"""What a plain ProMP reaches that is told the duration: not to be worse than that [mm]."""
REGIONS = {"coverage50": (42.0, 58.0), "coverage95": (90.0, 98.0)}
"""Smallest and largest share of the points [%]."""
RECORDED = {"adl": "seated reaches (ADL)", "dfki": "pick and place (DFKI)"}
"""Recordings whose regions are to hold, by the beginning of the evaluations' names."""
REGION_PROTOCOLS = (WITHIN, LEAVE_ONE_OUT)
DURATION_SHARE = 0.35
DURATION_MS = 80.0
"""Largest median error of the duration of a simulated reach, after `DURATION_SHARE` of it [ms]."""
BAR_HEAD = "| what | reaches | measured | wanted | |\n| --- | --- | --- | --- | --- |"


@dataclass(frozen=True)
class Bar:
    """One figure that is wanted of one set of reaches.

    Args:
        what: The figure, with its unit.
        reaches: Data set and protocol.
        measured: None where there was nothing to measure; that is a miss.
        low: Smallest value wanted; None: any.
        high: Largest value wanted.
    """

    what: str
    reaches: str
    measured: float | None
    low: float | None
    high: float

    @property
    def met(self) -> bool:
        """Whether it was reached, before any rounding."""
        if self.measured is None:
            return False
        return (self.low is None or self.measured >= self.low) and self.measured <= self.high

    @property
    def row(self) -> str:
        """A line of the table under `BAR_HEAD`."""
        wanted = f"≤ {self.high:g}" if self.low is None else f"{self.low:g}–{self.high:g}"
        verdict = "met" if self.met else "**missed**"
        measured = figure(self.measured, ".1f")
        return f"| {self.what} | {self.reaches} | {measured} | {wanted} | {verdict} |"


def bars(results: Mapping[str, Mapping[str, Any]]) -> list[Bar]:
    """One for each bar and each evaluation that it is for, in the order of the bars.

    Args:
        results: The evaluations by name, ``<data>_<protocol>``.
    """
    return [*_end_points(results), *_regions(results), *_durations(results)]


def bar_lines(results: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """How many are met, and the table; nothing where none was measured."""
    found = bars(results)
    if not found:
        return []
    missed = sum(not bar.met for bar in found)
    return [
        f"Wanted and measured, of `{OURS}`: {len(found) - missed} met, {missed} missed. End points "
        f"and regions are after 30 % of each reach, durations after {100.0 * DURATION_SHARE:g} %, over "
        "those reaches that had been noticed by then.",
        "",
        BAR_HEAD,
        *(bar.row for bar in found),
        "",
    ]


def _end_points(results: Mapping[str, Mapping[str, Any]]) -> Iterator[Bar]:
    for name, high in END_POINT_MM.items():
        if name in results:
            end = results[name]["predictors"][OURS]["endpoint_error_m"]["median"]
            reaches = f"{RECORDED['adl']}, {results[name]['protocol']}"
            yield Bar("median end-point error [mm]", reaches, _scaled(end, 1e3), None, high)


def _regions(results: Mapping[str, Mapping[str, Any]]) -> Iterator[Bar]:
    for field, (low, high) in REGIONS.items():
        what = f"points within the {field.removeprefix('coverage')} % region [%]"
        for data, words in RECORDED.items():
            for protocol in REGION_PROTOCOLS:
                found = results.get(f"{data}_{protocol}")
                if found is not None:
                    share = _scaled(found["predictors"][OURS][field], 100.0)
                    yield Bar(what, f"{words}, {protocol}", share, low, high)


def _durations(results: Mapping[str, Mapping[str, Any]]) -> Iterator[Bar]:
    for found in results.values():
        error = found["duration_error_s"].get(f"{DURATION_SHARE:g}")
        if "people" in found and error is not None:
            reaches = f"simulated, `{found['people']}`, {found['protocol']}"
            median = _scaled(error["median"], 1e3)
            yield Bar("median duration error [ms]", reaches, median, None, DURATION_MS)


def _scaled(value: float | None, scale: float) -> float | None:
    # What is exactly on a bar must not miss it by a rounding error of the scaling.
    return None if value is None else round(scale * value, 9)
