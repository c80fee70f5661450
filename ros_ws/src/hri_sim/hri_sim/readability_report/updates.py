"""The terms of the costs in each update, of one experiment after the other."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from hri_sim.benchmark.report import markdown_table
from hri_sim.policies.evaluation_report import number
from hri_sim.readability_report.cases import CASES
from hri_sim.readability_report.laboratory import Laboratory
from hri_sim.readability_report.terms import LABELS, SCALES


def measure(laboratory: Laboratory) -> dict[str, Any]:
    """Means over the trials of each update, then over people, by experiment and term."""
    found = {}
    for case in CASES:
        people = list(laboratory.of(case).values())
        if people:
            found[case.name] = {
                name: np.mean(
                    [person.trials.by_update(person.trials.columns[name]) for person in people],
                    axis=0,
                ).tolist()
                for name in LABELS
            }
    return found


def lines(found: Mapping[str, Any]) -> list[str]:
    """A table for each experiment, a row for each update."""
    parts = [
        "Means over the trials of each update, explored ones included, then over people. Intervals of the "
        "changes from the first update to the last are above.\n"
    ]
    for name, terms in found.items():
        courses = [np.array(terms[term]) * SCALES.get(term, 1.0) for term in LABELS]
        rows = [
            [str(update + 1), *(number(float(course[update])) for course in courses)]
            for update in range(len(courses[0]))
        ]
        parts.append(markdown_table([f"`{name}`: update", *LABELS.values()], rows))
    return parts
