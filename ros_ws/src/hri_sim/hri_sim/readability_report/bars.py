"""What is wanted of policies that improve by people, held against what was measured."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from hri_sim.benchmark.report import markdown_table
from hri_sim.policy_report.bars import Bar
from hri_sim.readability_report.cases import CASES, TEACHER, A

LEAST_PEOPLE = 20
"""Of fewer nothing is said of how many improve."""


def bars(sections: Mapping[str, Any]) -> list[Bar]:
    """All of them, from the results of the sections."""
    parts, improved = sections["parts"], sections["improvement"]
    head_on = [one for one in parts["head_on"] if one["field"]]
    singular = parts["singularities"].values()
    found = [
        Bar(
            f"batch of {parts['rollouts']['batch']} roll-outs, median", 3.0, True, "ms",
            parts["rollouts"]["median_ms"],
        ),
        Bar(
            "imitation, root mean square, worst demonstration", 0.5, True, "mm",
            max(one["max_mm"] for one in parts["imitation"].values()),
        ),
        Bar("field, difference from finite differences", 1e-6, True, "", parts["field"]["error"]),
        Bar(
            "hands exactly in the way: goals reached", 100.0, False, "%",
            100.0 * sum(one["reached"] for one in head_on) / len(head_on),
        ),
        Bar(
            "hands exactly in the way: contacts", 0.0, True, "",
            float(sum(one["clearance_m"] <= 0.0 for one in head_on)),
        ),
        Bar(
            "through singular postures: joint speed", 2.0, True, "rad/s",
            max(one["speed_max_rad_s"] for one in singular),
        ),
        Bar(
            "through singular postures: tool error", 1.0, True, "mm",
            max(one["error_max_mm"] for one in singular),
        ),
    ]  # fmt: skip
    own = improved.get(A.name)
    enough = own is not None and own["seeds"] >= LEAST_PEOPLE
    found.append(
        Bar(
            f"`{A.name}`: people for whom J_pred falls by 10 % or more and errors do not rise, of at "
            f"least {LEAST_PEOPLE}", 90.0, False, "%",
            100.0 * own["improved"]["share"] if own is not None and enough else None,
        )
    )  # fmt: skip
    for case in (*CASES, TEACHER):
        if case.name in improved:
            one = improved[case.name]
            what = f"`{case.name}`: contacts in {one['all_trials']:,} trials"
            found.append(Bar(what, 0.0, True, "", float(one["contacts"])))
    return found


def lines(found: Sequence[Bar]) -> list[str]:
    """How many are met, and a table."""
    verdicts = [bar.verdict.strip("*") for bar in found]
    counts = [
        f"{count} {word}"
        for word in ("met", "missed", "not measured")
        if (count := verdicts.count(word)) or word != "not measured"
    ]
    return [
        f"Wanted and measured: {', '.join(counts)}.\n",
        markdown_table(["what", "measured", "wanted", "verdict"], [bar.texts() for bar in found]),
    ]
