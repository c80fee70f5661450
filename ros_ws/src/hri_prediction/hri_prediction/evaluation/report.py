"""The tables of an evaluation as Markdown."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from hri_prediction.evaluation.folds import OURS
from hri_prediction.evaluation.scores import HORIZONS_S

UNNOTICED = "Before a reach is noticed the prediction says that the hand rests:"
_HEAD = (
    "predictor",
    "end point [mm]: median",
    "mean",
    "95th pct.",
    *(f"median at {horizon:g} s [mm]" for horizon in HORIZONS_S),
    "NLL [nats]",
    "50 % region",
    "95 % region",
    "latency [µs]",
)


def figure(value: float | None, form: str, scale: float = 1.0) -> str:
    """A number for a table; a dash for none."""
    return "–" if value is None else format(scale * value, form)


def _row(cells: tuple[str, ...] | list[str]) -> str:
    return "| " + " | ".join(cells) + " |"


def predictor_table(predictors: Mapping[str, Mapping[str, Any]]) -> str:
    """One row a predictor with all figures of one observed share."""
    lines = [_row(_HEAD), _row(["---"] * len(_HEAD))]
    for name, found in predictors.items():
        end, horizons = found["endpoint_error_m"], found["error_at_horizon_m"]
        cells = [f"`{name}`"]
        cells += [figure(end[key], ".0f", 1e3) for key in ("median", "mean", "p95")]
        cells += [figure(horizons[f"{h:g}"]["median"], ".0f", 1e3) for h in HORIZONS_S]
        cells += [
            figure(found["nll"], ".2f"),
            figure(found["coverage50"], ".0f", 100.0) + " %",
            figure(found["coverage95"], ".0f", 100.0) + " %",
            figure(found["latency_us"], ".0f"),
        ]
        lines.append(_row(cells))
    return "\n".join(lines) + "\n"


def observed_table(by_observed: Mapping[str, Mapping[str, Mapping[str, Any]]]) -> str:
    """Median end-point error of each predictor over the observed shares."""
    shares = list(by_observed)
    head = ["predictor", *(f"{100.0 * float(share):g} %" for share in shares)]
    lines = [_row(head), _row(["---"] * len(head))]
    for name in by_observed[shares[0]]:
        cells = [by_observed[share][name]["endpoint_error_m"]["median"] for share in shares]
        lines.append(_row([f"`{name}`", *(figure(cell, ".0f", 1e3) for cell in cells)]))
    return "\n".join(lines) + "\n"


def region_table(results: Mapping[str, Any], ours: str) -> str:
    """How many reaches our predictor had noticed, and what its regions held, over the observed shares."""
    shares = list(results["by_observed"])
    head = [f"`{ours}` after", *(f"{100.0 * float(share):g} %" for share in shares)]
    lines = [_row(head), _row(["---"] * len(head))]
    noticed = [results["noticed"][share] for share in shares]
    lines.append(_row(["reaches noticed", *(f"{100.0 * part:.0f} %" for part in noticed)]))
    for level in ("50", "95"):
        held = [results["by_observed"][share][ours][f"coverage{level}"] for share in shares]
        cells = ["–" if part is None else f"{100.0 * part:.0f} %" for part in held]
        lines.append(_row([f"points within the {level} % region", *cells]))
    return "\n".join(lines) + "\n"


def knowledge_list(knows: Mapping[str, str]) -> str:
    """What each predictor is told."""
    return "\n".join(f"- `{name}`: {text}." for name, text in knows.items()) + "\n"


def belief_words(results: Mapping[str, Any]) -> str:
    """What our predictor knew of duration and task by then."""
    share = format(results["observed"], "g")
    error = results["duration_error_s"][share]["median"]
    found = results["task_found"][share]
    words = ""
    if error is not None:
        words = (
            f"; its duration was {error * 1e3:.0f} ms off (median; held against "
            f"{results['durations_from']})"
        )
    if found is None:
        return words
    return (
        f'{words}; of all tasks and "unknown" the right one was the likeliest in {100.0 * found:.0f} % '
        "of them"
    )


def evaluation_report(results: Mapping[str, Any]) -> str:
    """The text beside the plots: what was evaluated, all figures, what was skipped."""
    share = f"{100.0 * results['observed']:g} %"
    parts = [
        f"# Prediction: {results['data']}, {results['protocol']}\n",
        f"{results['n']} reaches; figures after {share} of each reach, of the wrist. NLL and regions "
        "over all predicted points until the reach ends. Our predictor had noticed "
        f"{100.0 * results['noticed'][format(results['observed'], 'g')]:.0f} % of the reaches by then"
        f"{belief_words(results)}.\n",
        predictor_table(results["predictors"]),
        "What each is told:\n",
        knowledge_list(results["knows"]),
    ]
    if len(results["by_observed"]) > 1:
        parts += [
            "Median end-point error [mm] by the share of the reach that was seen:\n",
            observed_table(results["by_observed"]),
            f"{UNNOTICED}\n",
            region_table(results, OURS),
        ]
    if results["skipped"]:
        parts.append("Skipped:\n\n" + "\n".join(f"- {line}" for line in results["skipped"]) + "\n")
    return "\n".join(parts)


def _less(value: float | None, ours: float | None) -> bool:
    return value is not None and ours is not None and value < ours


def winners(results: Mapping[str, Any], ours: str) -> list[str]:
    """Where another predictor does better than ours: one line each that does.

    Compared are the median end-point errors after each observed share, and at the first of them that is
    shown in full the median errors ahead and the mean negative log-likelihood.
    """
    lines = []
    first = results["predictors"]
    for name in first:
        if name == ours:
            continue
        shares = [
            f"{100.0 * float(share):g} %"
            for share, found in results["by_observed"].items()
            if _less(
                found[name]["endpoint_error_m"]["median"], found[ours]["endpoint_error_m"]["median"]
            )
        ]
        ahead = [
            f"{float(horizon):g} s"
            for horizon, found in first[name]["error_at_horizon_m"].items()
            if _less(found["median"], first[ours]["error_at_horizon_m"][horizon]["median"])
        ]
        better = []
        if shares:
            better.append("smaller median end-point error after " + ", ".join(shares))
        if ahead:
            better.append("smaller median error " + ", ".join(ahead) + " ahead")
        if _less(first[name]["nll"], first[ours]["nll"]):
            better.append("smaller negative log-likelihood")
        if better:
            lines.append(f"`{name}`: {'; '.join(better)}")
    return lines


BOUNDARY_HEAD = (
    _row(
        [
            "recordings",
            "labels",
            "found",
            "boundary error, median [ms]",
            "95th pct. [ms]",
            "onsets late by [ms]",
            "ends late by [ms]",
            "extra",
        ]
    )
    + "\n"
    + _row(["---"] * 8)
)


def boundary_row(name: str, found: Mapping[str, Any]) -> str:
    """A line of the segmentation table, from :meth:`.BoundaryErrors.figures`."""
    return _row(
        [
            name,
            str(found["labels"]),
            figure(found["matched_share"], ".0f", 100.0) + " %",
            *(
                figure(found[key], ".0f")
                for key in ("median_ms", "p95_ms", "onset_bias_ms", "end_bias_ms")
            ),
            str(found["extra"]),
        ]
    )
