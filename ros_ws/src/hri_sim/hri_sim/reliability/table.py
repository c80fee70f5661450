"""The table of faults, in Markdown and as figures."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Sequence
from typing import Any

from hri_sim.reliability.fault import FILES, LOCKSTEP, PROCESSES, Figure, Result

COMMAND = "scripts/reproduce_reliability.py --only"
KINDS = {
    LOCKSTEP: "**lock-step**: all nodes in one process, in simulated time; times count from the step "
    "before the fault, in steps of 4 ms, and computing takes none. What moves the "
    "robot (planner or policy), and the separation monitor beside it, if any, change with the seed in most "
    "lines",
    PROCESSES: "**processes**: as users run them, on this machine's clock; times count from just before "
    "the signal is sent, joint states by their stamps, words by when they are heard. Steps and touches "
    "count until all nodes are well again, which is when all say at once that nothing is wrong now (the "
    "simulator may say that its motion was broken off or that somebody leans on its robot, and the "
    "recorder what was lost on the way: that stays so); each repetition begins with a robot that sets "
    "out, so the one before went on",
    FILES: "**files**: no graph",
}


def lines(results: Sequence[Result]) -> list[str]:
    """The tables."""
    text = [
        "A repetition is met when each of its figures is. *At rest*: no joint is faster than 0.02 rad/s, "
        "nor is it asked to be; a person who reaches into a robot at rest and pushes it does not end "
        "its rest, and such touches are counted apart from those by a robot that moves of its own. "
        "*Named*: said on /diagnostics, as a reason in a status, or by the launcher. How:",
        "",
        *(f"- {words}." for words in KINDS.values()),
        "",
        "| fault | injected | answer wanted | measured (median; worst) | verdict | to repeat |",
        "| --- | --- | --- | --- | --- | --- |",
        *map(_line, results),
        "",
        "### In detail",
        "",
        "| fault | how | figure | repetitions | median | worst | wanted | missed |",
        "| --- | --- | --- | --- | --- | --- | --- | --- |",
        *(_detail(result, figure) for result in results for figure in result.fault.figures
          if result.values(figure)),
        "",
    ]  # fmt: skip
    failed = [result for result in results if not result.met]
    if failed:
        text += [
            "Repetitions that missed something, by seed (`--first-seed SEED --count 1` repeats one):",
            "",
        ]
        text += [
            f"- {result.fault.title}: {', '.join(map(str, result.failed_seeds()[:10]))}"
            for result in failed
        ]
        text.append("")
    said = [(result, words) for result in results if (words := _said(result))]
    if said:
        text += ["What was said, mostly:", "", "| fault | said |", "| --- | --- |"]
        text += [f"| {result.fault.title} | {words.replace('|', '/')} |" for result, words in said]
        text.append("")
    return text


def kept_lines(results: Sequence[Result], origin: str) -> list[str]:
    """Where repetitions come from that were not made by the run that is reported, if any.

    Args:
        results: Of all lines.
        origin: Of the run.
    """
    counts = Counter(trial.origin for result in results for trial in result.trials)
    total = counts.total()
    kept = [f"{count} of commit {words}" for words, count in counts.items() if words != origin]
    if not kept:
        return []
    return [
        f"Of {total} repetitions some were kept, as the code that they hang on is the same: "
        f"{'; '.join(sorted(kept))}.\n"
    ]


def _line(result: Result) -> str:
    fault = result.fault
    if result.skipped and not result.trials:
        measured, verdict = result.skipped, "skipped"
    else:
        figures = (_short(result, figure) for figure in fault.figures)
        measured = "; ".join(filter(None, (*figures, result.skipped)))
        missed = len(result.failed_seeds())
        count = len(result.trials)
        verdict = f"met, {count} of {count}" if not missed else f"**missed, {missed} of {count}**"
    return (
        f"| {fault.title} | {fault.injected} | {fault.answer} | {measured} | {verdict} | "
        f"`{COMMAND} {fault.name}{_as_often(result)}` |"
    )


def _as_often(result: Result) -> str:
    """The option that repeats a line as often as it was; empty where the command does so by itself."""
    count = len(result.trials)
    return f" --count {count}" if count and count != result.fault.count else ""


def _short(result: Result, figure: Figure) -> str:
    """What a figure came to; empty for what must not be, and was not, and for what there was none of."""
    values = result.values(figure)
    if figure.limit is None and not any(values):
        return ""
    if not values or (not figure.unit and not result.missed(figure)):
        return ""
    if not figure.unit:
        return f"{figure.text}: missed {result.missed(figure)} times"
    return (
        f"{figure.text} {_value(result.median(figure), figure)}; "
        f"{_value(result.worst(figure), figure)} {figure.unit}"
    )


def _detail(result: Result, figure: Figure) -> str:
    wanted = "–"
    if figure.limit is not None:
        wanted = f"{'≥' if figure.least else '≤'} {figure.limit:g}"
    unit = f" [{figure.unit}]" if figure.unit else ""
    fault, count = result.fault, len(result.values(figure))
    return (
        f"| {fault.title} | {fault.kind} | {figure.text}{unit} | {count} | "
        f"{_value(result.median(figure), figure)} | {_value(result.worst(figure), figure)} | {wanted} | "
        f"{result.missed(figure)} |"
    )


def _value(value: float | None, figure: Figure) -> str:
    return "never" if value is None else f"{value:,.{figure.digits}f}"


def _said(result: Result) -> str:
    """What was said of a fault most often, numbers apart."""
    words = Counter(trial.said for trial in result.trials if trial.said)
    if not words:
        return ""
    # Where the checkout was is nobody's business.
    root = os.environ.get("HRI_PROJECT_ROOT")
    said = words.most_common(1)[0][0]
    return (said.replace(f"{root}/", "") if root else said)[:300]


def to_mapping(result: Result) -> dict[str, Any]:
    """For the file of figures."""
    return {
        "title": result.fault.title,
        "how": result.fault.kind,
        "repetitions": len(result.trials),
        "met": result.met,
        "skipped": result.skipped,
        "failed_seeds": result.failed_seeds(),
        "figures": {
            figure.key: {
                "median": result.median(figure),
                "worst": result.worst(figure),
                "limit": figure.limit,
                "missed": result.missed(figure),
            }
            for figure in result.fault.figures
            if result.values(figure)
        },
    }
