"""Tables of an evaluation, in Markdown, beside those of the thesis."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from hri_prediction.ontology.cases import GROUP_NAMES, REDUCED, cases
from hri_prediction.ontology.evaluation import FULL, GROUPED, KINDS, OWN_HALVES, Confusion
from hri_sim.ontology import figures
from hri_sim.ontology.splits import RANDOM, SESSIONS, SUBJECT

THESIS_OVERALL = {FULL: 0.74, KINDS[1]: 0.88}
"""Overall recognition rates of the thesis (4.7.3), random halves of human data."""
WANTED_LEAST = 0.45
"""Of each case."""
THESIS_INTRA = (91.0, 89.2, 91.7, 92.4, 92.9, 93.5)
THESIS_OUT = (67.4, 38.3, 46.8, 65.3, 63.8, 61.6)
THESIS_BACK = (66.0, 67.7, 69.6, 83.5, 85.7, 76.4)
"""Its table 4.4 [%]."""
_NAMES = {
    RANDOM: "random halves of segments",
    SESSIONS: "half of the recordings left out",
    SUBJECT: "one person left out",
}
_ORDER = tuple(number for group in REDUCED for number in group)


def overall_table(told: figures.Told) -> list[str]:
    """How often segments are recognised, by split."""
    shown = figures.matrices(told)
    text = [
        "| split | 20 cases | least of a case | 7 classes | least of a class | 7 classes, as the monitor "
        "says them | least of a class |",
        "| --- |" + " --- |" * 6,
    ]
    for kind, name in _NAMES.items():
        cells = []
        for labels in (*KINDS, GROUPED):
            own = shown.get(labels, {}).get(kind)
            if own is None:
                cells += ["–", "–"]
                continue
            parts = 100.0 * np.array(figures.overall_of(told, labels, kind))
            spread = f" (from {parts.min():.0f} to {parts.max():.0f})" if len(parts) > 1 else ""
            least = int(np.nanargmin(own.rates))
            cells += [
                f"{100 * own.overall:.1f} %{spread}",
                f"{100 * own.rates[least]:.0f} % ({own.classes[least]})",
            ]
        text.append(f"| {name} | {' | '.join(cells)} |")
    text.append(
        f"| thesis, human data, random halves | {100 * THESIS_OVERALL[FULL]:.0f} % | at least 45 % | "
        f"{100 * THESIS_OVERALL[KINDS[1]]:.0f} % | – | – | – |"
    )
    words = (
        "7 classes are told by a machine that knows no cases, as in the thesis; the monitor adds up "
        "probabilities of the 20 cases instead.\n"
    )
    return [*text, "", words, *least_lines(shown)]


def least_lines(shown: Mapping[str, Mapping[str, Confusion]]) -> list[str]:
    """Mean rate of the 20 cases by split, and which of them are recognised less often than is wanted."""
    own = shown.get(FULL, {})
    text = [
        f"Of each of the 20 cases {100 * WANTED_LEAST:.0f} % are wanted. What is counted above are "
        "segments; cases have different numbers of them.\n",
        *("| split | mean of the cases | cases below | verdict |", "| --- | --- | --- | --- |"),
    ]
    for kind, name in _NAMES.items():
        if kind not in own:
            continue
        found = own[kind]
        low = [
            f"{number} ({_percent(rate)})"
            for number, rate in zip(found.classes.tolist(), found.rates.tolist(), strict=True)
            if not rate >= WANTED_LEAST
        ]
        text.append(
            f"| {name} | {100 * float(np.nanmean(found.rates)):.1f} % | {', '.join(low) or 'none'} | "
            f"{'set, not judged' if kind == RANDOM else '**missed**' if low else 'met'} |"
        )
    return [*text, ""] if own else []


def confusion_table(found: Confusion, order: Sequence[int] = ()) -> list[str]:
    """A normalised confusion matrix [%]: rows are what it was, columns what it was taken for."""
    numbers = [number for number in order or found.classes.tolist() if number in found.classes]
    rows = np.searchsorted(found.classes, numbers)
    shares = 100.0 * found.normalised[np.ix_(rows, rows)]
    text = [
        "| | " + " | ".join(map(str, numbers)) + " |",
        "| --- |" + " --- |" * len(numbers),
    ]
    for number, row in zip(numbers, shares, strict=True):
        cells = ["" if not np.isfinite(share) or share < 0.05 else f"{share:.1f}" for share in row]
        text.append(f"| **{number}** | {' | '.join(cells)} |")
    return [*text, ""]


def full_table(found: Confusion) -> list[str]:
    """As table 4.1 of the thesis: in the order of the reduced ontology."""
    return confusion_table(found, _ORDER)


def reduced_words(found: Confusion) -> str:
    """Which classes are recognised as often as the thesis says of its own (4.7.3, table 4.3)."""
    rates = zip(found.classes.tolist(), found.rates.tolist(), strict=True)
    low = [f"{number} ({100 * rate:.1f} %)" for number, rate in rates if not rate > 0.85]
    own = f"all but {', '.join(low)}" if low else "all"
    return f"The thesis: all but classes 2 and 3 above 85 %. Here: {own}.\n"


def positions_table(told: figures.Told) -> list[str]:
    """As table 4.2: how often the first cases are recognised in each position."""
    apart = figures.positions(told)
    if not apart:
        return ["Cases 1 to 3 are not all in these data.\n"]
    numbers = next(iter(apart.values())).classes.tolist()
    text = [
        "| case | " + " | ".join(apart) + " |",
        "| --- |" + " --- |" * len(apart),
    ]
    for index, number in enumerate(numbers):
        cells = [_percent(one.rates[index]) for one in apart.values()]
        text.append(f"| {number} | {' | '.join(cells)} |")
    text += [
        "",
        "The thesis: above 83 % each. Random halves have parts of each recording on both sides.\n",
    ]
    elsewhere = figures.positions_out(told)
    if elsewhere:
        text += [
            "The same, each position by a machine that has learnt the other positions alone:\n",
            "| case | " + " | ".join(elsewhere) + " |",
            "| --- |" + " --- |" * len(elsewhere),
        ]
        for index, number in enumerate(numbers):
            cells = [_percent(one.rates[index]) for one in elsewhere.values()]
            text.append(f"| {number} | {' | '.join(cells)} |")
        text.append("")
    return text


def people_table(told: figures.Told) -> list[str]:
    """As table 4.4: one person's segments by the own, everybody else's by the own, the own by theirs."""
    everybody = figures.people(told)
    if not everybody:
        return ["Nobody here did something of every class of the reduced ontology.\n"]
    text = [
        "| | " + " | ".join(str(one["subject"]) for one in everybody) + " | thesis |",
        "| --- |" + " --- |" * (len(everybody) + 1),
    ]
    rows = (
        (f"within a person (mean of {OWN_HALVES} random halves)", "intra", THESIS_INTRA),
        ("the least of these", "intra_least", ()),
        ("the most", "intra_most", ()),
        ("one person's machine, the others", "subject_vs_group", THESIS_OUT),
        ("the others' machine, the person", "group_vs_subject", THESIS_BACK),
    )
    for name, key, thesis in rows:
        cells = [_percent(one[key]) for one in everybody]
        told_there = ", ".join(f"{value:.1f}" for value in thesis)
        text.append(f"| {name} | {' | '.join(cells)} | {told_there + ' %' if thesis else '–'} |")
    return [*text, ""]


def case_list() -> list[str]:
    """All cases with their edges, in words."""
    text = ["| case | what goes on | reduced |", "| --- | --- | --- |"]
    text += [
        f"| {case.number} | {case.description} | {case.group}: {GROUP_NAMES[case.group - 1]} |"
        for case in cases()
    ]
    return [*text, ""]


def _percent(share: Any) -> str:
    return "–" if share is None or not np.isfinite(share) else f"{100.0 * share:.1f} %"


def evaluation_lines(told: figures.Told, pictures: Mapping[str, str]) -> list[str]:
    """The part of a report that says how well cases are told apart.

    Args:
        told: What came of the splits.
        pictures: Files of the matrices by the labels they are of; may be empty.
    """
    shown = figures.matrices(told)
    text = [*overall_table(told)]
    missing = figures.left_out(told)
    if missing:
        text += [
            "Left out, as these data do not allow it:\n",
            *(f"- {line}" for line in missing),
            "",
        ]
    for kind, words in ((RANDOM, "random halves"), (SUBJECT, "persons left out")):
        if kind in shown.get(FULL, {}):
            text += [f"### Full ontology, {words} [%]\n", *full_table(shown[FULL][kind])]
        if kind in shown.get(KINDS[1], {}):
            reduced = confusion_table(shown[KINDS[1]][kind])
            text += [f"### Reduced ontology, {words} [%]\n", *reduced]
            if kind == RANDOM:
                text.append(reduced_words(shown[KINDS[1]][kind]))
    for labels, file in pictures.items():
        text.append(f"![Confusion matrices, {labels} ontology]({file})\n")
    text += ["### Location invariance\n", *positions_table(told)]
    text += ["### Persons, reduced ontology\n", *people_table(told)]
    return text
