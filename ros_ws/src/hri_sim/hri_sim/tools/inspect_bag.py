"""What is in a bag, whether it is whole, and recovery of one whose recorder was killed."""

from __future__ import annotations

import argparse
import json
import math
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
        description="Show what a bag holds: topics, rates, gaps, latencies, provenance. Also reads "
        "bags whose recorder was killed, and makes proper bags of them.",
        epilog="Exit codes: 0 the bag is whole, 1 it cannot be read, 2 wrong arguments, "
        "3 it can be read but was not closed (not with --salvage).",
    )
    parser.add_argument("bag", help="bag folder, or an .mcap file")
    parser.add_argument("--salvage", metavar="OUT", help="recover all whole messages to a new bag")
    parser.add_argument("--json", action="store_true", help="print the report as JSON")
    return parser


def _number(value: float, unit: float = 1.0, digits: int = 1) -> str:
    return "–" if not math.isfinite(value) else f"{value * unit:,.{digits}f}"


def _latency(value: Latency | None) -> str:
    if value is None:
        return "–"
    return f"{value.p50 * 1e3:.2f} / {value.p99 * 1e3:.2f} / {value.worst * 1e3:.1f}"


def show(report: BagReport, console: Console) -> None:
    """Print a report for people."""
    start = datetime.fromtimestamp(report.start_ns * 1e-9, tz=UTC)
    state = "closed in order" if report.closed else "[bold red]NOT CLOSED[/]"
    console.print(f"[bold]{escape(report.path)}[/]: {state}", highlight=False)
    files = ", ".join(f"{name} ({size / 1e6:.2f} MB)" for name, size in report.files.items())
    console.print(f"  files     {escape(files)}", highlight=False)
    console.print(f"  start     {start:%Y-%m-%d %H:%M:%S.%f} UTC", highlight=False)
    console.print(f"  duration  {report.duration_s:.3f} s", highlight=False)
    console.print(f"  messages  {report.messages:,}", highlight=False)
    for key, value in report.custom_data.items():
        console.print(f"  {escape(key):9} {escape(value)}", highlight=False)
    for name, size in report.attachments.items():
        console.print(f"  attached  {escape(name)} ({size} bytes)", highlight=False)
    table = Table(box=None, pad_edge=False, header_style="bold")
    table.add_column("topic", overflow="fold")
    table.add_column("type", overflow="fold")
    for name in ("count", "rate [Hz]", "longest gap [s]", "missing"):
        table.add_column(name, justify="right")
    table.add_column("QoS")
    table.add_column("sending to receipt [ms]\np50 / p99 / worst", justify="right")
    table.add_column("stamp to receipt [ms]\np50 / p99 / worst", justify="right")
    for topic in report.topics:
        table.add_row(
            escape(topic.topic),
            topic.type,
            f"{topic.count:,}",
            _number(topic.rate_hz),
            f"{_number(topic.longest_gap_s, digits=3)} at {_number(topic.longest_gap_at_s)}"
            if topic.count > 1
            else "–",
            "–" if topic.missing is None else str(topic.missing),
            ", ".join(part for part in (topic.reliability, topic.durability) if part) or "–",
            _latency(topic.transport),
            _latency(topic.stamp),
        )
    console.print(table)
    for warning in report.warnings:
        console.print(f"[bold yellow]warning[/] {escape(warning)}", highlight=False)


def _salvaged(report: SalvageReport) -> str:
    parts = [f"{report.metadata.message_count:,} messages of {len(report.metadata.topics)} topics"]
    if report.partial_messages:
        parts.append(f"{report.partial_messages} of them from a chunk that is cut")
    if report.damaged_chunks:
        parts.append(f"{report.damaged_chunks} damaged chunks passed over")
    if report.unread_bytes:
        parts.append(f"{report.unread_bytes} bytes at the end are no whole record")
    return f"salvaged to {report.folder}: " + ", ".join(parts)


def main(argv: list[str] | None = None) -> int:
    """Run the command; returns its exit code."""
    options = _parser().parse_args(argv)
    # Piped output is as wide as it needs to be, for grep.
    console = Console() if sys.stdout.isatty() else Console(width=240)
    try:
        if options.salvage:
            salvaged = salvage(options.bag, options.salvage)
            report = inspect_bag(salvaged.folder)
            if not options.json:
                console.print(escape(_salvaged(salvaged)), highlight=False)
        else:
            report = inspect_bag(options.bag)
    except HriError as error:
        print(f"inspect_bag.py: {error}", file=sys.stderr)
        return 1
    if options.json:
        print(json.dumps(report.to_mapping(), indent=2))
    else:
        show(report, console)
    return 0 if report.closed else 3


if __name__ == "__main__":
    sys.exit(main())
