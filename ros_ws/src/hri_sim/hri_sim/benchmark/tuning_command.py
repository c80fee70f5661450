"""Command line of ``scripts/tune_planners.py``."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console

from hri_prediction.results.options import Scheduler, Workers, make_folders, resumable
from hri_prediction.results.origin import available_cores, origin_line, results_origin
from hri_prediction.results.progress import ProgressLine
from hri_sim.benchmark.run import run_benchmark
from hri_sim.benchmark.summary import summarise
from hri_sim.benchmark.tuning import CONDITIONS, GRIDS, SLOWDOWNS, Grid, plans, rows, table

RESULTS = Path("docs/results")
ROWS, SMOKE_ROWS = Path("runs/tuning"), Path("runs/smoke_tuning")

app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)


def _text(content: dict[str, Any]) -> str:
    parts = [
        "# Margins of the planners, tuned\n",
        f"Nine cells each; the first {CONDITIONS} conditions of each of the 30 tuning tasks, seed "
        f"{content['seed']}, F = {' and '.join(f'{slow:g}' for slow in SLOWDOWNS)}. The best cell stands "
        "first: by the mean share of motions with 2 cm and more, then with 5 cm and more, then by time.\n",
    ]
    for name, found in content["planners"].items():
        parts += [f"## `{name}`\n", table(found["cells"])]
    parts.append(f"Made by `scripts/tune_planners.py`. {origin_line(content['origin'])}\n")
    return "\n".join(parts)


def _tune(
    grid: Grid, seed: int, smoke: bool, path: Path, workers: int, scheduler: str | None,
    progress: ProgressLine,
) -> dict[str, Any]:  # fmt: skip
    results = {}
    for slow, plan in plans(grid, seed=seed, smoke=smoke).items():
        progress.say(f"{grid.planner}, F = {slow:g}")
        done = run_benchmark(
            plan, path, workers=workers, scheduler=scheduler, progress=progress.count
        )
        results[slow] = summarise(plan, done)
    return {"setting": grid.setting, "cells": rows(results)}


@app.command(context_settings={"help_option_names": ["-h", "--help"]})
def tune_planners(
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder for tuning.md and tuning.json. Default: docs/results; smoke: --rows."
        ),
    ] = None,
    rows_folder: Annotated[
        Path | None,
        typer.Option(
            "--rows",
            help="Folder of work that is done, which is not done again. Default: runs/tuning; smoke: "
            "runs/smoke_tuning.",
        ),
    ] = None,
    seed: Annotated[int, typer.Option(help="Of noise.", min=0)] = 0,
    workers: Workers = None,
    scheduler: Scheduler = None,
    smoke: Annotated[
        bool, typer.Option("--smoke", help="Two cells and conditions a planner (half a minute).")
    ] = False,
) -> None:
    """Try nine pairs of margins of each planner on the tuning tasks, for PTOMP as for its peers.

    Nothing is changed: hri_planner/config/ptomp.yaml and variants.yaml say what planners ship with.
    """
    console = Console()
    rows_folder = rows_folder or (SMOKE_ROWS if smoke else ROWS)
    out = out or (rows_folder if smoke else RESULTS)
    make_folders(rows=rows_folder, out=out)
    count = workers or available_cores()
    with resumable(console, rows_folder), ProgressLine(console) as progress:
        found = {
            grid.planner: _tune(
                grid, seed, smoke, rows_folder / "rows.jsonl", count, scheduler, progress
            )
            for grid in GRIDS
        }
    content = {"origin": results_origin(), "smoke": smoke, "seed": seed, "planners": found}
    (out / "tuning.json").write_text(json.dumps(content, indent=1, allow_nan=False) + "\n")
    (out / "tuning.md").write_text(_text(content))
    for name, one in found.items():
        console.print(f"{name}: best {one['cells'][0]['cell'].split(': ', 1)[1]}", highlight=False)
    console.print(f"table: {out / 'tuning.md'}", highlight=False, soft_wrap=True)


def main() -> int:
    """Entry point."""
    app(prog_name="tune_planners.py")
    return 0
