"""Command line of ``scripts/soak.py``: the whole graph for a long time, with faults, and a report of it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer
from rich.box import SIMPLE
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from hri_planner.separation.config import MEASURED
from hri_prediction.errors import HriError
from hri_sim.launch.options import Seed, default_folder, one_of
from hri_sim.launch.separation import SEPARATIONS, Separation
from hri_sim.launch.soak_run import SoakOptions, run_soak
from hri_sim.launch.telling import explain
from hri_sim.soak.faults import ALL, GROUPS, NONE
from hri_sim.soak.judging import missed, verdict
from hri_sim.soak.log import LOG
from hri_sim.soak.report import (
    BAR_HEAD,
    FAULT_HEAD,
    MEMORY_HEAD,
    PICTURE,
    TEXT,
    bar_rows,
    fault_table,
    memory_table,
    write_report,
)

WHOLE = ("fault", "node", "process")
"""Columns that are not folded but at underscores: the tables are for 80 columns."""
SMOKE_MINUTES, SMOKE_WAIT_S = 2.0, 3.0

app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)


def print_report(console: Console, content: dict[str, Any]) -> None:
    """The tables of a report."""
    for title, head, rows in (
        ("Memory", MEMORY_HEAD, memory_table(content)),
        ("Faults", FAULT_HEAD, fault_table(content)),
        ("What is wanted", BAR_HEAD, bar_rows(content)),
    ):
        table = Table(
            title=title, title_justify="left", box=SIMPLE, padding=(0, 1, 0, 0), show_edge=False
        )
        for name in head:
            table.add_column(
                escape(name.replace(" [", "\n[")), overflow="fold", no_wrap=name in WHOLE
            )
        for row in rows:
            table.add_row(*(escape(cell.replace("*", "").replace("_", "_\n")) for cell in row))
        console.print(table)
        console.print()
    files = content["files"]
    console.print(f"bags: {files['total_mb']:.1f} MB", highlight=False)
    console.print(verdict(content), highlight=False, markup=False, soft_wrap=True)


def _report(folder: Path, console: Console) -> dict[str, Any]:
    content = write_report(folder)
    print_report(console, content)
    for name in (LOG, TEXT, PICTURE):
        console.print(str(folder / name), highlight=False, markup=False, soft_wrap=True)
    return content


@app.command(context_settings={"help_option_names": ["-h", "--help"]})
def soak(
    minutes: Annotated[float, typer.Option(help="For how long.", min=0.5, max=10_000.0)] = 60.0,
    faults: Annotated[
        str,
        typer.Option(
            help=f"Which faults come: {ALL}, {NONE}, or some of {', '.join(GROUPS)} with commas between "
            "them. Nodes are killed in the first half of the time alone, so that all get old in the other."
        ),
    ] = ALL,
    every: Annotated[
        float,
        typer.Option(help="Mean time from the end of a fault to the next [s].", min=0.1),
    ] = 20.0,
    seed: Seed = 0,
    separation: Separation = MEASURED,
    out: Annotated[
        Path | None, typer.Option(help="Folder of the run. Default: runs/soak_<time>.")
    ] = None,
    report: Annotated[
        Path | None,
        typer.Option(
            help="Only make the report of the run in this folder anew, from its soak.jsonl."
        ),
    ] = None,
    smoke: Annotated[
        bool,
        typer.Option("--smoke", help=f"{SMOKE_MINUTES:g} minutes with a fault every few seconds."),
    ] = False,
) -> None:
    """Run the whole graph for a long time, with goals and faults that are drawn by the seed.

    Memory, latency and file sizes are noted each second in soak.jsonl; soak.json, soak.md and soak.png are
    made of that at the end, also when the run is broken off. Exit code 0: all that could be judged is met,
    and what could not be is named; 3: something is missed (the table says), as is growth that could not be
    judged in five minutes; 1: something went wrong; 130 after Ctrl-C, 143 after SIGTERM.
    """
    console = Console()
    if report is not None:
        raise typer.Exit(3 if missed(_report(report, console)) else 0)
    options = SoakOptions(
        out=out or default_folder("soak"),
        minutes=SMOKE_MINUTES if smoke else minutes,
        seed=seed,
        faults=faults,
        mean_wait_s=SMOKE_WAIT_S if smoke else every,
        separation=one_of("separation", separation, SEPARATIONS),
    )
    # The folder of another run, which is refused, is left as it is.
    others = (options.out / LOG).exists()
    try:
        run_soak(options, console)
    except (HriError, OSError) as error:
        explain(error, console)
        if not others:
            _report_if_any(options.out, console)
        raise typer.Exit(1) from error
    except KeyboardInterrupt:
        _report_if_any(options.out, console)
        raise typer.Exit(130) from None
    except SystemExit:
        _report_if_any(options.out, console)
        raise
    raise typer.Exit(3 if missed(_report(options.out, console)) else 0)


def _report_if_any(folder: Path, console: Console) -> None:
    """The report of a run that was broken off, if it had begun."""
    if (folder / LOG).exists():
        _report(folder, console)


def main() -> int:
    """Entry point."""
    app(prog_name="soak.py")
    return 0
