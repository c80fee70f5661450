"""The sections of the report, and the text of ``rnn.md``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from hri_prediction.results.origin import origin_line
from hri_sim.policy_report import (
    bars,
    configurations,
    encounters,
    handovers,
    likeness,
    partners,
    pictures,
    sets,
    size,
    times,
)
from hri_sim.policy_report.section import Section

SECTIONS = (
    Section("sets", "Sets (table 5.1)", sets.measure, sets.lines),
    Section("configurations", "Configurations (table 5.2)", configurations.measure, configurations.lines),
    Section("likeness", "Likeness to people (table 5.3)", likeness.measure, likeness.lines),
    Section("handovers", "Recorded handovers", handovers.measure, handovers.lines),
    Section("partners", "Partners unlike those learnt from", partners.measure, partners.lines),
    Section("encounters", "The separation filter", encounters.measure, encounters.lines),
    Section("size", "Size against detail (figure 5.4c)", size.measure, size.lines),
    Section("times", "Time", times.measure, times.lines),
    Section("pictures", "Pictures", pictures.measure, pictures.lines),
)  # fmt: skip

SMOKE = (
    "**A smoke run: policies that learnt next to nothing, a few encounters. Its figures say that "
    "everything runs, and nothing else.**\n"
)


def report(content: Mapping[str, Any]) -> str:
    """Text in Markdown.

    Args:
        content: Of ``rnn.json``.
    """
    smoke = " --smoke" if content["smoke"] else ""
    results = {name: one["results"] for name, one in content["sections"].items()}
    origins = [origin_line(one["origin"]) for one in content["sections"].values()]
    parts = [
        "# Learnt policies, measured\n",
        f"Made by `scripts/reproduce_rnn.py{smoke}` from policies that learn from two people how to move a "
        "hand beside a partner's (chapter 5 of the thesis). The thesis' recordings are not public: people "
        "here are simulated, and recorded handovers by others stand beside them. So figures of the thesis "
        "that stand beside ours are of other people, and neither better nor worse for it.\n",
        *(f"{line}\n" for line in dict.fromkeys(origins)),
        *([SMOKE] if content["smoke"] else []),
        *bars.lines(bars.bars(results)),
    ]
    for section in SECTIONS:
        parts += [f"## {section.title}\n", *section.lines(results[section.name])]
    return "\n".join(parts)
