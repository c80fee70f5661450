"""Command line of ``scripts/evaluate_prediction.py``."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console
from rich.table import Table

from hri_prediction.config import load_yaml
from hri_prediction.errors import ConfigError
from hri_prediction.evaluation.folds import (
    LEAVE_ONE_OUT,
    NEW_TASK,
    PROTOCOLS,
    WITHIN,
    Settings,
)
from hri_prediction.evaluation.plots import plot_calibration, plot_errors, plot_tubes
from hri_prediction.evaluation.recordings import (
    Recording,
    load_recordings,
    make_recording,
    reduced,
)
from hri_prediction.evaluation.report import evaluation_report, figure
from hri_prediction.evaluation.run import evaluate, has_reference
from hri_prediction.prediction.config import PredictorConfig
from hri_prediction.prediction.training import TASK_FIELDS
from hri_prediction.results.origin import available_cores, origin_line, results_origin
from hri_prediction.results.progress import ProgressLine
from hri_prediction.tracks.segmentation import SegmentationConfig
from hri_sim.people.population import FAMILIES, population

SIMULATED = "simulated"
AUTO = "auto"
PEOPLE, REPETITIONS = 5, 5
"""Simulated persons of a family, and reaches of each to every target."""
SMOKE_PEOPLE, SMOKE_TRIALS = 2, 2

app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)


@dataclass(frozen=True)
class Job:
    """One evaluation.

    Attributes:
        data: ``simulated``, or a track file or bag.
        people: Family of the simulated people.
        protocol: Who learns from whom.
        observed: Shares of the reaches that are seen.
        config: Settings of the predictor.
        task_from: What names a task; ``auto``: the tracks' tasks, or where reaches start and end if
            the tracks name none.
        seed: Seed of the simulated people, and of which reaches the plots show.
        smoke: Few people and reaches only.
    """

    data: str
    people: str
    protocol: str
    observed: tuple[float, ...]
    config: PredictorConfig
    task_from: str
    seed: int
    smoke: bool


def parse_shares(text: str) -> tuple[float, ...]:
    """Observed shares of a list like ``0.1,0.3``, sorted.

    Raises:
        ConfigError: when one is no number between 0 and 1, or appears twice.
    """
    try:
        shares = sorted(float(part) for part in text.split(","))
    except ValueError:
        shares = []
    if not shares or len(set(shares)) < len(shares) or not all(0.0 < s < 1.0 for s in shares):
        raise ConfigError(
            f"--observed {text}", expected="shares between 0 and 1, as in 0.3 or 0.1,0.2,0.3"
        )
    return tuple(shares)


def simulated_recordings(
    people: str, seed: int, segmentation: SegmentationConfig, *, smoke: bool
) -> list[Recording]:
    """Simulated people; those who do not match what is learnt come with matched ones to learn from."""
    count, repetitions = (SMOKE_PEOPLE, SMOKE_TRIALS) if smoke else (PEOPLE, REPETITIONS)
    families = ("matched",) if people == "matched" else ("matched", people)
    return [
        make_recording(
            reach.track,
            segmentation,
            [reach.truth],
            teaches=family == "matched",
            judged=family == people,
        )
        for family in families
        for reach in population(family, count, repetitions, seed)
    ]


def read_data(job: Job) -> tuple[list[Recording], str]:
    """The recordings of a job and what names their tasks.

    Raises:
        DataError: when the file cannot be read or holds no reach.
    """
    segmentation = job.config.segmentation
    if job.data == SIMULATED:
        recordings = simulated_recordings(job.people, job.seed, segmentation, smoke=job.smoke)
    else:
        recordings = load_recordings(job.data, segmentation)
        if job.smoke:
            recordings = reduced(recordings, SMOKE_PEOPLE, SMOKE_TRIALS)
    named = all(r.track.task for r in recordings)
    group_by = job.task_from if job.task_from != AUTO else "task" if named else "movement"
    return recordings, group_by


def run_job(job: Job, out: Path, workers: int, console: Console) -> dict[str, Any]:
    """Evaluate, and write ``results.json``, ``results.md`` and the plots into ``out``.

    Raises:
        HriError: when data or settings are unusable.
        KeyboardInterrupt: after Ctrl-C; the folds that are done are kept.
    """
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ConfigError(
            f"cannot make --out {out}: {error.strerror}", hint="choose another with --out"
        ) from error
    origin = results_origin()
    with ProgressLine(console) as progress:
        progress.say("reading")
        recordings, group_by = read_data(job)
        settings = Settings(job.protocol, job.observed, job.config, group_by, has_reference())
        progress.say("folds")
        evaluation = evaluate(
            recordings,
            settings,
            out / "folds",
            workers=workers,
            progress=progress.count,
        )
    name = job.data if job.data == SIMULATED else Path(job.data).name
    results = {
        "data": name,
        **({"people": job.people} if job.data == SIMULATED else {}),
        "subjects": len({r.track.subject for r in recordings if r.judged}),
        **evaluation.summary(),
        "durations_from": next(r.durations_from for r in recordings if r.judged),
        "task_from": group_by,
        "seed": job.seed,
        "smoke": job.smoke,
        "origin": origin,
    }
    (out / "results.json").write_text(json.dumps(results, indent=1, allow_nan=False) + "\n")
    text = evaluation_report(results)
    smoke = " --smoke" if job.smoke else ""
    (out / "results.md").write_text(
        f"{text}\nMade by `scripts/evaluate_prediction.py{smoke}`. {origin_line(origin)}\n"
    )
    plot_errors(evaluation, out / "error.png")
    plot_calibration(evaluation, out / "calibration.png")
    plot_tubes(evaluation, recordings, out / "tubes.png", np.random.default_rng(job.seed))
    return results


def show(results: dict[str, Any], console: Console) -> None:
    """The headline figures as a table."""
    share = f"{100.0 * results['observed']:g} %"
    table = Table(
        title=f"{results['data']}, {results['protocol']}: {results['n']} reaches, after {share}"
    )
    for column in (
        "predictor",
        "end point: median",
        "mean",
        "95th pct.",
        "50 %",
        "95 %",
        "NLL",
        "µs",
    ):
        table.add_column(column, justify="left" if column == "predictor" else "right")
    for name, found in results["predictors"].items():
        end = found["endpoint_error_m"]
        table.add_row(
            name,
            *(figure(end[key], ".1f", 1e3) + " mm" for key in ("median", "mean", "p95")),
            figure(found["coverage50"], ".0f", 100.0) + " %",
            figure(found["coverage95"], ".0f", 100.0) + " %",
            figure(found["nll"], ".2f"),
            figure(found["latency_us"], ".0f"),
        )
    console.print(table)
    for line in results["skipped"]:
        console.print(f"skipped: {line}", highlight=False, markup=False)


def check_choice(option: str, value: str, choices: Sequence[str]) -> None:
    """Refuse a value that is none of the choices.

    Raises:
        ConfigError: naming the option and the choices.
    """
    if value not in choices:
        raise ConfigError(f"{option} {value}", expected="one of " + ", ".join(choices))


@app.command(context_settings={"help_option_names": ["-h", "--help"]})
def evaluate_prediction(
    out: Annotated[Path, typer.Option(help="Folder for results.json, results.md, plots, folds.")],
    data: Annotated[
        str,
        typer.Option(help="simulated, or a FILE: a track file, a bag, or ADL Vicon's reach.npz."),
    ] = SIMULATED,
    people: Annotated[
        str,
        typer.Option(help=f"Family of the simulated people: {', '.join(FAMILIES)}."),
    ] = FAMILIES[0],
    protocol: Annotated[
        str,
        typer.Option(
            help=f"{WITHIN}: learn from the same person's and side's other recordings; "
            f"{LEAVE_ONE_OUT}: from the other people's; {NEW_TASK}: from their other tasks."
        ),
    ] = WITHIN,
    observed: Annotated[
        str, typer.Option(help="Share of each reach that is seen, or several: 0.1,0.3,0.5.")
    ] = "0.3",
    task_from: Annotated[
        str,
        typer.Option(help=f"What names a task: {AUTO}, {', '.join(TASK_FIELDS)}."),
    ] = AUTO,
    config: Annotated[
        Path | None, typer.Option(help="YAML file with parameters of PredictorConfig.")
    ] = None,
    seed: Annotated[
        int, typer.Option(help="Seed of simulated people and of the plots' examples.", min=0)
    ] = 0,
    workers: Annotated[
        int | None, typer.Option(help="Processes (default: one a core).", min=1, show_default=False)
    ] = None,
    smoke: Annotated[
        bool, typer.Option("--smoke", help="Two people and two reaches a task only (seconds).")
    ] = False,
) -> None:
    """Replay reaches through the predictor and hold what it says against what came.

    Beside it: constant velocity, a minimum-jerk fit, the mean trajectory, and movement_primitives' ProMP
    where that is installed. An evaluation that was broken off goes on where it stopped.
    """
    console = Console()
    check_choice("--people", people, FAMILIES)
    check_choice("--protocol", protocol, PROTOCOLS)
    check_choice("--task-from", task_from, (AUTO, *TASK_FIELDS))
    settings = load_yaml(PredictorConfig, config) if config else PredictorConfig()
    job = Job(data, people, protocol, parse_shares(observed), settings, task_from, seed, smoke)
    try:
        results = run_job(job, out, workers or available_cores(), console)
    except KeyboardInterrupt:
        console.print(f"stopped; the same command goes on from what is in {out}", highlight=False)
        raise typer.Exit(130) from None
    show(results, console)
    console.print(f"results: {out / 'results.json'}", highlight=False, soft_wrap=True)


def main() -> int:
    """Entry point."""
    app(prog_name="evaluate_prediction.py")
    return 0
