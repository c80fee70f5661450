"""The report of a soak: ``soak.json``, ``soak.md`` and ``soak.png`` from its record."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hri_prediction.errors import DataError
from hri_prediction.results.origin import origin_line
from hri_sim.readability_report.run_folder import write_json
from hri_sim.recording.folders import bag_folders
from hri_sim.soak.contacts import Contact, contacts_of
from hri_sim.soak.faults import WORDS
from hri_sim.soak.judging import figures, verdict
from hri_sim.soak.log import LOG, read_log
from hri_sim.soak.picture import draw_soak

BAG = "bag"
"""Folder of the first bag of a run."""
FIGURES, TEXT, PICTURE = "soak.json", "soak.md", "soak.png"
LEAST_KEPT_MB = 0.1
"""Less than that, kept of a standstill, is not listed [MB]."""
_VERDICTS = {True: "met", False: "**missed**", None: "not judged"}


def write_report(folder: Path) -> dict[str, Any]:
    """Make the report of the record in a folder.

    Returns:
        The content of ``soak.json``.

    Raises:
        DataError: when there is no record.
    """
    record = read_log(folder / LOG)
    content = figures(record, np.random.default_rng(0), _contacts_in(folder))
    write_json(folder / FIGURES, content)
    (folder / TEXT).write_text(report(content))
    draw_soak(record, folder / PICTURE)
    return content


def _contacts_in(folder: Path) -> list[Contact] | None:
    """Those that the bags of a run have; none without a bag that can be read."""
    bags = bag_folders(folder / BAG)
    try:
        return contacts_of(bags) if bags else None
    except DataError:
        return None  # whether bags can be read is judged by itself


def _cell(value: float | None, style: str) -> str:
    return "–" if value is None else format(value, style)


def bar_rows(content: dict[str, Any]) -> list[tuple[str, str, str, str]]:
    """What is wanted: (what, measured, wanted, verdict)."""
    return [
        (bar["what"], bar["measured"], bar["wanted"], _VERDICTS[bar["met"]])
        for bar in content["bars"]
    ]


def memory_table(content: dict[str, Any]) -> list[tuple[str, ...]]:
    """Memory of each process, a row a life; the judged ones and the longest of each node."""
    longest: dict[str, float] = {}
    for row in content["memory"]:
        longest[row["node"]] = max(longest.get(row["node"], 0.0), row["lived_s"])
    found = []
    for row in content["memory"]:
        growth = row["growth"]
        if growth is None and row["lived_s"] < longest[row["node"]]:
            continue
        found.append(
            (
                row["node"],
                f"{row['lived_s'] / 60.0:.1f}",
                "–" if growth is None else f"{growth['first']:.1f}",
                "–" if growth is None else f"{growth['last']:.1f}",
                "–" if growth is None else f"{growth['share']:+.1%}",
                f"{row['threads'][0]}→{row['threads'][1]}",
                f"{row['files'][0]}→{row['files'][1]}",
                _cell(row["cores"], ".2f")
                if row["load"] is None
                else "→".join(f"{cores:.2f}" for cores in row["load"]),
            )
        )
    return sorted(found)


def kept_lines(content: dict[str, Any]) -> list[str]:
    """What processes kept of their first standstill, a line a life that was judged."""
    return [
        f"- Kept of its first standstill: {row['node']} {row['kept_mb']:.1f} MB"
        for row in content["memory"]
        if row["kept_mb"] >= LEAST_KEPT_MB
    ]


MEMORY_HEAD = (
    "process", "lived [min]", "first [MB]", "last [MB]", "growth", "threads", "files", "cores",
)  # fmt: skip
FAULT_HEAD = (
    "fault", "node", "count", "at rest", "in [ms]", "named [ms]", "ready [s]", "reached",
    "in [s]", "right",
)  # fmt: skip
CONTACT_HEAD = (
    "at [min]", "for [s]", "robot's speed towards the person [m/s]", "robot", "person",
)  # fmt: skip
BAR_HEAD = ("what", "measured", "wanted", "verdict")


def fault_table(content: dict[str, Any]) -> list[tuple[str, ...]]:
    """What came of each kind of fault."""
    return [
        (
            row["fault"],
            row["node"] or "–",
            str(row["count"]),
            f"{row['came_to_rest']}/{row['moving']}" if row["moving"] else "–",
            _cell(row["rest_ms"], ".0f"),
            _cell(row["named_ms"], ".0f"),
            _cell(row["ready_s"], ".1f"),
            f"{row['reached']}/{row['count']}",
            _cell(row["reached_s"], ".1f"),
            "–" if row["as_wanted"] is None else f"{row['as_wanted']}/{row['count']}",
        )
        for row in content["faults"]
    ]


def _contacts(content: dict[str, Any]) -> list[str]:
    if content["contacts"] is None:
        return ["There is no bag that tells.\n"]
    rows = [
        (
            f"{contact['s'] / 60.0:.1f}",
            f"{contact['seconds']:.2f}",
            f"{contact['approach']:+.2f}",
            contact["robot_part"],
            contact["human_part"],
        )
        for contact in content["contacts"]
    ]
    if not rows:
        return ["Nobody was touched.\n"]
    return [
        "How fast the nearest point of the robot came at the person's at most, from 20 ms before the "
        "surfaces met until they parted, of its own: while its reference moved, or until 0.2 s after. "
        "People here do not see the robot; negative: it gave way all the time. From the bags, of the "
        "parts that overlap most; while no recorder runs, after it was killed, nothing is seen.\n",
        *_table(CONTACT_HEAD, rows),
    ]


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    lines = [" | ".join(head), " | ".join("---" for _ in head), *(" | ".join(r) for r in rows)]
    return [f"| {line} |" for line in lines] + [""]


def _files(content: dict[str, Any]) -> list[str]:
    files = content["files"]
    per_minute = ", ".join(_cell(rate, ".1f") for rate in files["mb_per_minute"])
    lines = [
        f"{files['total_mb']:.1f} MB in all; a minute in each third of the run: {per_minute} MB.",
        "",
    ]
    end = content["end"]
    if end is None:
        return lines
    rows = [
        (
            bag["bag"],
            f"{bag['bytes'] / 1e6:.1f}",
            f"{bag['seconds'] / 60.0:.1f}",
            f"{bag['messages']}",
            "yes" if bag["closed"] else "no: its recorder was killed",
            bag["error"] or "whole",
        )
        for bag in end["bags"]
    ]
    return [*lines, *_table(("bag", "MB", "minutes", "messages", "closed", "read"), rows)]


def report(content: dict[str, Any]) -> str:
    """The text of ``soak.md``."""
    thirds = content["latency"]["thirds"]
    latency = ", ".join(f"{_cell(t['p50'], '.1f')} / {_cell(t['p99'], '.1f')}" for t in thirds)
    ticks = ", ".join(f"{name} {rate:.1f}" for name, rate in sorted(content["rates_hz"].items()))
    reaches = content["reaches"]
    what = {row["fault"] for row in content["faults"]}
    text = [
        "# The graph over time, with faults\n",
        f"Made by `scripts/soak.py --minutes {content['minutes']:g} --seed {content['seed']}`"
        f" (faults: {content['faults_asked']}; separation: {content['separation']}): "
        f"{content['seconds'] / 60.0:.1f} minutes, {reaches['count']} goals.\n",
        f"{origin_line(content['origin'])}\n",
        f"{verdict(content)}.\n",
        *_table(BAR_HEAD, bar_rows(content)),
        *(f"- Not reached without a fault: {text}" for text in reaches["not_reached"]),
        "![Memory, latency and size of the bags over time](soak.png)\n",
        "## Memory\n",
        "Resident anonymous memory of each process, with what of it is swapped out, from half a minute "
        "of its life on. Growth is the slope of Theil and Sen over that time, or the difference of the "
        "medians of first and last third, whichever is more, as a share of the first third's; it is not "
        "extrapolated. `first` and `last` are these medians. Of lives that were too short to be judged "
        "only each node's longest is listed. What a process keeps of its first standstill (memory for all "
        "that piled up) is no growth, and is listed; of any later one it is. In the second half of the run "
        "no node is killed. Cores: "
        "medians of first and last third, of short lives the mean.\n",
        *_table(MEMORY_HEAD, memory_table(content)),
        *kept_lines(content),
        "## Latency\n",
        "Newest sample used to trajectory received by the script, without the simulated sensor's delay. "
        f"Median / 99th percentile in each third of the run: {latency} ms "
        f"({content['latency']['count']} plans).\n",
        f"Ticks a second (median): {ticks}.\n",
        "## Files\n",
        *_files(content),
        "## Faults\n",
        *([f"- {kind}: {WORDS[kind]}" for kind in WORDS if kind in what]),
        "",
        "`at rest`: of faults that must stop the robot, how often it came to rest, of the times when it "
        "moved, and how long that took at most. `named`: from a kill to when the script says so; `ready`: "
        "to when all nodes are again. `reached`: how often a goal was reached after the fault, and how "
        "long after its begin at most. `right`: how often the goals that it is about ended as they "
        "should.\n",
        *_table(FAULT_HEAD, fault_table(content)),
        "## Contacts\n",
        *_contacts(content),
    ]
    return "\n".join(text)
