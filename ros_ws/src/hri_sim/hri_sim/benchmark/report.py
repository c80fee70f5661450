"""Tables and plots of a benchmark."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hri_planner.adaptation.origin import warning
from hri_sim.benchmark.conditions import CONDITION_RULES, TASK_RULES
from hri_sim.benchmark.execution import PAPER
from hri_sim.benchmark.outcome import LIMIT_S, Outcome
from hri_sim.benchmark.variation import AS_DRAWN

SHARE_HEADS = {
    "ok": "ok",
    "strict": "strict",
    "clearance_2cm": "≥ 2 cm",
    "clearance_5cm": "≥ 5 cm",
}
MEAN_HEADS = {
    "time_to_goal_s": ("time to goal [s]", ".2f"),
    "accel_cost": ("∫‖q̈‖² [rad²/s³]", ".0f"),
    "clearance_m": ("clearance [m]", ".3f"),
    "time_to_collision_s": ("time to collision [s]", ".2f"),
    "iterations": ("iterations a motion", ".0f"),
}
_WIDEST = "clearance_5cm"
KINDS = {
    "ambiguous": "Where only watching tells the target",
    "person_must_move": "Where the nominal motion collides only because the person moves (elsewhere the "
    "arm is in the way from the start)",
}
MEANINGS = (
    "ok: no contact on the way, the tool within 1 cm of the goal and at rest within "
    f"{LIMIT_S:g} s. strict: ok, held for 0.6 s, speeds up to 105 % of the limits, table clear. "
    "≥ 2 cm, ≥ 5 cm: ok with that clearance. Means of time and ∫‖q̈‖² are over motions that arrive; "
    "clearance and time to collision are the smallest of each motion; iterations include those of the "
    "hold. In brackets: 95 % intervals "
    "of as many independent trials as the tasks make, not the motions: those of a task are alike. Shares: "
    "Clopper and Pearson's; where all or none succeed, nothing says how alike motions are, and only tasks "
    "count: such an interval is wider than that of one failure. Means: a bootstrap."
)


def share_text(value: float | None, interval: Sequence[float] | None, digits: int = 1) -> str:
    """``98.2 % (97.1–99.0)``; ``digits`` are those of the interval."""
    if value is None:
        return "–"
    text = f"{100.0 * value:.1f} %"
    if interval is None:
        return text
    return f"{text} ({100.0 * interval[0]:.{digits}f}–{100.0 * interval[1]:.{digits}f})"


def _row(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cells) + " |"


def markdown_table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table as Markdown."""
    return "\n".join([_row(head), _row(["---"] * len(head)), *map(_row, rows)]) + "\n"


def share_table(planners: Mapping[str, Mapping[str, Any]]) -> str:
    """Successes of all planners."""
    rows = [
        [f"`{name}`", *(share_text(found[key], found["ci95"][key]) for key in SHARE_HEADS)]
        for name, found in planners.items()
    ]
    return markdown_table(["planner", *SHARE_HEADS.values()], rows)


def points_text(value: float, interval: Sequence[float] | None) -> str:
    """A difference of shares in points: ``+12.0 (+9.1 to +15.2)``."""
    text = f"{100.0 * value:+.1f}"
    if interval is None:
        return text
    return f"{text} ({100.0 * interval[0]:+.1f} to {100.0 * interval[1]:+.1f})"


def difference_table(differences: Mapping[str, Mapping[str, Any]]) -> str:
    """By how many points the first planner's shares are larger."""
    rows = [
        [f"`{name}`", *(points_text(found[key], found["ci95"][key]) for key in SHARE_HEADS)]
        for name, found in differences.items()
    ]
    return markdown_table(["difference [points]", *SHARE_HEADS.values()], rows)


def signed_text(value: float | None, interval: Sequence[float] | None, form: str) -> str:
    """A difference with its interval: ``+0.12 (-0.03 to +0.27)``."""
    if value is None:
        return "–"
    text = f"{value:+{form}}"
    return text if interval is None else f"{text} ({interval[0]:+{form}} to {interval[1]:+{form}})"


def paired_table(differences: Mapping[str, Mapping[str, Any]]) -> str:
    """The same of the means, motion by motion, beside the share with most clearance."""
    rows = []
    for name, found in differences.items():
        cells = [f"`{name}`", points_text(found[_WIDEST], found["ci95"][_WIDEST])]
        for key, (_, form) in MEAN_HEADS.items():
            cells.append(signed_text(found[key], found["ci95"][key], form))
        rows.append(cells)
    head = ["difference", f"{SHARE_HEADS[_WIDEST]} [points]"]
    return markdown_table([*head, *(text for text, _ in MEAN_HEADS.values())], rows)


def mean_table(planners: Mapping[str, Mapping[str, Any]]) -> str:
    """How they got there."""
    rows = []
    for name, found in planners.items():
        cells = [f"`{name}`"]
        for key, (_, form) in MEAN_HEADS.items():
            value, span = found[key], found["ci95"][key]
            if value is None:
                cells.append("–")
            else:
                text = f"{value:{form}}"
                cells.append(
                    text if span is None else f"{text} ({span[0]:{form}}–{span[1]:{form}})"
                )
        rows.append(cells)
    return markdown_table(["planner", *(head for head, _ in MEAN_HEADS.values())], rows)


