"""What the trials say, as figures for the table, the pictures and the file of results."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from typing import Any

import numpy as np

from hri_prediction.hybrid.config import HybridConfig
from hri_prediction.hybrid.why import Why
from hri_sim.hybrid.first_guesses import GUESSES, OPTIMAL
from hri_sim.hybrid.real import RealCourse
from hri_sim.hybrid.scores import Calibration
from hri_sim.hybrid.trial import Course, Judged

KINDS = {
    "warped_cm": "warped_m",
    "end_cm": "end_m",
    "untold_cm": "untold_m",
    "untold_end_cm": "untold_end_m",
}
"""What errors are called here, in centimetres, and in `Judged`, in metres."""


def curves(judged: Sequence[Judged]) -> dict[str, dict[str, dict[str, float]]]:
    """Mean errors [cm] by first guess, kind, and number of reaches seen."""
    counts = sorted({each.seen for each in judged})
    found: dict[str, dict[str, dict[str, float]]] = {}
    for guess in GUESSES:
        found[guess] = {}
        for kind, name in KINDS.items():
            values = {
                str(count): [
                    getattr(each, name)
                    for each in judged
                    if each.guess == guess and each.seen == count
                ]
                for count in counts
            }
            found[guess][kind] = {
                count: 100.0 * float(np.mean(each)) for count, each in values.items()
            }
    return found


def sureness(judged: Sequence[Judged], *, untold: bool) -> dict[str, dict[str, dict[str, float]]]:
    """Mean `Calibration` by first guess, kind, and number of reaches seen.

    Args:
        judged: Scores.
        untold: Whether of predictions to which neither target nor duration is told.
    """
    found: dict[str, dict[str, dict[str, float]]] = {}
    for guess in GUESSES:
        own: dict[int, list[Calibration]] = {}
        for each in judged:
            if each.guess == guess:
                sure = each.untold_sure if untold else each.sure
                own.setdefault(each.seen, []).append(sure)
        found[guess] = {
            kind.name: {
                str(count): float(np.mean([getattr(sure, kind.name) for sure in own[count]]))
                for count in sorted(own)
            }
            for kind in fields(Calibration)
        }
    return found


def divergence(rows: Sequence[Sequence[float]]) -> list[float]:
    """Median over people and targets of the divergence of each update."""
    longest = max((len(row) for row in rows), default=0)
    return [float(np.median([row[k] for row in rows if len(row) > k])) for k in range(longest)]


def reaches_until_settled(rows: Sequence[Sequence[float]]) -> dict[str, float | int | None]:
    """After how many reaches tasks settle, by the rule of the loop: how many do, and their median."""
    config = HybridConfig()
    found = [
        next(
            (
                count
                for count, value in enumerate(row, start=1)
                if count >= config.settled_reaches and value <= config.settled
            ),
            None,
        )
        for row in rows
    ]
    done = [count for count in found if count is not None]
    return {
        "tasks": len(found),
        "settled": len(done),
        "median": float(np.median(done)) if done else None,
        "most": max(done, default=None),
    }


def by_person(judged: Sequence[Judged], guess: str) -> dict[str, list[float]]:
    """Mean error of each person [cm], target and duration told, by number of reaches seen."""
    people = list(dict.fromkeys(each.person for each in judged))
    return {
        str(count): [
            100.0
            * float(
                np.mean(
                    [
                        each.warped_m
                        for each in judged
                        if (each.person, each.guess, each.seen) == (who, guess, count)
                    ]
                )
            )
            for who in people
        ]
        for count in sorted({each.seen for each in judged})
    }


def explanations(courses: Sequence[Course]) -> dict[str, Any]:
    """How much nearer the optimum comes by new weights, and whether they help elsewhere."""
    done = [why for course in courses for why in course.whys.values() if isinstance(why, Why)]
    failed = [why for course in courses for why in course.whys.values() if isinstance(why, str)]
    # The first target has taught nothing yet.
    later = [pair for course in courses for pair in list(course.guessed.values())[1:]]
    return {
        "explained": len(done),
        "failed": failed,
        "before_cm": _median_cm([why.before_m for why in done]),
        "after_cm": _median_cm([why.after_m for why in done]),
        "alpha_error_people": float(np.mean([pair[0] for pair in later])) if later else None,
        "alpha_error_person": float(np.mean([pair[1] for pair in later])) if later else None,
    }


def _median_cm(distances_m: Sequence[float]) -> float:
    """Median [cm] of those that there are: weights without an optimum have no distance. NaN without any."""
    there = [value for value in distances_m if np.isfinite(value)]
    return 100.0 * float(np.median(there)) if there else float("nan")


def of_courses(courses: Sequence[Course]) -> dict[str, Any]:
    """All figures of simulated people of a family."""
    judged = [each for course in courses for each in course.judged]
    rows = [row for course in courses for row in course.divergences.values()]
    return {
        "curves": curves(judged),
        "sure": sureness(judged, untold=False),
        "sure_untold": sureness(judged, untold=True),
        "divergence": divergence(rows),
        "until_settled": reaches_until_settled(rows),
        "of_people_cm": by_person(judged, OPTIMAL),
        "weights": explanations(courses),
        "people": {
            f"S{i + 1}": {
                target: _bars(why, course.truth.get(target))
                for target, why in course.whys.items()
                if isinstance(why, Why)
            }
            for i, course in enumerate(courses)
        },
        "errors_cm": {
            f"S{i + 1}": {
                target: _errors([each for each in course.judged if each.target == target])
                for target in course.whys
            }
            for i, course in enumerate(courses)
        },
    }


def _bars(why: Why, truth: list[float] | None) -> dict[str, Any]:
    """Of one person and target, as figure 3.10 has it."""
    return {
        "alpha": why.alpha.tolist(),
        "truth": truth,
        "before_cm": _median_cm([why.before_m]),
        "after_cm": 100.0 * why.after_m,
    }


def _errors(judged: Sequence[Judged]) -> dict[str, float]:
    """Mean errors [cm] from the first guess of optimal control, by number of reaches seen."""
    own: dict[int, list[float]] = {}
    for each in judged:
        if each.guess == OPTIMAL:
            own.setdefault(each.seen, []).append(100.0 * each.warped_m)
    return {str(seen): float(np.mean(own[seen])) for seen in sorted(own)}


def of_real(course: RealCourse) -> dict[str, Any]:
    """All figures of recorded people."""
    done = [why for why in course.whys.values() if isinstance(why, Why)]
    people = sorted({each.person for each in course.judged})
    ends: dict[int, list[float]] = {}
    for each in course.judged:
        if each.guess == OPTIMAL:
            ends.setdefault(each.seen, []).append(1000.0 * each.untold_end_m)
    return {
        "number": len({name.split()[0] for name in people}),
        "people": {
            name: {
                target: _bars(why, None)
                for (person, target), why in course.whys.items()
                if person == name and isinstance(why, Why)
            }
            for name in people
        },
        "errors_cm": {
            name: {
                target: _errors(
                    [e for e in course.judged if (e.person, e.target) == (name, target)]
                )
                for target in sorted({e.target for e in course.judged if e.person == name})
            }
            for name in people
        },
        "untold_end_median_mm": {str(seen): float(np.median(ends[seen])) for seen in sorted(ends)},
        "curves": curves(course.judged),
        "sure": sureness(course.judged, untold=False),
        "sure_untold": sureness(course.judged, untold=True),
        "divergence": divergence(course.divergences),
        "until_settled": reaches_until_settled(course.divergences),
        "not_expected": len(course.not_expected),
        "not_explained": {
            f"{person} {target}": why
            for (person, target), why in course.whys.items()
            if isinstance(why, str)
        },
        "explained": len(done),
        "before_cm": _median_cm([why.before_m for why in done]),
        "after_cm": _median_cm([why.after_m for why in done]),
    }
