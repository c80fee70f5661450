"""What is in a bag, whether it is whole, and recovery of one whose recorder was killed."""

from __future__ import annotations

import argparse
import json
import math
import os
import sys
from datetime import UTC, datetime

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from hri_prediction.bags.inspect import BagReport, Latency, inspect_bag
from hri_prediction.bags.salvage import SalvageReport, salvage
from hri_prediction.errors import HriError


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="inspect_bag.py",
        description="Show what a bag holds: topics, rates, gaps, latencies, provenance. Of bags whose "
        "recorder was killed, and of damaged ones, also what is missing; --salvage makes proper bags of "
        "them.",
        epilog="Exit codes: 0 the bag was closed in order and can be read, or was salvaged; 1 there is no "
        "bag, or no message of it can be read; 2 wrong arguments; 3 it was not closed, or is damaged, and "
        "--salvage recovers messages of it.",
    )
    parser.add_argument("bag", help="bag folder, or an .mcap file")
    parser.add_argument("--salvage", metavar="OUT", help="recover all whole messages to a new bag")
    parser.add_argument("--json", action="store_true", help="print the report as JSON")
    return parser


_WIDTH = 100
"""Columns of the tables, where the terminal is not narrower."""


def _number(value: float, digits: int = 1) -> str:
    return "–" if not math.isfinite(value) else f"{value:,.{digits}f}"


def _latency(value: Latency | None) -> list[str]:
    if value is None:
        return ["–", "–", "–"]
    return [_number(part * 1e3) for part in (value.p50, value.p99, value.worst)]


def _table(texts: tuple[str, ...], numbers: tuple[str, ...] = ()) -> Table:
    table = Table(box=None, pad_edge=False, header_style="bold", padding=(0, 1, 0, 0))
    for name in texts:
        table.add_column(escape(name), overflow="fold")
    for name in numbers:
        table.add_column(escape(name), justify="right", no_wrap=True)
    return table


def show(report: BagReport, console: Console) -> None:
    """Print a report for people."""
    start = datetime.fromtimestamp(report.start_ns * 1e-9, tz=UTC)
    state = "closed in order" if report.closed else "[bold red]NOT CLOSED[/]"
    if report.damage:
        state += ", [bold red]DAMAGED[/]"
    if source := report.custom_data.get("salvaged_from"):
        state += f", salvaged from {escape(source)}"
    console.print(f"[bold]{escape(report.path)}[/]: {state}", highlight=False, soft_wrap=True)
    facts = {
        "files": ", ".join(f"{name} ({size / 1e6:.2f} MB)" for name, size in report.files.items()),
        "start": f"{start:%Y-%m-%d %H:%M:%S.%f} UTC",
        "duration": f"{report.duration_s:.3f} s",
        "messages": f"{report.messages:,}",
        **report.custom_data,
    }
    attached = [f"{name} ({size} bytes)" for name, size in report.attachments.items()]
    if attached:
        facts["attached"] = ", ".join(attached)
    head = Table.grid(padding=(0, 1))
    head.add_column(no_wrap=True)
    head.add_column(overflow="fold")
    for key, value in facts.items():
        head.add_row(f"  {escape(key)}", escape(value))
    console.print(head, highlight=False)
    figures = _table(
        ("topic",),
        ("count", "rate\n[Hz]", "longest\ngap [s]", "begins\nat [s]", "missing"),
    )
    latencies = _table(
        ("received later than [ms]",),
        ("sent\np50", "\np99", "\nworst", "stamp\np50", "\np99", "\nworst"),
    )
    kinds = _table(("topic", "type, QoS"))
    for topic in report.topics:
        name = escape(topic.topic)
        figures.add_row(
            name,
            f"{topic.count:,}",
            _number(topic.rate_hz),
            _number(topic.longest_gap_s, 3),
            _number(topic.longest_gap_at_s),
            "–" if topic.missing is None else str(topic.missing),
        )
        if topic.transport is not None or topic.stamp is not None:
            latencies.add_row(name, *_latency(topic.transport), *_latency(topic.stamp))
        qos = ", ".join(part for part in (topic.reliability, topic.durability) if part)
        # Below each other: the longest names fill a line of 80 columns.
        kinds.add_row(name, escape(f"{topic.type}\n{qos}".strip()))
    for table in (figures, latencies, kinds):
        if table.row_count:
            console.print()
            console.print(table)
    for warning in report.warnings:
        # Unbroken: some have a command to copy.
        console.print(f"[bold yellow]warning[/] {escape(warning)}", highlight=False, soft_wrap=True)


def _salvaged(report: SalvageReport) -> str:
    count, topics = report.metadata.message_count, len(report.metadata.topics)
    done = f"salvaged to {report.folder}: {count:,} messages of {topics} topics"
    return "\n".join((done, *report.missing))


def main(argv: list[str] | None = None) -> int:
    """Run the command; returns its exit code."""
    options = _parser().parse_args(argv)
    console = Console()
    known = console.is_terminal or "COLUMNS" in os.environ
    console.width = min(console.width, _WIDTH) if known else _WIDTH
    salvaged = None
    try:
        if options.salvage:
            salvaged = salvage(options.bag, options.salvage)
            report = inspect_bag(salvaged.folder)
            if not options.json:
                console.print(escape(_salvaged(salvaged)), highlight=False, soft_wrap=True)
        else:
            report = inspect_bag(options.bag, allow_damaged=True)
    except HriError as error:
        print(f"inspect_bag.py: {error}", file=sys.stderr)
        return 1
    if options.json:
        print(json.dumps(report.to_mapping(), indent=2))
    else:
        show(report, console)
    broken = bool(salvaged.missing) if salvaged else bool(report.damage) or not report.closed
    if broken and not report.messages:
        print(f"inspect_bag.py: no message of {options.bag} can be read", file=sys.stderr)
        return 1
    return 3 if broken and not salvaged else 0


if __name__ == "__main__":
    sys.exit(main())
