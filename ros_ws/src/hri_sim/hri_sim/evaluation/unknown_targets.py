"""The table of reaches to targets that nobody has shown, beside those to targets that are known."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from hri_prediction.evaluation.folds import LEAVE_ONE_OUT, NEW_TASK, OURS
from hri_prediction.evaluation.report import figure

SHARES = ("0.3", "0.5")
_FIGURES = ("end point [mm]", "50 % region", "95 % region")


def unknown_target_lines(titles: Mapping[str, str], results: Mapping[str, Any]) -> list[str]:
    """A chapter with one table a data set; nothing where none was evaluated.

    Args:
        titles: Words for the data sets by name.
        results: The evaluations by name, ``<data>_<protocol>``.
    """
    lines = []
    for data, title in titles.items():
        found = results.get(f"{data}_{NEW_TASK}")
        if found is not None:
            known = results.get(f"{data}_{LEAVE_ONE_OUT}")
            lines += [f"{title}, {found['n']} reaches:", "", *_table(found, known), ""]
    if not lines:
        return []
    return [
        "## Targets that nobody has shown",
        "",
        f"`{NEW_TASK}`: learnt from the other people's reaches to other targets alone, so that the right "
        f"task is not in the library. The last row is `{OURS}` with the target shown by the other "
        f"people (`{LEAVE_ONE_OUT}`). End points: median error.",
        "",
        *lines,
    ]


def _table(found: Mapping[str, Any], known: Mapping[str, Any] | None) -> list[str]:
    shares = [share for share in SHARES if share in found["by_observed"]]
    head = [f"{100.0 * float(share):g} % seen: {what}" for share in shares for what in _FIGURES]
    lines = [
        "| predictor | " + " | ".join(head) + " |",
        "| --- " * (len(head) + 1) + "|",
        *(_row(f"`{name}`", found, name, shares) for name in found["predictors"]),
    ]
    if known is not None:
        lines.append(_row(f"`{OURS}`, target shown", known, OURS, shares))
    return lines


def _row(label: str, results: Mapping[str, Any], name: str, shares: list[str]) -> str:
    cells = [label]
    for share in shares:
        figures = results["by_observed"][share][name]
        cells += [
            figure(figures["endpoint_error_m"]["median"], ".0f", 1e3),
            figure(figures["coverage50"], ".0f", 100.0) + " %",
            figure(figures["coverage95"], ".0f", 100.0) + " %",
        ]
    return "| " + " | ".join(cells) + " |"
