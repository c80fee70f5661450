"""How people read the first and the last policy: those who taught it, and those of another kind."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from hri_sim.benchmark.report import markdown_table
from hri_sim.readability_report.cases import CASES
from hri_sim.readability_report.intervals import estimate, is_below_zero, text
from hri_sim.readability_report.laboratory import Laboratory

FIGURES = ("prediction_time", "decision_time", "error")
READERS = {"own": ("before", "after"), "others": ("others_before", "others_after")}
SAID = {"own": "who taught it", "others": "another kind of person"}


def measure(laboratory: Laboratory) -> dict[str, Any]:
    """Means before and after and their changes, by experiment, reader and figure."""
    found: dict[str, Any] = {}
    for case in CASES:
        people = [person.learnt for person in laboratory.of(case).values()]
        if not people:
            continue
        found[case.name] = {"seeds": len(people)}
        for reader, (before, after) in READERS.items():
            own = {}
            for figure in FIGURES:
                first = [getattr(getattr(one, before), figure) for one in people]
                last = [getattr(getattr(one, after), figure) for one in people]
                own[figure] = {
                    "before": estimate(first),
                    "after": estimate(last),
                    "change": estimate([b - a for a, b in zip(first, last, strict=True)]),
                }
            found[case.name][reader] = own
    return found


def lines(found: Mapping[str, Any]) -> list[str]:
    """A table, and whether others gain, too."""
    rows = []
    for name, one in found.items():
        for reader in READERS:
            own, cells = one[reader], []
            for figure in FIGURES:
                scale, digits = (100.0, 1) if figure == "error" else (1.0, 2)
                cells += [
                    f"{text({**own[figure]['before'], 'ci95': None}, digits, scale=scale)} → "
                    f"{text({**own[figure]['after'], 'ci95': None}, digits, scale=scale)}",
                    text(own[figure]["change"], digits, scale=scale, sign=True),
                ]
            rows.append([f"`{name}`", SAID[reader], *cells])
    return [
        "Policies are tuned on people who infer goals from the way that is left. *Another kind of person* "
        "goes by where the tool is heading, forgets, sees worse, is more biased, and is slower. J_pred: "
        "until the key is pressed or the hand has arrived; decision: until the key is pressed or the hand "
        "sets out.\n",
        markdown_table(
            [
                "experiment", "read by", "J_pred [s]", "change", "decision [s]", "change",
                "errors [%]", "change [points]",
            ],
            rows,
        ),
        *_verdicts(found),
    ]  # fmt: skip


def _verdicts(found: Mapping[str, Any]) -> list[str]:
    """What the intervals of people of another kind say."""
    said = {True: [], False: [], None: []}  # type: dict[bool | None, list[str]]
    for name, one in found.items():
        said[is_below_zero(one["others"]["prediction_time"]["change"])].append(f"`{name}`")
    parts = []
    if said[True]:
        parts.append(f"read the last policy sooner in {', '.join(said[True])}")
    if said[False]:
        parts.append(f"read it later in {', '.join(said[False])}")
    if said[None]:
        parts.append(f"show no difference that the intervals tell in {', '.join(said[None])}")
    return [f"People of another kind {'; '.join(parts)}.\n"] if parts else []
