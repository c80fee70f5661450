"""Command line of ``scripts/train_adaptation.py``."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console

from hri_planner.adaptation.model_file import save_model
from hri_planner.adaptation.origin import planner_hash, trained_for_another, warning
from hri_prediction.errors import ConfigError
from hri_prediction.extras import check_scikit_learn
from hri_prediction.results.options import Scheduler, Workers, make_folders, resumable
from hri_prediction.results.origin import available_cores, origin_line, results_origin
from hri_prediction.results.progress import ProgressLine
from hri_sim.adaptation.design import Design, Job
from hri_sim.adaptation.evaluation import chosen_jobs, evaluate, report
from hri_sim.adaptation.samples import Sample, gather
from hri_sim.adaptation.training import train
from hri_sim.benchmark.adapted import TRAINED_AT
from hri_sim.benchmark.conditions import CONDITIONS_A_TASK, TASKS
from hri_sim.benchmark.episode import SLOWDOWNS
from hri_sim.benchmark.rows import Unit

SEEDS = 5
SMOKE_TASKS = (0, 4, 5)
MIN_TASKS = 4
"""One is held out; of three, two are left to learn from when the labels of one are checked."""

app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)


def run_design(
    design: Design, out: Path, workers: int, scheduler: str | None, console: Console
) -> dict[str, Any]:
    """Simulate, train and evaluate; writes models, ``results.json`` and ``results.md`` into ``out``.

    Raises:
        ConfigError: when the folder or the scheduler cannot be used, or scikit-learn is missing.
        KeyboardInterrupt: after Ctrl-C; what is simulated is kept.
    """
    check_scikit_learn()
    make_folders(out=out)
    origin = results_origin()
    with ProgressLine(console) as progress:

        def simulate(text: str, jobs: list[Job]) -> dict[Unit, tuple[Sample, ...]]:
            progress.say(text)
            return gather(
                design.slowdown,
                jobs,
                out / "rows.jsonl",
                workers=workers,
                scheduler=scheduler,
                progress=progress.count,
            )

        samples = simulate("simulating", [*design.random_jobs(), *design.grid_jobs()])
        progress.say("training")
        models, errors = train(design, samples)
        chosen = simulate("simulating what models choose", chosen_jobs(design, samples, models))
    results = evaluate(design, samples, models, errors, chosen)
    budget = f"f{design.slowdown:g}"
    trained = {
        "budget": design.slowdown,
        "tasks": list(design.learnt),
        "motions": results["motions"]["learnt"],
        "command": _command(design),
        "planner": planner_hash(),
        "origin": origin,
    }
    for name, model in models.by_name.items():
        save_model(out / f"{name}_{budget}.npz", model, trained)
    (out / f"adaptation_{budget}.json").write_text(json.dumps(trained, indent=1) + "\n")
    (out / "results.json").write_text(json.dumps(results, indent=1, allow_nan=False) + "\n")
    made = f"Made by `{trained['command']}`. {origin_line(origin)}\n"
    (out / "results.md").write_text(f"{report(results)}\n{made}")
    return results


def _command(design: Design) -> str:
    """What the user gave, or might have."""
    if design.grid_step > 1:
        return f"scripts/train_adaptation.py --smoke --budget {design.slowdown:g}"
    return (
        f"scripts/train_adaptation.py --budget {design.slowdown:g} --tasks {len(design.tasks)} "
        f"--conditions {design.conditions} --grid-conditions {design.grid_conditions} "
        f"--seeds {len(design.seeds)} --first-seed {design.seeds[0]}"
    )


@app.command(context_settings={"help_option_names": ["-h", "--help"]})
def train_adaptation(
    out: Annotated[Path, typer.Option(help="Folder for models, results.json, results.md, rows.")],
    budget: Annotated[
        int,
        typer.Option(
            help="F: how many times slower than the reference the machine is in virtual time, one of "
            + ", ".join(map(str, SLOWDOWNS))
            + "."
        ),
    ] = TRAINED_AT,
    conditions: Annotated[
        int,
        typer.Option(
            help="Conditions of each tuning task that get random cells.",
            min=1,
            max=CONDITIONS_A_TASK,
        ),
    ] = CONDITIONS_A_TASK,
    tasks: Annotated[
        int,
        typer.Option(
            help="Tuning tasks, from the first; every fifth is held out.", min=MIN_TASKS, max=TASKS
        ),
    ] = TASKS,
    grid_conditions: Annotated[
        int,
        typer.Option(
            help="Conditions of each, but of those held out, that get all 132 cells, for Algorithm 1.",
            min=1,
            max=CONDITIONS_A_TASK,
        ),
    ] = 5,
    seeds: Annotated[int, typer.Option(help="Number of seeds.", min=1)] = SEEDS,
    first_seed: Annotated[int, typer.Option(help="The first of them.", min=0)] = 0,
    workers: Workers = None,
    scheduler: Scheduler = None,
    smoke: Annotated[
        bool, typer.Option("--smoke", help="Three tasks, one seed, nine cells (half a minute).")
    ] = False,
) -> None:
    """Learn from simulated motions which time steps and roll-outs suit which situation.

    Trains the thesis' Gaussian processes on Algorithm 1's labels, a model of the chance of success, and
    the best fixed cell, and tries all of them in tasks that none has learnt from. Training that was broken
    off goes on where it stopped.
    """
    console = Console()
    if budget not in SLOWDOWNS:
        raise ConfigError(f"--budget {budget}", expected="one of " + ", ".join(map(str, SLOWDOWNS)))
    design = Design(
        float(budget),
        tuple(range(first_seed, first_seed + seeds)),
        grid_conditions,
        conditions,
        tasks=tuple(range(tasks)),
    )
    if smoke:
        design = replace(
            design,
            seeds=(first_seed,),
            grid_conditions=2,
            conditions=2,
            tasks=SMOKE_TASKS,
            grid_step=5,
        )
    with resumable(console, out):
        results = run_design(design, out, workers or available_cores(), scheduler, console)
    for name, row in results["planners"].items():
        console.print(
            f"{name:10} ok {100 * row['ok']:.1f} %, 5 cm clear {100 * row['success']:.1f} % of "
            f"{row['motions']}, mean TS "
            f"{row['num_timesteps']:.0f}, NT {row['num_rollouts']:.0f}",
            highlight=False,
        )
    console.print(f"results: {out / 'results.md'}", highlight=False, soft_wrap=True)
    if outdated := trained_for_another():
        console.print(f"models that ship: {warning(outdated)}", highlight=False, soft_wrap=True)


def main() -> int:
    """Entry point."""
    app(prog_name="train_adaptation.py")
    return 0
