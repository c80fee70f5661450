"""What is wanted of the policies, held against what was measured."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from hri_sim.benchmark.report import markdown_table
from hri_sim.policies.evaluation_report import number
from hri_sim.policy_report.policies import HANDOVER_CELLS, SEEDS

CELLS = {"C7": "gru3t", "C8": "gru", "C9": "lstm", "C13": "gru3t", "C14": "gru", "C15": "lstm"}
SETS = {"D1": ("C7", "C8", "C9"), "D2": ("C13", "C14", "C15")}


@dataclass(frozen=True)
class Bar:
    """Something wanted.

    Attributes:
        what: In words.
        wanted: Limit.
        at_most: Whether less is better.
        unit: Of both values.
        measured: The worst value; none: not measured.
    """

    what: str
    wanted: float
    at_most: bool
    unit: str
    measured: float | None

    @property
    def met(self) -> bool | None:
        """Before any rounding; none where nothing was measured."""
        if self.measured is None:
            return None
        return self.measured <= self.wanted if self.at_most else self.measured >= self.wanted

    @property
    def verdict(self) -> str:
        """In a word or two."""
        return {True: "met", False: "**missed**", None: "not measured"}[self.met]

    def texts(self) -> list[str]:
        """What, measured, wanted, verdict."""
        sign = "≤" if self.at_most else "≥"
        value = "–" if self.measured is None else f"{number(self.measured)} {self.unit}".strip()
        wanted = f"{self.wanted:g}" if self.wanted else "0"
        return [self.what, value, f"{sign} {wanted} {self.unit}".strip(), self.verdict]


def bars(sections: Mapping[str, Any]) -> list[Bar]:
    """All of them, from the results of the sections."""
    found: list[Bar] = []
    configurations = sections["configurations"]
    for data, numbers in SETS.items():
        for name in numbers:
            some = [configurations.get(f"seed_{seed}/{name}") for seed in SEEDS]
            found += _of_configuration(f"{data}, {CELLS[name]} 2x9", some)
    replays = [one.get("replay_error_m") for one in sections["sets"].values()]
    measured = [value for value in replays if value is not None]
    found.append(Bar("label replay, all encounters", 1e-9, True, "m", max(measured, default=None)))
    for cell in HANDOVER_CELLS:
        pairs = sections["handovers"].get("cells", {}).get(cell, {}).values()
        for which, noise in (("", False), (" with noise", True)):
            shares = [_share(one["noise"] if noise else one) for one in pairs]
            what = f"handovers, pairs held out, {cell}: reached{which}"
            found.append(Bar(what, 100.0, False, "%", min(shares, default=None)))
    for name, kinds in sections["encounters"]["policies"].items():
        for kind, whole in (("bounded", ""), ("arms", ", whole arms")):
            one = kinds[kind]
            what = f"violations with the filter, {name}, {one['encounters']:,} encounters{whole}"
            found.append(Bar(what, 0.0, True, "", float(one["with"]["violations"])))
    small = [one for one in sections["times"].values() if max(one["units"]) <= 9]
    steps = [one["step_us"] for one in small]
    seconds = [one["training_s"] for one in small if one["training_s"] is not None]
    found.append(Bar("one step, up to 2x9", 150.0, True, "µs", max(steps, default=None)))
    found.append(
        Bar("training, up to 2x9, one core's time", 300.0, True, "s", max(seconds, default=None))
    )
    return found


def _of_configuration(what: str, some: Sequence[Mapping[str, Any] | None]) -> list[Bar]:
    """The worst of all seeds; not measured unless all are there."""

    def worst(of: Any, at_most: bool = True) -> float | None:
        values = [None if one is None else of(one) for one in some]
        known = [value for value in values if value is not None]
        if len(known) < len(values):
            return None
        return max(known) if at_most else min(known)

    return [
        Bar(f"{what}: reached", 100.0, False, "%", worst(_share, False)),
        Bar(
            f"{what}: reached with noise", 100.0, False, "%",
            worst(lambda one: _share(one["noise"]), False),
        ),
        Bar(f"{what}: terminal, mean of all", 1.0, True, "mm", worst(_terminal("all_mean"))),
        Bar(f"{what}: terminal, max", 10.0, True, "mm", worst(_terminal("max"))),
        Bar(
            f"{what}: terminal with noise, mean of all", 3.0, True, "mm",
            worst(lambda one: _terminal("all_mean")(one["noise"])),
        ),
        Bar(
            f"{what}: reach time MSE", 0.05, True, "s²", worst(lambda one: one["reach_time_mse_s2"])
        ),
    ]  # fmt: skip


def _share(one: Mapping[str, Any]) -> float:
    return 100.0 * float(one["reached_share"])


def _terminal(name: str) -> Any:
    return lambda one: one["terminal_mm"][name]


def as_json(found: Sequence[Bar]) -> list[dict[str, Any]]:
    """For ``rnn.json``."""
    return [
        {
            "what": bar.what,
            "wanted": bar.wanted,
            "at_most": bar.at_most,
            "unit": bar.unit,
            "measured": bar.measured,
            "met": bar.met,
        }
        for bar in found
    ]


def lines(found: Sequence[Bar]) -> list[str]:
    """How many are met; a table of the configurations, a line each, and one of all else."""
    verdicts = [bar.verdict.strip("*") for bar in found]
    counts = [
        f"{count} {word}"
        for word in ("met", "missed", "not measured")
        if (count := verdicts.count(word)) or word != "not measured"
    ]
    grouped: dict[str, list[Bar]] = {}
    for bar in found:
        group, colon, _ = bar.what.partition(": ")
        grouped.setdefault(group if colon else "", []).append(bar)
    others = grouped.pop("", [])
    first = next(iter(grouped.values()))
    head = [f"{bar.what.partition(': ')[2]}, {bar.texts()[2]}" for bar in first]
    rows = [
        [group, *(f"{bar.texts()[1]} {bar.verdict}" for bar in some)]
        for group, some in grouped.items()
    ]
    return [
        f"Wanted and measured: {', '.join(counts)}. Configurations: in unseen setups with unseen people, "
        f"the worst of {len(SEEDS)} seeds.\n",
        markdown_table(["", *head], rows),
        markdown_table(["what", "measured", "wanted", "verdict"], [bar.texts() for bar in others]),
    ]
