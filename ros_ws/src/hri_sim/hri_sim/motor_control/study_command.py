"""Command line of ``scripts/reproduce_motor_control.py``: the analyses of chapters 2 and 3."""

from __future__ import annotations

import json
import os
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console

from hri_prediction.errors import DataError
from hri_prediction.motor_control import design
from hri_prediction.motor_control.analyses.table import ReachTable
from hri_prediction.motor_control.convention import YAW_PITCH
from hri_prediction.results.options import Scheduler, Workers, make_folders, resumable
from hri_prediction.results.origin import available_cores, results_origin
from hri_prediction.results.progress import ProgressLine
from hri_sim.motor_control import chapter_2, chapter_3, study_pictures
from hri_sim.motor_control.averaged import explain_means
from hri_sim.motor_control.real_reaches import CONVENTION, SOURCE, by_task, explain_real
from hri_sim.motor_control.study import PEOPLE, SMOKE, Study, arm_as_measured, carry_out
from hri_sim.motor_control.study_report import report
from hri_sim.policies.evaluation import finite

DATA_VARIABLE = "HRI_DATA_DIR"
RESULTS = Path("docs/results")
RUNS, SMOKE_RUNS = Path("runs/motor_control"), Path("runs/smoke_motor_control")
VERTEX = 0.01
"""With all but this in one cost, a reach is explained by that cost alone."""
FILE, TEXT, PICTURES = "motor_control.json", "motor_control.md", "motor_control"

app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)


def of_chapter_2(
    table: ReachTable, study: Study, seed: int, progress: ProgressLine
) -> dict[str, Any]:
    """Analyses of all reaches of all people from the nine postures of chapter 2."""
    rng = np.random.default_rng([seed, 2])
    whole = table.explained
    person = table.person[0]
    progress.say("models of two, three and four costs")
    models = chapter_2.models(whole.of([person]), arm_as_measured(study, 0), progress.count)
    progress.say("discomfort")
    return {
        "not_explained": int((table.error != "").sum()),
        "behaviour": chapter_2.behaviour(table, np.random.default_rng([seed, 5])),
        "errors": chapter_2.errors(whole),
        "contributions": chapter_2.contributions(whole),
        "recovery": chapter_2.recovery(whole),
        "components": chapter_2.components(whole),
        "models_person": str(person),
        "models": models,
        "discomfort": chapter_2.discomfort(whole, rng, progress.count),
    }


def of_real(
    runs: Path,
    pictures: Path,
    *,
    workers: int,
    scheduler: str | None,
    smoke: bool,
    seed: int,
    progress: ProgressLine,
) -> dict[str, Any]:
    """The same of recorded reaches, where they are."""
    folder = os.environ.get(DATA_VARIABLE, "")
    file = Path(folder) / SOURCE
    if not folder:
        return {"skipped": f"{DATA_VARIABLE} is not set"}
    if not file.is_file():
        return {"skipped": f"{SOURCE} is not in ${DATA_VARIABLE}"}
    tables = {}
    left_out: dict[str, list[str]] = {}
    for convention in (CONVENTION, YAW_PITCH.name):
        progress.say(f"real reaches, {convention}")
        try:
            tables[convention], left_out[convention] = explain_real(
                file,
                runs / f"real_{convention}.jsonl",
                workers=workers,
                scheduler=scheduler,
                smoke=smoke,
                convention=convention,
                progress=progress.count,
            )
        except DataError as error:  # what was done of simulated people is told all the same
            return {"skipped": str(error)}
        if not len(tables[convention].explained):
            why = "; ".join(dict.fromkeys(tables[convention].error.tolist()))
            return {"skipped": f"no reach of {file} was explained by {convention}: {why}"}
    whole = tables[CONVENTION].explained
    found = by_task(whole, np.random.default_rng([seed, 4]))
    study_pictures.real_weights(found, pictures / "real_weights.png")
    study_pictures.error_boxes(whole, pictures / "real_errors.png", "real reaches")
    return {
        "convention": CONVENTION,
        "left_out": _left_out(tables[CONVENTION], left_out[CONVENTION]),
        "left_out_yaw_pitch": _left_out(tables[YAW_PITCH.name], left_out[YAW_PITCH.name]),
        "misfit_cm": float(np.median(whole.misfit_cm)),
        "misfit_cm_yaw_pitch": float(np.median(tables[YAW_PITCH.name].misfit_cm)),
        "sd_median": float(
            np.median(whole.sd[(whole.alpha > VERTEX) & (whole.alpha < 1.0 - VERTEX)])
        ),
        "at_vertex": float((whole.alpha.max(axis=1) >= 1.0 - VERTEX).mean()),
        "errors": chapter_2.errors(whole),
        "errors_yaw_pitch": chapter_2.errors(tables[YAW_PITCH.name].explained),
        "by_task": found,
    }


def _left_out(table: ReachTable, skipped: list[str]) -> list[str]:
    """A line for each reach that is in no figure."""
    failed = np.flatnonzero(table.error != "")
    return [
        *skipped,
        *(
            f"{table.person[i]} {table.start[i]} {table.target[i]}: {table.error[i]}"
            for i in failed
        ),
    ]


