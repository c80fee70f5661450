"""Command line of ``scripts/benchmark_planners.py``."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.table import Table

from hri_prediction.errors import ConfigError
from hri_prediction.results.options import Scheduler, Workers, make_folders, resumable
from hri_prediction.results.origin import available_cores, origin_line, results_origin
from hri_prediction.results.progress import ProgressLine
from hri_sim.benchmark.conditions import CONDITIONS_A_TASK, SPLITS, TASKS, check_split
from hri_sim.benchmark.episode import SLOWDOWNS
from hri_sim.benchmark.execution import PAPER, check_execution
from hri_sim.benchmark.planners import DEFAULT_PLANNERS, ORACLE, PLANNERS, find_planners
from hri_sim.benchmark.realtime_report import REALTIME_TASKS, measure_planners, realtime_report
from hri_sim.benchmark.report import (
    SHARE_HEADS,
    plot_clearance,
    plot_success,
    report,
    share_text,
)
from hri_sim.benchmark.run import SMOKE_CONDITIONS, SMOKE_TASKS, Plan, run_benchmark
from hri_sim.benchmark.summary import by_task, summarise
from hri_sim.benchmark.variation import AS_DRAWN, PEOPLE, Variation

SEEDS = 5

app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)


def run_real_time(plan: Plan, out: Path, console: Console) -> dict[str, Any]:
    """Measure by the wall clock, and write ``realtime.json`` and ``realtime.md`` into ``out``.

    Raises:
        ConfigError: when the folder cannot be used, or no planner replans.
    """
    make_folders(out=out)
    with ProgressLine(console) as progress:
        progress.say("conditions")
        results = measure_planners(plan, progress.count)
    (out / "realtime.json").write_text(json.dumps(results, indent=1, allow_nan=False) + "\n")
    (out / "realtime.md").write_text(realtime_report(results))
    return results


def run_plan(
    plan: Plan, out: Path, workers: int, scheduler: str | None, console: Console
) -> dict[str, Any]:
    """Measure, and write ``results.json``, ``results.md``, ``run.json`` and the plots into ``out``.

    Raises:
        ConfigError: when the folder or the scheduler cannot be used.
        KeyboardInterrupt: after Ctrl-C; the rows that are done are kept.
    """
    make_folders(out=out)
    origin = results_origin()
    with ProgressLine(console) as progress:
        progress.say("tasks, each with one planner and seed")
        done = run_benchmark(
            plan, out / "rows.jsonl", workers=workers, scheduler=scheduler, progress=progress.count
        )
    results = summarise(plan, done)
    (out / "results.json").write_text(json.dumps(results, indent=1, allow_nan=False) + "\n")
    names = [setup.name for setup in plan.planners]
    outcomes = {
        name: [outcome for found in by_task(done, name).values() for outcome in found]
        for name in names
    }
    spent = {
        name: 1e3
        * sum(result.wall_s for unit, result in done.items() if unit.planner == name)
        / sum(len(result.outcomes) for unit, result in done.items() if unit.planner == name)
        for name in (*names, ORACLE)
    }
    run = {"origin": origin, "wall_ms_per_condition": {n: round(ms, 1) for n, ms in spent.items()}}
    (out / "run.json").write_text(json.dumps(run, indent=1) + "\n")
    times = ", ".join(f"`{name}` {ms:.0f} ms" for name, ms in spent.items())
    (out / "results.md").write_text(
        f"{report(results)}\nMade by `scripts/benchmark_planners.py`; one condition took {times} on one "
        f"core. {origin_line(origin)}\n"
    )
    plot_success(results["planners"], out / "success.png")
    plot_clearance(outcomes, out / "clearance.png")
    return results


def show(results: dict[str, Any], console: Console) -> None:
    """The headline figures as a table."""
    title = (
        f"{results['conditions']} {results['split']} conditions, {len(results['seeds'])} seed(s), "
        f"F = {results['budget']:g}"
    )
    if results["variation"] != AS_DRAWN.text:
        title += f", {results['variation']}"
    if results["execution"] != PAPER:
        title += f", executed in {results['execution']}"
    table = Table(title=title)
    for column in ("planner", *SHARE_HEADS.values(), "time to goal"):
        table.add_column(column, justify="left" if column == "planner" else "right")
    for name, found in results["planners"].items():
        time = found["time_to_goal_s"]
        shares = (share_text(found[key], found["ci95"][key], 0) for key in SHARE_HEADS)
        table.add_row(name, *shares, "–" if time is None else f"{time:.2f} s")
    console.print(table)
    feasible = share_text(results["oracle_feasible"], None)
    console.print(f"feasible with perfect prediction and a large budget: {feasible}")


def show_real_time(results: dict[str, Any], console: Console) -> None:
    """The headline figures in real time as a table."""
    table = Table(title=f"{results['conditions']} {results['split']} conditions in real time")
    for column in ("planner", "replan p50", "p99", "iteration p50", "p99", "missed"):
        table.add_column(column, justify="left" if column == "planner" else "right")
    for name, found in results["planners"].items():
        times = []
        for part, digits in (("replan_ms", 1), ("iteration_ms", 3)):
            spent = found[part] or {}
            times += [
                f"{spent[key]:.{digits}f} ms" if key in spent else "–" for key in ("p50", "p99")
            ]
        table.add_row(name, *times, share_text(found["missed_share"], None))
    console.print(table)


@app.command(context_settings={"help_option_names": ["-h", "--help"]})
def benchmark_planners(
    out: Annotated[Path, typer.Option(help="Folder for results.json, results.md, plots, rows.")],
    planners: Annotated[
        str, typer.Option(help=f"Some of {', '.join(PLANNERS)}, as in ptomp,nominal.")
    ] = ",".join(DEFAULT_PLANNERS),
    budget: Annotated[
        int,
        typer.Option(
            help="F: how many times slower than the reference the machine is in virtual time, one of "
            + ", ".join(map(str, SLOWDOWNS))
            + "."
        ),
    ] = SLOWDOWNS[0],
    seeds: Annotated[int, typer.Option(help="Number of seeds.", min=1)] = SEEDS,
    first_seed: Annotated[int, typer.Option(help="The first of them.", min=0)] = 0,
    split: Annotated[
        str, typer.Option(help=f"Tasks to run: {' or '.join(SPLITS)}. Never tune on test.")
    ] = "test",
    workers: Workers = None,
    scheduler: Scheduler = None,
    tracking_noise_mm: Annotated[
        float | None,
        typer.Option(help="Tracking noise, SD of a coordinate (drawn with 2).", show_default=False),
    ] = None,
    latency_ms: Annotated[
        float | None,
        typer.Option(help="Capture to delivery of a sample (drawn with 8).", show_default=False),
    ] = None,
    person_speed: Annotated[
        float,
        typer.Option(help="The person is so many times as fast as the predictor has learnt."),
    ] = AS_DRAWN.person_speed,
    person: Annotated[
        str, typer.Option(help=f"What the person does in mid-reach: {', '.join(PEOPLE)}.")
    ] = AS_DRAWN.person,
    execute: Annotated[
        str,
        typer.Option(
            help="What makes motions of plans: paper (exactly) or mujoco (simulated controller and arm)."
        ),
    ] = PAPER,
    real_time: Annotated[
        bool,
        typer.Option(
            "--real-time",
            help="Instead: what replans take by the clock of this machine, in ten conditions a seed. Leave "
            "the machine alone meanwhile.",
        ),
    ] = False,
    tasks: Annotated[
        int | None,
        typer.Option(
            help="Fewer tasks, from the first.", min=1, max=TASKS, show_default=f"{TASKS}"
        ),
    ] = None,
    conditions: Annotated[
        int | None,
        typer.Option(
            help="Fewer conditions of each, from the first.",
            min=1,
            max=CONDITIONS_A_TASK,
            show_default=f"{CONDITIONS_A_TASK}",
        ),
    ] = None,
    smoke: Annotated[
        bool, typer.Option("--smoke", help="Two conditions of two tasks, one seed (seconds).")
    ] = False,
) -> None:
    """Let planners reach past a person in 450 conditions and count how often that goes well.

    In virtual time: the same seeds give the same results.json, whoever does the work. A benchmark that
    was broken off goes on where it stopped. Conditions can be varied, for planners that do not know of it.
    """
    console = Console()
    check_split(split)
    if budget not in SLOWDOWNS:
        raise ConfigError(f"--budget {budget}", expected="one of " + ", ".join(map(str, SLOWDOWNS)))
    check_execution(execute)
    names = tuple(name.strip() for name in planners.split(",") if name.strip())
    plan = Plan(
        find_planners(names),
        split,
        float(budget),
        tuple(range(first_seed, first_seed + seeds)),
        tuple(range(tasks or TASKS)),
        conditions or CONDITIONS_A_TASK,
        variation=Variation(tracking_noise_mm, latency_ms, person_speed, person),
        execution=execute,
    )
    if (smoke or real_time) and (tasks or conditions):
        raise ConfigError(
            "--tasks or --conditions with --smoke or --real-time",
            expected="one or the other: the latter have their own",
        )
    if real_time:
        if budget != SLOWDOWNS[0] or workers not in (None, 1) or scheduler is not None:
            raise ConfigError(
                "--real-time with --budget, --workers or --scheduler",
                expected="none of them: it runs in one process, as fast as this machine is",
            )
        plan = replace(plan, tasks=REALTIME_TASKS, conditions=1)
    if smoke:
        plan = replace(plan, seeds=(first_seed,), tasks=SMOKE_TASKS, conditions=SMOKE_CONDITIONS)
    if real_time:
        try:
            figures = run_real_time(plan, out, console)
        except KeyboardInterrupt:
            console.print("stopped; nothing was written")
            raise typer.Exit(130) from None
        show_real_time(figures, console)
        console.print(f"results: {out / 'realtime.json'}", highlight=False, soft_wrap=True)
        return
    with resumable(console, out):
        results = run_plan(plan, out, workers or available_cores(), scheduler, console)
    show(results, console)
    console.print(f"results: {out / 'results.json'}", highlight=False, soft_wrap=True)


def main() -> int:
    """Entry point."""
    app(prog_name="benchmark_planners.py")
    return 0
