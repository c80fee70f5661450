"""The sections of the report, and the text of ``dmp.md``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from hri_prediction.results.origin import origin_line
from hri_sim.readability_report import (
    bars,
    improvement,
    parts,
    pictures,
    readings,
    terms,
    transfer,
    updates,
)
from hri_sim.readability_report.section import Section

SECTIONS = (
    Section("improvement", "What was done, and who improved", improvement.measure, improvement.lines),
    Section("readings", "How people read the first and the last policy", readings.measure, readings.lines),
    Section("terms", "Costs, term by term", terms.measure, terms.lines),
    Section("updates", "Costs, update by update", updates.measure, updates.lines),
    Section("transfer", "A against B", transfer.measure, transfer.lines),
    Section("parts", "The parts by themselves", parts.measure, parts.lines),
    Section("pictures", "Pictures", pictures.measure, pictures.lines),
)  # fmt: skip

SMOKE = (
    "**A smoke run: few people, hardly any updates, few readings. Its figures say that everything runs, "
    "and nothing else.**\n"
)


def report(content: Mapping[str, Any]) -> str:
    """Text in Markdown.

    Args:
        content: Of ``dmp.json``.
    """
    smoke = " --smoke" if content["smoke"] else ""
    results = content["sections"]
    made = [origin_line(one) for one in content["origins"]]
    others = [line for line in made if line != origin_line(content["origin"])]
    text = [
        "# Policies that improve by people, measured\n",
        f"Made by `scripts/reproduce_dmp.py{smoke}`: movement primitives whose ways become easier to read, "
        "trial by trial, by what people do who see them (PI^BB, chapter 7 of the thesis). People here are "
        "simulated: an observer who infers the goal from the way so far, and a hand that reaches for the "
        "goal that is guessed. The thesis' people were real, and its recordings are not public, so its "
        "figures do not stand beside ours. Simulated people do not get used to the robot: what changes "
        "here, the policy has changed.\n",
        f"{origin_line(content['origin'])}\n",
        *([f"People took part at: {' '.join(others)}\n"] if others else []),
        *([SMOKE] if content["smoke"] else []),
        *bars.lines(bars.bars(results)),
    ]
    for section in SECTIONS:
        text += [f"## {section.title}\n", *section.lines(results[section.name])]
    return "\n".join(text)
