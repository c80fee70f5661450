"""A against B: straight ways to begin with, or what another person taught at another start."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hri_sim.benchmark.report import markdown_table
from hri_sim.readability_report.cases import PAIRS, Case
from hri_sim.readability_report.intervals import estimate, is_below_zero, text
from hri_sim.readability_report.laboratory import Laboratory, Person
from hri_sim.readability_report.trials import COST, costs_in

FloatArray = NDArray[np.float64]

COLUMNS = {
    "prediction_time": ("J_pred [s]", 2, 1.0),
    "task": ("errors [%]", 1, 100.0),
    COST: ("total, in A's units", 2, 1.0),
    "indistinct": ("J_δ [1/m]", 3, 1.0),
}
"""Label, digits and scale."""
SPANS = {"first": "first update", "last": "last update", "all": "all updates"}
READ = {
    "before": ("first policy", "before"),
    "after": ("last policy", "after"),
    "others_before": ("first policy, another kind of person", "others_before"),
    "others_after": ("last policy, another kind of person", "others_after"),
}


def course(person: Person, name: str, beside: Person, case: Case, smoke: bool) -> FloatArray:
    """A column by update (updates,); costs in the units of another session of the same person."""
    trials = person.trials
    if name == COST:
        return trials.by_update(
            costs_in(trials, beside.learnt.units, case.experiment(smoke).weights)
        )
    return trials.by_update(trials.columns[name])


def measure(laboratory: Laboratory) -> dict[str, Any]:
    """Each pair of experiments, the same people in both."""
    found = {}
    for a, b in PAIRS:
        both = laboratory.both(a, b)
        if both:
            found[f"{a.name} and {b.name}"] = _of(a, b, both, laboratory.smoke)
    return found


def _of(a: Case, b: Case, both: Sequence[tuple[Person, Person]], smoke: bool) -> dict[str, Any]:
    updates: dict[str, Any] = {}
    for name in COLUMNS:
        ours = np.array([course(one, name, one, a, smoke) for one, _ in both])
        theirs = np.array([course(other, name, one, b, smoke) for one, other in both])
        updates[name] = {
            span: _compared(values[0], values[1])
            for span, values in {
                "first": (ours[:, 0], theirs[:, 0]),
                "last": (ours[:, -1], theirs[:, -1]),
                "all": (ours.mean(axis=1), theirs.mean(axis=1)),
            }.items()
        }
    readings = {}
    for key, (_, attribute) in READ.items():
        readings[key] = {
            figure: _compared(
                *(
                    np.array(
                        [getattr(getattr(pair[side].learnt, attribute), figure) for pair in both]
                    )
                    for side in (0, 1)
                )
            )
            for figure in ("prediction_time", "error")
        }
    return {"a": a.name, "b": b.name, "seeds": len(both), "updates": updates, "readings": readings}


def _compared(a: FloatArray, b: FloatArray) -> dict[str, Any]:
    return {"a": estimate(a), "b": estimate(b), "difference": estimate(b - a)}


def lines(found: Mapping[str, Any]) -> list[str]:
    """Tables, and what they say."""
    parts = [
        "The same people (seeds) in A and B, with the same exploration; each B begins with what another "
        "person had taught in `transfer_other_start`, put into the frame of the ways from the new start, "
        "with all of the exploration again. The total of B counts in the units of A: by its own "
        "habituation each would be measured with another rule. Differences: B less A, of the same person, "
        "with 95 % intervals.\n"
    ]
    if not found:
        return [*parts, "Not measured: A and B are not both there.\n"]
    for title, one in found.items():
        rows = []
        for name, (label, digits, scale) in COLUMNS.items():
            for span, said in SPANS.items():
                rows.append(_row(f"{label}, {said}", one["updates"][name][span], digits, scale))
        for key, (said, _) in READ.items():
            for figure, label, digits, scale in (
                ("prediction_time", "J_pred [s]", 2, 1.0),
                ("error", "errors [%]", 1, 100.0),
            ):
                rows.append(_row(f"{label}, {said}", one["readings"][key][figure], digits, scale))
        parts += [
            f"`{title.replace(' and ', '` and `')}`, {one['seeds']} people:\n",
            markdown_table(["", "A", "B", "B less A"], rows),
            verdict(one) + "\n",
        ]
    return parts


def _row(label: str, found: Mapping[str, Any], digits: int, scale: float) -> list[str]:
    plain = [text({**found[side], "ci95": None}, digits, scale=scale) for side in ("a", "b")]
    return [label, *plain, text(found["difference"], digits, scale=scale, sign=True)]


def verdict(found: Mapping[str, Any]) -> str:
    """In words, from the intervals."""
    times, errors = found["updates"]["prediction_time"], found["updates"]["task"]
    first, last = times["first"]["difference"], times["last"]["difference"]
    said = [
        f"In the first update {_sooner(first)}; in the last one {_sooner(last)}.",
        f"Of errors, in the last update {_fewer(errors['last']['difference'])}.",
    ]
    return " ".join((*said, _in_the_end(found["readings"]["after"])))


def _in_the_end(after: Mapping[str, Any]) -> str:
    """Which last policy is better to read."""
    differences = after["prediction_time"]["difference"], after["error"]["difference"]
    if differences[0]["ci95"] is None:
        return "Whether B beats A in the end, so few people do not tell."
    sooner, fewer = map(is_below_zero, differences)
    speed = {True: "sooner", False: "later", None: "neither sooner nor later"}[sooner]
    more = differences[1]["mean"] > 0.0
    errors = {
        True: "with fewer errors",
        False: "with more errors",
        None: f"with {'more' if more else 'no more'} errors here, though the interval does not tell",
    }[fewer]
    if sooner is False or fewer is False or not (sooner or fewer):
        said = "does not beat"
    else:
        # A guess that is soon and wrong is no better: without doubt only where errors did not rise at all.
        said = "does not clearly beat" if fewer is None and more else "beats"
    points = text(differences[1], 1, scale=100.0, sign=True)
    return (
        f"So in the end B {said} A: as far as the intervals tell, its last policy is read {speed} than A's "
        f"({text(differences[0], 2, sign=True)} s), {errors} ({points} points)."
    )


def _sooner(difference: dict[str, Any]) -> str:
    size = text(difference, 2, sign=True)
    return {
        True: f"B is read sooner ({size} s)",
        False: f"B is read later ({size} s)",
        None: f"no difference of J_pred can be told ({size} s)",
    }[is_below_zero(difference)]


def _fewer(difference: dict[str, Any]) -> str:
    size = text(difference, 1, scale=100.0, sign=True)
    return {
        True: f"B has fewer ({size} points)",
        False: f"B has more ({size} points)",
        None: f"no difference can be told ({size} points)",
    }[is_below_zero(difference)]
