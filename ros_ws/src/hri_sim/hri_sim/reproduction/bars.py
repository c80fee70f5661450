"""What is wanted of the planner in the test conditions, held against what was measured."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from hri_sim.benchmark.conditions import task_conditions
from hri_sim.benchmark.outcome import Outcome
from hri_sim.benchmark.report import SHARE_HEADS, markdown_table, points_text, share_text
from hri_sim.benchmark.summary import SHARES, by_task, compare, figures
from hri_sim.reproduction.section import Measured

OURS = "ptomp"
ITOMP = "itomp"
STOMP = "stomp_prior"
"""The opponents."""
SLOWDOWNS = (1.0, 64.0)
"""Of the machines on which something is wanted."""


@dataclass(frozen=True)
class Bar:
    """One share, or one lead over another planner, that is wanted of `OURS`.

    Attributes:
        share: One of :data:`.SHARES`.
        slowdown: F of the machine.
        low: Smallest value wanted, 0 to 1.
        against: The planner whose share is subtracted; none: nothing is.
        ambiguous: Whether only the tasks count in which only watching tells the target.
    """

    share: str
    slowdown: float
    low: float
    against: str | None = None
    ambiguous: bool = False

    @property
    def what(self) -> str:
        """The figure in words."""
        text = SHARE_HEADS[self.share]
        if self.against is not None:
            text = f"{text}, more than `{self.against}`"
        if self.ambiguous:
            text += ", ambiguous tasks"
        return f"{text}, F = {self.slowdown:g}"

    def measured(self, plan: Measured) -> tuple[float, list[float] | None] | None:
        """The value and its 95 % interval; none when there was nothing to measure."""
        ours = self._outcomes(plan, OURS)
        if self.against is None:
            found = figures(ours) if ours else None
        else:
            theirs = self._outcomes(plan, self.against)
            found = compare(ours, theirs) if ours and theirs else None
        return None if found is None else (found[self.share], found["ci95"][self.share])

    def _outcomes(self, plan: Measured, planner: str) -> Mapping[int, Sequence[Outcome]]:
        found = by_task(plan.done, planner)
        if not self.ambiguous:
            return found
        split = plan.plan.split
        return {t: some for t, some in found.items() if task_conditions(split, t).task.ambiguous}


BARS = (
    Bar("ok", 1.0, 0.98),
    Bar("strict", 1.0, 0.96),
    Bar("clearance_2cm", 1.0, 0.95),
    Bar("ok", 1.0, 0.10, against=ITOMP),
    Bar("clearance_2cm", 1.0, 0.15, against=ITOMP),
    Bar("ok", 1.0, 0.10, against=STOMP, ambiguous=True),
    Bar("ok", 64.0, 0.90),
    Bar("ok", 64.0, 0.10, against=ITOMP),
    Bar("clearance_2cm", 64.0, 0.15, against=ITOMP),
    Bar("ok", 64.0, 0.10, against=STOMP, ambiguous=True),
)
"""Those that the benchmark can tell. Leads are wanted on whatever machine: on the reference machine, and on
one that is 64 times slower."""


def judge(bar: Bar, measured: Mapping[float, Measured]) -> dict[str, Any]:
    """A bar, what was measured by F, and whether it is met: before any rounding; nothing is a miss."""
    assert bar.share in SHARES
    plan = measured.get(bar.slowdown)
    found = None if plan is None else bar.measured(plan)
    value, span = (None, None) if found is None else found
    # What is exactly on a bar must not miss it by a rounding error of a difference.
    met = value is not None and round(value - bar.low, 9) >= 0.0
    return {
        "what": bar.what,
        "share": bar.share,
        "slowdown": bar.slowdown,
        "ambiguous": bar.ambiguous,
        "against": bar.against,
        "wanted": bar.low,
        "measured": value,
        "ci95": span,
        "met": met,
    }


def bar_texts(judged: Mapping[str, Any]) -> tuple[str, str]:
    """What was measured and what is wanted: percents of a share, points of a difference.

    Of a bar of :mod:`.elsewhere` both are in its own unit.
    """
    value = judged["measured"]
    if "unit" in judged:
        return ("–" if value is None else in_unit(value, judged)), (
            f"{'≤' if judged['at_most'] else '≥'} {in_unit(judged['wanted'], judged)}"
        )
    span = judged["ci95"]
    if judged["against"] is None:
        return share_text(value, span), f"≥ {100.0 * judged['wanted']:g} %"
    wanted = f"≥ {100.0 * judged['wanted']:g} points"
    return ("–" if value is None else points_text(value, span)), wanted


def in_unit(value: float, judged: Mapping[str, Any]) -> str:
    """A value with the unit of its bar."""
    return f"{value:,.4g} {judged['unit']}" if value < 1e4 else f"{value:,.0f} {judged['unit']}"


def verdict(judged: Mapping[str, Any]) -> str:
    """In a word or two."""
    return {True: "met", False: "missed", None: "not measured"}[judged["met"]]


def bar_lines(judged: Sequence[Mapping[str, Any]]) -> list[str]:
    """How many bars are met, and the table of all."""
    verdicts = [verdict(bar) for bar in judged]
    counts = [
        f"{count} {word}"
        for word in ("met", "missed", "not measured")
        if (count := verdicts.count(word)) or word != "not measured"
    ]
    rows = [
        [
            str(bar["what"]),
            *bar_texts(bar),
            "**missed**" if word == "missed" else word,
            bar.get("origin") or ("–" if "unit" in bar else "here"),
        ]
        for bar, word in zip(judged, verdicts, strict=True)
    ]
    return [
        f"Wanted and measured, of `{OURS}`: {', '.join(counts)}. Measured values count, not intervals; "
        "a lead counts once for each F.",
        "",
        markdown_table(["what", "measured", "wanted", "verdict", "measured where"], rows),
    ]
