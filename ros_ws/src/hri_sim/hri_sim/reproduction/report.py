"""The text of ``ptomp.md``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from hri_prediction.results.origin import origin_line
from hri_sim.reproduction import failures, missed, pictures, thesis, times
from hri_sim.reproduction.bars import bar_lines
from hri_sim.reproduction.section import Measured
from hri_sim.reproduction.sections import HEADLINE, SECTIONS

SMOKE = (
    "**A smoke run: a condition or two of two tasks. Its figures say that everything runs, and nothing "
    "else.**\n"
)


def report(content: Mapping[str, Any], measured: Mapping[str, Mapping[str, Measured]]) -> str:
    """Text in Markdown.

    Args:
        content: Of ``ptomp.json``.
        measured: What was measured, by section and plan.
    """
    headline = {one.plan.slowdown: one for one in measured[HEADLINE.name].values()}
    smoke = " --smoke" if content["smoke"] else ""
    parts = [
        "# The planners, measured\n",
        f"Made by `scripts/reproduce_ptomp.py{smoke}`, in virtual time: what the conditions are and what "
        "is counted says [planner_benchmark.md](../planner_benchmark.md). In brackets: 95 % intervals of "
        "as many independent trials as the tasks make. Shares near 100 % leave no room for differences: "
        "with 90 motions, of fewer than about ten points nothing can be said.\n",
        origin_line(content["origin"]) + "\n",
        *([SMOKE] if content["smoke"] else []),
        *bar_lines(content["bars"]),
        "## Beside the thesis\n",
        *thesis.lines([one for found in measured.values() for one in found.values()]),
    ]
    for section in SECTIONS:
        parts += [f"## {section.title}\n", *section.lines(measured[section.name])]
        if section is HEADLINE:
            parts += ["## Bars that were missed\n", *missed.lines(content["bars"], headline)]
            parts.append("## What went wrong\n")
            for slowdown, one in headline.items():
                motions = one.results["conditions"] * len(one.results["seeds"])
                parts += failures.lines(content["failures"], motions, slowdown)
    parts += ["## Pictures\n", *pictures.lines(content["pictures"])]
    parts += ["## Time\n", *times.lines(content["times"])]
    return "\n".join(parts)
