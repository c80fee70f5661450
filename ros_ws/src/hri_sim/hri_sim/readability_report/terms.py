"""The terms of the costs in the first update and in the last, and what each gives to the total's fall."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from hri_planner.pibb.costs import BOUNDED, DEVIATION_M2
from hri_sim.benchmark.report import markdown_table
from hri_sim.policies.evaluation_report import number
from hri_sim.readability_report.cases import CASES, Case
from hri_sim.readability_report.intervals import estimate, text
from hri_sim.readability_report.laboratory import Laboratory, Person
from hri_sim.readability_report.trials import COST, shares

LABELS = {
    "prediction_time": "J_pred [s]",
    "task": "J_task (errors)",
    "human_duration": "J_dur [s]",
    "indistinct": "J_δ (indistinct) [1/m]",
    "tool_jerk": "tool jerk [m²/s⁵]",
    "joint_jerk": "joint jerk [rad²/s⁵]",
    "deviation": "deviation [mm²]",
    COST: "total",
}
SCALES = {"deviation": 1e6}
"""By which terms are multiplied in tables."""
PEOPLE = ("prediction_time", "task", "human_duration")
"""Terms that people make."""
DISTINCT = "indistinct"
"""The one that follows from the ways alone."""


def measure(laboratory: Laboratory) -> dict[str, Any]:
    """By experiment."""
    found = {}
    for case in CASES:
        people = list(laboratory.of(case).values())
        if people:
            found[case.name] = _of(case, people, laboratory.smoke)
    return found


def _of(case: Case, people: Sequence[Person], smoke: bool) -> dict[str, Any]:
    weights = case.experiment(smoke).weights
    terms = {}
    for name in LABELS:
        courses = [person.trials.by_update(person.trials.columns[name]) for person in people]
        first, last = (np.array([course[index] for course in courses]) for index in (0, -1))
        terms[name] = {
            "weight": None if name == COST else getattr(weights, name),
            "first": estimate(first),
            "last": estimate(last),
            "change": estimate(last - first),
            "relative": _relative(first, last),
        }
    falls: dict[str, list[float]] = {}
    for person in people:
        for name, share in shares(person.trials, person.learnt.units, weights).items():
            course = person.trials.by_update(share)
            falls.setdefault(name, []).append(float(course[0] - course[-1]))
    return {
        "seeds": len(people),
        "terms": terms,
        "falls": {name: float(np.mean(own)) for name, own in falls.items()},
    }


def _relative(first: Any, last: Any) -> float | None:
    """Change of the mean over people, as a share."""
    return float(last.mean() / first.mean() - 1.0) if first.mean() > 0.0 else None


def lines(found: Mapping[str, Any]) -> list[str]:
    """A table for each experiment, then what the totals' falls are made of."""
    parts = [
        "Means over the trials of an update, explored ones included, then over people; changes with 95 % "
        "intervals. λ: weight in the total, in which each term r counts in units of what it was in the "
        f"habituation (J_task as it is, deviations in units of {1e3 * DEVIATION_M2**0.5:.0f} mm squared); "
        f"of {', '.join(LABELS[name].partition(' [')[0] for name in BOUNDED)} it is 2 r / (1 + r) that "
        "counts. J_pred, J_task and J_dur come from people; J_δ, eq. 7.19, from the ways alone: it is "
        "deterministic, and can fall though nobody reads the robot any better. So it is told apart.\n"
    ]
    for name, one in found.items():
        rows = []
        for term, label in LABELS.items():
            own, scale = one["terms"][term], SCALES.get(term, 1.0)
            relative = own["relative"]
            rows.append(
                [
                    label,
                    "" if own["weight"] is None else f"{own['weight']:g}",
                    *(number(scale * own[which]["mean"]) for which in ("first", "last")),
                    *(number(scale * own[which]["median"]) for which in ("first", "last")),
                    _change(own["change"], scale),
                    "–" if relative is None else f"{100.0 * relative:+.0f}",
                ]
            )
        head = [
            f"`{name}`", "λ", "first update", "last update", "median, first", "median, last", "change",
            "[%]",
        ]  # fmt: skip
        parts.append(markdown_table(head, rows))
    parts += _falls(found)
    return parts


def _change(found: dict[str, Any], scale: float) -> str:
    """With as many places as its size asks for."""
    ends = found["ci95"] or ()
    size = scale * max(abs(value) for value in (found["mean"], *ends)) or 1.0
    digits = int(np.clip(2 - np.floor(np.log10(size)), 0, 4))
    return text(found, digits, scale=scale, sign=True)


def _falls(found: Mapping[str, Any]) -> list[str]:
    names = [term for term in LABELS if term != COST]
    rows, said = [], []
    for name, one in found.items():
        falls = one["falls"]
        whole = sum(falls.values())
        rows.append(
            [
                f"`{name}`",
                f"{whole:+.2f}",
                *(f"{falls[term]:+.2f}" if term in falls else "–" for term in names),
            ]
        )
        said.append(f"`{name}`: {fall_text(falls)}")
    heads = [LABELS[term].partition(" [")[0] for term in names]
    return [
        "By how much the total falls from the first update to the last, and what each term gives to it "
        "(negative: it rises; a dash: it has no weight):\n",
        markdown_table(["experiment", "fall of the total", *heads], rows),
        f"What J_δ makes of it: {'; '.join(said)}.\n",
    ]


def fall_text(falls: Mapping[str, float]) -> str:
    """What J_δ and people make of the fall of the total."""
    whole = sum(falls.values())
    people = sum(falls.get(term, 0.0) for term in PEOPLE)
    if DISTINCT not in falls:
        return "it has no weight"
    if whole <= 0.0:
        return (
            f"the total does not fall; J_δ alone falls by {falls[DISTINCT]:.2f}, what people make by "
            f"{people:.2f}"
        )
    distinct, human = 100.0 * falls[DISTINCT] / whole, 100.0 * people / whole
    return f"{distinct:.0f} % of the fall; J_pred, J_task and J_dur together make {human:.0f} %"
