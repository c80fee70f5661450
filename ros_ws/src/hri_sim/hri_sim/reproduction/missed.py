"""A closer look at the bars that were missed, and what was tried."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from hri_sim.benchmark.report import (
    MEAN_HEADS,
    SHARE_HEADS,
    markdown_table,
    points_text,
    share_text,
)
from hri_sim.reproduction.bars import OURS, bar_texts
from hri_sim.reproduction.section import Measured

TRIED = """Notes by hand on what was tried, all of it on tuning tasks alone:

- The margins of PTOMP and of its peers were tuned, each planner for itself.
- `late_weight` from 0.1 to 1.0: motions became shorter, and as many succeeded.
- Time scaling only after the plan itself was mended: motions became 0.2 s shorter; this was kept.
- Homes of the person's hand on its own side: of 60 motions `itomp` was ok in 98 %, `ptomp` in all. The lead
  did not grow.

At F = 1 the core that all planners share replans 28 times a second with some twenty iterations each (it
stops after `patience` iterations that bring nothing). In these scenes that is enough to keep clear with
constant velocity: what a better prediction could save is saved by planning again. STOMP has as much time
before it sets off as others have on the way, for which nobody waits, and with the prior it knows where
all reaches may lead; a motion that keeps clear of all of them mostly exists here. At F = 64, 238 of the
250 ms from plan to plan are fixed charges: PTOMP has hardly an iteration, and plans that are a quarter of
a second old.
"""
TRIED_ELSEWHERE = {
    "configuration in float64, NumPy ÷ ours": """\
One configuration is the forward kinematics, nine pairs of capsules and their costs. NumPy is written in
two ways for it; beside the faster one the ratio is half of this ([kernel](kernel/results.md)). Notes by
hand on what was tried: distances from scalar products alone (9 % faster, but off by 5e-13 m, in single
precision by 17 µm), one division for three pairs (no gain), and, only to see what they cost, no square
roots (7 % faster). Arithmetic fills the vector units: 7 of some 25 ns are the kinematics. The kernel stayed
as exact as it was.
""",
}
"""By the bar that another command's figures are held against."""
_KINDS = {None: "all", "ambiguous": "ambiguous", "person_must_move": "person must move"}
_MEANS = ("clearance_m", "time_to_goal_s", "accel_cost")


def lines(bars: Sequence[Mapping[str, Any]], measured: Mapping[float, Measured]) -> list[str]:
    """A part for each bar that was measured and missed, those of other commands last.

    Args:
        bars: All bars, as judged.
        measured: The planners side by side, by F.
    """
    missed = [
        bar
        for bar in bars
        if bar["met"] is False and "unit" not in bar and bar["measured"] is not None
    ]
    elsewhere = [bar for bar in bars if bar["met"] is False and "unit" in bar]
    others: list[str] = []
    for bar in elsewhere:
        value, wanted = bar_texts(bar)
        others.append(f"### {bar['what']}: {value}, wanted {wanted}\n")
        others += [TRIED_ELSEWHERE[bar["what"]]] if bar["what"] in TRIED_ELSEWHERE else []
    if not missed:
        return ["No bar of the benchmark was missed.\n", *others]
    parts: list[str] = []
    shown: set[tuple[float, str | None]] = set()
    for bar in missed:
        value, wanted = bar_texts(bar)
        parts.append(f"### {bar['what']}: {value}, wanted {wanted}\n")
        names = [OURS] if bar["against"] is None else [OURS, str(bar["against"])]
        results = measured[bar["slowdown"]].results["planners"]
        if bar["against"] is not None:
            parts.append(_room(bar, results))
        if not bar["ambiguous"]:
            parts.append(_by_slowdown(bar["share"], names, measured))
        if (bar["slowdown"], bar["against"]) not in shown:
            shown.add((bar["slowdown"], bar["against"]))
            parts += [f"By kind of condition, F = {bar['slowdown']:g}:\n", _by_kind(names, results)]
    return [*parts, TRIED, *others]


def _room(bar: Mapping[str, Any], results: Mapping[str, Mapping[str, Any]]) -> str:
    """How large a lead could be at all."""
    found = results[bar["against"]]
    if bar["ambiguous"]:
        found = found["ambiguous"]
    share = found[bar["share"]]
    room = 1.0 - share
    text = (
        f"`{bar['against']}` has {share_text(share, None)} itself: a lead can be at most "
        f"{points_text(room, None)} points"
    )
    return f"{text}, less than is wanted.\n" if room < bar["wanted"] else f"{text}.\n"


def _by_kind(names: Sequence[str], results: Mapping[str, Mapping[str, Any]]) -> str:
    rows = []
    for kind, text in _KINDS.items():
        for name in names:
            found = results[name] if kind is None else results[name][kind]
            if not found:
                continue
            cells = [text, f"`{name}`"]
            cells += [share_text(found[key], found["ci95"][key]) for key in SHARE_HEADS]
            for key in _MEANS:
                value = found[key]
                cells.append("–" if value is None else format(value, MEAN_HEADS[key][1]))
            rows.append(cells)
    heads = [*SHARE_HEADS.values(), *(MEAN_HEADS[key][0] for key in _MEANS)]
    return markdown_table(["conditions", "planner", *heads], rows)


def _by_slowdown(share: str, names: Sequence[str], measured: Mapping[float, Measured]) -> str:
    rows = []
    for name in names:
        found = [one.results["planners"][name] for one in measured.values()]
        rows.append([f"`{name}`", *(share_text(f[share], f["ci95"][share]) for f in found)])
    return markdown_table([SHARE_HEADS[share], *(f"F = {slow:g}" for slow in measured)], rows)