def reproduce(
    study: Study,
    runs: Path,
    out: Path,
    *,
    smoke: bool,
    workers: int,
    scheduler: str | None,
    progress: ProgressLine,
) -> dict[str, Any]:
    """Do what is not done yet, analyse, write report, figures and pictures; the figures."""
    origin = results_origin()
    pictures = out / PICTURES
    for folder in (runs / "people", pictures):
        folder.mkdir(parents=True, exist_ok=True)
    progress.say("people reach, and are explained")
    table = carry_out(
        study, runs / "people", workers=workers, scheduler=scheduler, progress=progress.count
    )
    progress.say("mean reaches, five costs")
    means = explain_means(
        table,
        runs / "means.jsonl",
        workers=workers,
        scheduler=scheduler,
        progress=progress.count,
    ).explained
    of_chapter = np.isin(table.start, [f"P{index + 1}" for index in design.IN_CHAPTER_2])
    nine = table.where(of_chapter)
    second = of_chapter_2(nine, study, study.seed, progress)
    third: dict[str, Any] = {
        "errors": chapter_3.errors(means),
        "influences": chapter_3.influences(means),
        "heights": chapter_3.heights(table.explained),
        "discomfort": chapter_3.discomfort(means, np.random.default_rng([study.seed, 3])),
    }
    real = of_real(
        runs,
        pictures,
        workers=workers,
        scheduler=scheduler,
        smoke=smoke,
        seed=study.seed,
        progress=progress,
    )
    progress.say("pictures")
    study_pictures.single_costs(pictures / "single_costs.png")
    study_pictures.error_boxes(nine.explained, pictures / "errors.png", "mean reaches")
    study_pictures.discomfort_picture(
        nine.explained, second["discomfort"], pictures / "discomfort.png"
    )
    study_pictures.mean_errors(third["errors"], pictures / "mean_errors.png")
    study_pictures.transitions(means, third["discomfort"], pictures / "transitions.png")
    content: dict[str, Any] = finite(
        {
            "origin": origin,
            "smoke": smoke,
            "study": {
                "seed": study.seed,
                "people": study.people,
                "starts": len(study.starts),
                "targets": len(study.targets),
            },
            "chapter_2": second,
            "chapter_3": third,
            "real": real,
        }
    )
    (out / FILE).write_text(json.dumps(content, indent=1, allow_nan=False) + "\n")
    (out / TEXT).write_text(report(content))
    return content


@app.command(context_settings={"help_option_names": ["-h", "--help"]})
def reproduce_motor_control(
    out: Annotated[
        Path | None,
        typer.Option(
            help=f"Folder for {TEXT}, {FILE} and {PICTURES}/*.png. Default: docs/results; smoke: --runs."
        ),
    ] = None,
    runs: Annotated[
        Path | None,
        typer.Option(
            help=f"Folder of what is done, which is not done again. Default: {RUNS}; smoke: {SMOKE_RUNS}."
        ),
    ] = None,
    people: Annotated[
        int, typer.Option(help=f"Number of people; smoke: {SMOKE.people} at most.", min=2)
    ] = PEOPLE,
    seed: Annotated[int, typer.Option(help="Of people and all that they do.", min=0)] = 0,
    workers: Workers = None,
    scheduler: Scheduler = None,
    smoke: Annotated[
        bool, typer.Option("--smoke", help="Three people, twelve tasks, a few real reaches.")
    ] = False,
) -> None:
    """Do the analyses of the thesis' chapters 2 and 3 on simulated people and on recorded reaches.

    Recorded reaches are found through HRI_DATA_DIR, and left out, with the reason, where it is not set.
    What was broken off goes on where it stopped.
    """
    console = Console()
    runs = runs or (SMOKE_RUNS if smoke else RUNS)
    out = out or (runs if smoke else RESULTS)
    study = replace(SMOKE, people=min(people, SMOKE.people)) if smoke else Study(people=people)
    make_folders(runs=runs, out=out)
    with resumable(console, runs), ProgressLine(console) as progress:
        content = reproduce(
            replace(study, seed=seed),
            runs,
            out,
            smoke=smoke,
            workers=workers or available_cores(),
            scheduler=scheduler,
            progress=progress,
        )
    errors = content["chapter_2"]["errors"]
    for cost, value in errors["hand_cm"].items():
        mean = (
            "no optimum" if value["mean"] is None else f"{value['mean']:.2f} ± {value['sd']:.2f} cm"
        )
        console.print(f"{cost.replace('_', ' '):<14} {mean}", highlight=False)
    if "skipped" in content["real"]:
        console.print(f"real reaches: left out, {content['real']['skipped']}", highlight=False)
    console.print(f"table: {out / TEXT}", highlight=False, soft_wrap=True)


def main() -> int:
    """Entry point."""
    app(prog_name="reproduce_motor_control.py")
    return 0
