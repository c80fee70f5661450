"""How an evaluation is shown: tables on a terminal and in Markdown."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rich.table import Table
from rich.text import Text

from hri_prediction.results.origin import origin_line
from hri_sim.benchmark.report import markdown_table

COLUMNS = (
    "KL forward",
    "KL backward",
    "reach time MSE [s²]",
    "terminal, reached [mm]",
    "all [mm]",
    "max [mm]",
    "reached [%]",
)
LIKENESS = ("sample", "paired", "coverage", "mean")
DIRECTIONS = ("", "forward", "backward")


def columns(found: Mapping[str, Any]) -> list[str]:
    """The columns of one policy, without / with noise."""
    return [
        f"{number(without)} / {number(noisy)}"
        for without, noisy in zip(_values(found), _values(found["noise"]), strict=True)
    ]


def _values(found: Mapping[str, Any]) -> list[float | None]:
    terminal = found["terminal_mm"]
    return [
        found["kl_forward"],
        found["kl_backward"],
        found["reach_time_mse_s2"],
        terminal["reached_mean"],
        terminal["all_mean"],
        terminal["max"],
        100.0 * found["reached_share"],
    ]


def number(value: float | None, digits: int = 3) -> str:
    """With so many digits; a dash if there is none."""
    if value is None:
        return "–"
    return f"{value:.0f}" if abs(value) >= 10**digits else f"{value:.{digits}g}"


def policy_rows(configs: Mapping[str, Mapping[str, Any]]) -> list[list[str]]:
    """Name, cell, units, data, columns and step time of each."""
    return [
        [
            name,
            found["cell"],
            "x".join(map(str, found["units"])),
            f"{found['data']} ({found['encounters']})",
            *columns(found),
            number(found["step_us"]),
        ]
        for name, found in configs.items()
    ]


POLICY_HEAD = ["policy", "cell", "units", "data (encounters)", *COLUMNS, "step [µs]"]
LIKENESS_HEAD = ["", "direction", "sample [mm]", "paired [mm]", "coverage", "mean [mm]"]
PARTNER_HEAD = [
    "partner",
    "reached [%]",
    "terminal [mm]",
    "max [mm]",
    "time MSE [s²]",
    "< 10 cm [%]",
    "nearest [mm]",
]


def likeness_rows(dtw: Mapping[str, Mapping[str, Any]]) -> list[list[str]]:
    """Policy, ProMP and people, both directions together and apart."""
    rows = []
    for name, found in dtw.items():
        for direction in DIRECTIONS:
            figures = found.get(direction) if direction else found
            if figures is not None:
                values = [number(figures[key], 4) for key in LIKENESS]
                rows.append([name, direction or "both", *values])
    return rows


def partner_rows(partners: Mapping[str, Mapping[str, Any]]) -> list[list[str]]:
    """Policy without and with noise, and people, by the partner's law."""
    return [
        [name, *map(number, _partner_values(one))]
        for law, found in partners.items()
        for name, one in (
            (law, found),
            ("  noise", found["noise"]),
            ("  people", found["human"]),
        )
    ]


def _partner_values(found: Mapping[str, Any]) -> list[float | None]:
    return [
        100.0 * found["reached_share"],
        found["terminal_mm"]["all_mean"],
        found["terminal_mm"]["max"],
        found["reach_time_mse_s2"],
        100.0 * found["near_share"],
        found["nearest_median_mm"],
    ]


def floor_text(found: Mapping[str, Any]) -> str:
    """What people differ by among themselves, as a divergence."""
    floor = found["kl_floor"]
    return f"{number(floor['forward'])} forward, {number(floor['backward'])} backward"


def table(title: str, head: list[str], rows: list[list[str]]) -> Table:
    """For a terminal."""
    found = Table(title=Text(title), title_justify="left", box=None, pad_edge=False)
    for index, name in enumerate(head):
        found.add_column(Text(name), justify="left" if index == 0 else "right", overflow="fold")
    for row in rows:
        found.add_row(*(Text(cell) for cell in row))
    return found


def transposed(head: list[str], rows: list[list[str]]) -> tuple[list[str], list[list[str]]]:
    """A table that grows downwards with its columns, and to the right with its rows."""
    first, *others = zip(head, *rows, strict=True)
    return list(first), [list(row) for row in others]


def tables(results: Mapping[str, Any]) -> list[tuple[str, list[str], list[list[str]]]]:
    """Titles, heads and rows of all tables."""
    found = [
        (
            "Without / with noise N(0, 9 mm²); divergences in nats",
            *transposed(POLICY_HEAD, policy_rows(results["configs"])),
        )
    ]
    for name, one in results["configs"].items():
        found.append((f"{name}: dynamic time warping", LIKENESS_HEAD, likeness_rows(one["dtw"])))
        if one["partners"]:
            found.append(
                (
                    f"{name}: beside partners that answer it; {next(iter(one['partners']))}: as those "
                    "learnt from; nearest: median",
                    PARTNER_HEAD,
                    partner_rows(one["partners"]),
                )
            )
    return found


def report(results: Mapping[str, Any]) -> str:
    """The same in Markdown."""
    parts = ["# Policies, evaluated\n", origin_line(results["origin"]) + "\n"]
    for title, head, rows in tables(results):
        parts += [f"## {title}\n", markdown_table(head, rows)]
    for name, one in results["configs"].items():
        parts.append(
            f"{name}: people differ among themselves by KL {floor_text(one)} (one half of the paths "
            f"from the other). ![paths of {name}]({one['picture']})\n"
        )
    return "\n".join(parts)
