"""Command line of ``scripts/reproduce_ptomp.py``: every table and picture of the planner."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console

from hri_prediction.results.options import Scheduler, Workers, make_folders, resumable
from hri_prediction.results.origin import available_cores, results_origin
from hri_prediction.results.progress import ProgressLine
from hri_sim.benchmark.report import SHARE_HEADS, share_text
from hri_sim.benchmark.run import Plan, run_benchmark
from hri_sim.benchmark.summary import summarise
from hri_sim.reproduction import failures, leads, pictures, starts, surfaces
from hri_sim.reproduction.bars import BARS, bar_texts, judge, verdict
from hri_sim.reproduction.closer import Item, Look, look_at_all
from hri_sim.reproduction.elsewhere import judge_elsewhere
from hri_sim.reproduction.report import report
from hri_sim.reproduction.scenes import first_moving
from hri_sim.reproduction.section import Measured, Scope
from hri_sim.reproduction.sections import HEADLINE, LEADS, SECTIONS
from hri_sim.reproduction.times import times

SEEDS = 5
RESULTS = Path("docs/results")
ROWS, SMOKE_ROWS = Path("runs/ptomp"), Path("runs/smoke_ptomp")

app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)


class Laboratory:
    """Does the work and keeps what is done.

    Args:
        rows: Folder of what is done.
        workers: Processes on this machine.
        scheduler: Address of a Dask scheduler instead.
        progress: Says how far it is.
    """

    def __init__(
        self, rows: Path, workers: int, scheduler: str | None, progress: ProgressLine
    ) -> None:
        self._rows = rows
        self._workers = workers
        self._scheduler = scheduler
        self._progress = progress

    def measure(self, name: str, plan: Plan) -> Measured:
        """Carry out a plan; work that another plan has in common with it is done once."""
        self._progress.say(name)
        done = run_benchmark(
            plan,
            self._rows / "rows.jsonl",
            workers=self._workers,
            scheduler=self._scheduler,
            progress=self._progress.count,
        )
        return Measured(plan, done, summarise(plan, done))

    def look(self, name: str, items: list[Item]) -> list[Look]:
        """Look closely at conditions."""
        self._progress.say(name)
        return look_at_all(
            items,
            self._rows / "looks.jsonl",
            workers=self._workers,
            scheduler=self._scheduler,
            progress=self._progress.count,
        )

    def say(self, text: str) -> None:
        """What is done meanwhile."""
        self._progress.say(text)


def reproduce(scope: Scope, out: Path, laboratory: Laboratory) -> dict[str, Any]:
    """Measure everything, and write ``ptomp.json``, ``ptomp.md`` and the pictures.

    Returns:
        The content of ``ptomp.json``.
    """
    origin = results_origin()
    measured = {
        section.name: {
            name: laboratory.measure(f"{section.name} {name}", plan)
            for name, plan in section.plans(scope).items()
        }
        for section in SECTIONS
    }
    by_slowdown = {one.plan.slowdown: one for one in measured[HEADLINE.name].values()}
    reference = by_slowdown[1.0]
    failed = [item for one in by_slowdown.values() for item in failures.failed_items(one)]
    seen = laboratory.look("failures", failed)
    grid = surfaces.Grid(first_moving(), scope)
    costs = grid.surfaces(laboratory.look("cost surfaces", grid.items))
    laboratory.say("pictures")
    drawn = pictures.draw_all(out / pictures.FOLDER, grid, costs, reference)
    content = {
        "origin": origin,
        "smoke": scope.smoke,
        "seeds": list(reference.plan.seeds),
        "bars": [*(judge(bar, by_slowdown) for bar in BARS), *judge_elsewhere(RESULTS)],
        "leads": {
            f"{one.plan.slowdown:g}": leads.leads(one) for one in measured[LEADS.name].values()
        },
        "starts": {f"{slow:g}": starts.starts(one.plan) for slow, one in by_slowdown.items()},
        "sections": {
            section: {name: one.results for name, one in found.items()}
            for section, found in measured.items()
        },
        "failures": [
            failures.Failure(item, one).figures() for item, one in zip(failed, seen, strict=True)
        ],
        "surfaces": {
            "time_steps": grid.time_steps,
            "rollouts": grid.rollouts,
            "slowdown": surfaces.SLOWDOWN,
            **costs,
        },
        "pictures": drawn,
        "times": times(one for found in measured.values() for one in found.values()),
    }
    (out / "ptomp.json").write_text(json.dumps(content, allow_nan=False) + "\n")
    (out / "ptomp.md").write_text(report(content, measured))
    return content


def show(content: dict[str, Any], console: Console) -> None:
    """Bars and headline figures, as plain lines."""
    lines = [
        f"{verdict(bar):<12}  {bar['what']}: {', wanted '.join(bar_texts(bar))}"
        for bar in content["bars"]
    ]
    for section, plans in content["sections"].items():
        for name, results in plans.items():
            lines.append(f"{section} {name}: {', '.join(SHARE_HEADS.values())}")
            for planner, found in results["planners"].items():
                shares = "  ".join(share_text(found[key], None) for key in SHARE_HEADS)
                lines.append(f"  {planner:<18} {shares}")
    console.print("\n".join(lines), highlight=False, markup=False, soft_wrap=True)


@app.command(context_settings={"help_option_names": ["-h", "--help"]})
def reproduce_ptomp(
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder for ptomp.md, ptomp.json and ptomp/*.png. Default: docs/results; smoke: --rows."
        ),
    ] = None,
    rows: Annotated[
        Path | None,
        typer.Option(
            help="Folder of work that is done, which is not done again. Default: runs/ptomp; smoke: "
            "runs/smoke_ptomp."
        ),
    ] = None,
    seeds: Annotated[int, typer.Option(help="Number of seeds.", min=1)] = SEEDS,
    first_seed: Annotated[int, typer.Option(help="The first of them.", min=0)] = 0,
    workers: Workers = None,
    scheduler: Scheduler = None,
    smoke: Annotated[
        bool, typer.Option("--smoke", help="One condition of two tasks, one seed (half a minute).")
    ] = False,
) -> None:
    """Measure the planners in the test conditions and make all tables and pictures again.

    In virtual time, so that figures do not depend on the machine's load. What was broken off goes on
    where it stopped.
    """
    console = Console()
    rows = rows or (SMOKE_ROWS if smoke else ROWS)
    out = out or (rows if smoke else RESULTS)
    make_folders(rows=rows, out=out)
    scope = Scope(tuple(range(first_seed, first_seed + (1 if smoke else seeds))), smoke)
    with resumable(console, rows), ProgressLine(console) as progress:
        laboratory = Laboratory(rows, workers or available_cores(), scheduler, progress)
        content = reproduce(scope, out, laboratory)
    show(content, console)
    console.print(f"table: {out / 'ptomp.md'}", highlight=False, soft_wrap=True)


def main() -> int:
    """Entry point."""
    app(prog_name="reproduce_ptomp.py")
    return 0