def kind_tables(results: Mapping[str, Any]) -> list[str]:
    """Successes of all planners in each kind of conditions, and of how many tasks these are."""
    parts = []
    for kind, text in KINDS.items():
        some = {name: said[kind] for name, said in results["planners"].items() if said[kind]}
        if some:
            share, tasks = share_text(results["shares"][kind], None), results["clusters"][kind]
            counted = f"{tasks} task{'s' if tasks > 1 else ''}"
            parts += [
                f"{text} ({share} of the conditions, {counted}) alone:\n",
                share_table(some),
            ]
    return parts


def rejection_table(generator: Mapping[str, Any]) -> str:
    """What each rule of the generator turned down."""
    rows = []
    for kind, rules in (("tasks", TASK_RULES), ("conditions", CONDITION_RULES)):
        rejected = generator[f"{kind}_rejected"]
        left = generator[f"{kind}_drawn"]
        rows.append([f"{kind} drawn", str(left)])
        for rule, text in rules.items():
            left -= rejected[rule]
            rows.append([f"turned down, unless {text}", str(rejected[rule])])
        rows.append([f"{kind} kept", str(left)])
    return markdown_table(["of the generator", "number"], rows)


def _circumstances(results: Mapping[str, Any]) -> list[str]:
    """What the conditions do not say: how they were varied, how plans became motions, what is amiss."""
    parts = []
    if results["trained_for_another_planner"]:
        parts.append(warning(results["trained_for_another_planner"]) + "\n")
    if results["variation"] != AS_DRAWN.text:
        parts.append(
            f"Otherwise than drawn and learnt: {results['variation']}. Whether conditions are still a "
            "fair test is not looked at; what PTOMP reaches that knows of it all stands above.\n"
        )
    if results["execution"] != PAPER:
        errors = ", ".join(
            f"`{name}` {1e3 * found['tracking_error_rad']:.2f} mrad"
            for name, found in results["planners"].items()
        )
        parts.append(
            "Executed in MuJoCo by the simulated controller; all is measured on the joints' true motion. "
            f"Largest distance of a joint from the plan: {errors}.\n"
        )
    return parts


def report(results: Mapping[str, Any]) -> str:
    """The text beside the plots."""
    planners = results["planners"]
    varied = "" if results["variation"] == AS_DRAWN.text else f"; {results['variation']}"
    parts = [
        f"# Planners: {results['split']} tasks, F = {results['budget']:g}{varied}\n",
        f"{results['conditions']} conditions of {results['tasks']} tasks, seeds "
        f"{', '.join(map(str, results['seeds']))}, in virtual time. PTOMP that knows "
        "the person's motion and has a large budget is ok in "
        f"{share_text(results['oracle_feasible'], None)} of them.\n",
        *_circumstances(results),
        share_table(planners),
        mean_table(planners),
        MEANINGS + "\n",
    ]
    if results["differences"]:
        parts += [
            "The same tasks compared, one planner less the other:\n",
            difference_table(results["differences"]),
            paired_table(results["differences"]),
        ]
    parts += kind_tables(results)
    parts += [
        "What they are:\n",
        "\n".join(f"- `{name}`: {found['text']}." for name, found in planners.items()) + "\n",
        "How the conditions were drawn:\n",
        rejection_table(results["generator"]),
    ]
    return "\n".join(parts)


def _axes() -> tuple[Any, Any]:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.4, 4.2), layout="constrained")
    FigureCanvasAgg(figure)
    return figure, figure.add_subplot()


def plot_success(planners: Mapping[str, Mapping[str, Any]], path: Path) -> None:
    """Shares of success with their intervals, as bars."""
    figure, axes = _axes()
    width = 0.8 / len(planners)
    for number, (name, found) in enumerate(planners.items()):
        places = np.arange(len(SHARE_HEADS)) + (number + 0.5) * width - 0.4
        values = np.array([100.0 * found[key] for key in SHARE_HEADS])
        spans = 100.0 * np.array([found["ci95"][key] for key in SHARE_HEADS]).T
        bars = np.abs(spans - values)
        axes.bar(places, values, 0.9 * width, yerr=bars, capsize=3.0, label=name)
    axes.set_xticks(np.arange(len(SHARE_HEADS)), list(SHARE_HEADS.values()))
    axes.set_ylabel("share of conditions [%]")
    axes.set_ylim(0.0, 105.0)
    figure.legend(loc="outside upper center", ncols=4)
    figure.savefig(path, dpi=120)


def plot_clearance(outcomes: Mapping[str, Sequence[Outcome]], path: Path) -> None:
    """Distribution of the smallest clearance of each motion."""
    figure, axes = _axes()
    for name, found in outcomes.items():
        values = np.sort([100.0 * outcome.clearance for outcome in found])
        shares = 100.0 * np.arange(len(values) + 1) / len(values)
        axes.step(np.concatenate((values[:1], values)), shares, where="post", label=name)
    axes.axvline(0.0, color="0.5", linewidth=1.0)
    axes.set_xlabel("smallest clearance of a motion [cm]")
    axes.set_ylabel("share of conditions with less [%]")
    figure.legend(loc="outside upper center", ncols=4)
    figure.savefig(path, dpi=120)
