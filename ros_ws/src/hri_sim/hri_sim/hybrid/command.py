"""Command line of ``scripts/reproduce_hybrid.py``: the hybrid predictor on trial."""

from __future__ import annotations

import functools
import hashlib
import json
import os
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console

from hri_prediction.errors import HriError
from hri_prediction.extras import check_scikit_learn
from hri_prediction.hybrid.body import CONVENTION
from hri_prediction.hybrid.weight_file import load_process, shipped_hash
from hri_prediction.motor_control.batch import prepare
from hri_prediction.results.kept import kept
from hri_prediction.results.options import Scheduler, Workers, make_folders, resumable
from hri_prediction.results.origin import available_cores, results_origin
from hri_prediction.results.progress import ProgressLine
from hri_prediction.results.workers import computed_with, do_all
from hri_sim.hybrid import pictures, tables
from hri_sim.hybrid.latency import Timed, latency, measure, stream
from hri_sim.hybrid.others_weights import others_weights
from hri_sim.hybrid.real import SOURCE, read, run_real
from hri_sim.hybrid.report import MISSED, report
from hri_sim.hybrid.subjects import (
    DRIFT_M,
    FAMILIES,
    OFFSET_M,
    SCALE,
    VARIABILITY_M,
    Subject,
    draw_subjects,
)
from hri_sim.hybrid.trial import COUNTS, Course, run_person
from hri_sim.policies.evaluation import finite

DATA_VARIABLE = "HRI_DATA_DIR"
RESULTS, SMOKE_RESULTS = Path("docs/results"), Path("runs/smoke_hybrid")
FILE, TEXT, PICTURES = "hybrid.json", "hybrid.md", "hybrid"
RUNS = Path("runs/hybrid")
WORK, PACKAGES = "hri_sim.hybrid.command", ("numpy", "scipy", "numba", "casadi", "scikit-learn")
"""What decides about results."""
PEOPLE = 5
ALONE, BESIDE = "alone", "learning beside"
AT_WORK = "of these, while it was at work"

app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)


@dataclass(frozen=True)
class Extent:
    """How much is done.

    Attributes:
        people: Of each family.
        families: Which.
        counts: Reaches seen before predictions are judged.
        judged: Reaches that each is judged by.
        reaches: Of the person whom latency is measured with.
    """

    people: int
    families: tuple[str, ...]
    counts: tuple[int, ...]
    judged: int
    reaches: int


FULL = Extent(PEOPLE, FAMILIES, COUNTS, 5, 60)
SMOKE = Extent(2, FAMILIES[:1], (0, 1, 5), 3, 4)


@dataclass(frozen=True, eq=False)
class Turn:
    """One person's part.

    Attributes:
        subjects: All people of the family.
        index: Which.
        family: Which.
        extent: How much is done.
        seed: Of all that they do.
    """

    subjects: list[Subject]
    index: int
    family: str
    extent: Extent
    seed: int


def do_turn(turn: Turn) -> tuple[int, Course]:
    """One person on trial; the others are what is known of other people."""
    subject = turn.subjects[turn.index]
    course = run_person(
        subject,
        [other for other in turn.subjects if other is not subject],
        np.random.default_rng([turn.seed, FAMILIES.index(turn.family), turn.index]),
        variability_m=VARIABILITY_M,
        counts=turn.extent.counts,
        judged=turn.extent.judged,
    )
    return turn.index, course


def run_family(
    family: str,
    extent: Extent,
    seed: int,
    workers: int,
    scheduler: str | None,
    progress: Callable[[int, int], None],
) -> list[Course]:
    """All people of a family, each by itself."""
    subjects = draw_subjects(
        extent.people, family, np.random.default_rng([seed, FAMILIES.index(family)])
    )
    turns = [Turn(subjects, index, family, extent, seed) for index in range(len(subjects))]
    courses: dict[int, Course] = {}
    for index, course in do_all(
        do_turn,
        turns,
        workers=workers,
        scheduler=scheduler,
        prepare=functools.partial(prepare, (CONVENTION,)),
        computed_with=functools.partial(computed_with, WORK, PACKAGES),
    ):
        courses[index] = course
        progress(len(courses), len(subjects))
    return [courses[index] for index in sorted(courses)]


def of_real(progress: Callable[[int, int], None]) -> dict[str, Any]:
    """Recorded people, where they are."""
    folder = os.environ.get(DATA_VARIABLE, "")
    file = Path(folder) / SOURCE
    if not folder:
        return {"skipped": f"{DATA_VARIABLE} is not set"}
    if not file.is_file():
        return {"skipped": f"{SOURCE} is not in ${DATA_VARIABLE}"}
    try:
        repeated, skipped = read(file)
        course = run_real(repeated, progress)
    except HriError as error:
        return {"skipped": str(error)}
    by_others: dict[str, Any]
    try:
        by_others = others_weights(repeated, course.whys)
    except HriError as error:
        by_others = {"skipped": str(error)}
    return {**tables.of_real(course), "others_weights": by_others, "unusable": skipped}


def of_family(run: Callable[[], list[Course]]) -> Callable[[], dict[str, Any]]:
    """The figures of what a family did, once it has done it."""
    return lambda: finite(tables.of_courses(run()))


def recorded_key() -> str:
    """Stands for the recordings that there are."""
    folder = os.environ.get(DATA_VARIABLE, "")
    file = Path(folder) / SOURCE
    found = hashlib.sha256(file.read_bytes()).hexdigest() if folder and file.is_file() else folder
    return f"recorded {found}"


@app.command(context_settings={"help_option_names": ["-h", "--help"]})
def reproduce_hybrid(
    out: Annotated[
        Path | None,
        typer.Option(
            help=f"Folder for {TEXT}, {FILE} and {PICTURES}/*.png. Default: {RESULTS}; smoke: "
            f"{SMOKE_RESULTS}."
        ),
    ] = None,
    seed: Annotated[int, typer.Option(help="Of people and all that they do.", min=0)] = 0,
    workers: Workers = None,
    scheduler: Scheduler = None,
    runs: Annotated[
        Path, typer.Option(help="Folder of what is done, which is not done again.")
    ] = RUNS,
    smoke: Annotated[
        bool, typer.Option("--smoke", help="Two people of one family, five reaches each.")
    ] = False,
) -> None:
    """Compare first guesses of people's reaches, and how they get better with each reach that is seen.

    Simulated people, of whom some families move as the models of the predictor do and others do not, and
    recorded ones (found through HRI_DATA_DIR; left out, with the reason, where it is not set). Takes
    a while, and goes on where it was stopped; the last part measures latencies: leave the machine
    alone then. Exit code 3: a bar is missed; of a smoke run, which judges nobody, it is 0.
    """
    console = Console()
    out = out or (SMOKE_RESULTS if smoke else RESULTS)
    extent = SMOKE if smoke else FULL
    check_scikit_learn()
    make_folders(out=out, runs=runs)
    (out / PICTURES).mkdir(exist_ok=True)
    origin = results_origin()
    families: dict[str, Any] = {}
    cores = workers or available_cores()
    keep = functools.partial(kept, runs, WORK, PACKAGES)
    with resumable(console, runs), ProgressLine(console) as progress:
        prepare((CONVENTION,))
        weights = shipped_hash()  # all first guesses depend on them
        for family in extent.families:
            progress.say(f"simulated people, {family}")
            work = functools.partial(
                run_family, family, extent, seed, cores, scheduler, progress.count
            )
            families[family] = keep(repr((family, extent, seed, weights)), of_family(work))
        progress.say("recorded people")
        real: dict[str, Any] = {"skipped": "--smoke"}
        if not smoke:
            real = keep(repr((recorded_key(), weights)), lambda: finite(of_real(progress.count)))
        samples = stream(extent.reaches, seed)
        timed: dict[bool, list[Timed]] = {False: [], True: []}
        # In turn and back again: a machine that gets slower, or quicker, does so for both.
        for hybrid in (False, True, True, False):
            progress.say("latency, " + (BESIDE if hybrid else ALONE))
            timed[hybrid].append(measure(samples, hybrid, progress=progress.count))
        latencies = {
            ALONE: latency(timed[False]),
            BESIDE: latency(timed[True]),
            AT_WORK: latency(timed[True], at_work=True),
        }
    content = finite(
        {
            "origin": origin,
            "setting": {
                "seed": seed,
                "smoke": smoke,
                "people": extent.people,
                "judged": extent.judged,
                "offset_cm": 100.0 * OFFSET_M,
                "drift_cm": 100.0 * DRIFT_M,
                "scale": SCALE,
                "variability_mm": 1000.0 * VARIABILITY_M,
            },
            "families": families,
            "real": real,
            "latency": {name: asdict(each) for name, each in latencies.items()},
        }
    )
    (out / FILE).write_text(json.dumps(content, indent=1, allow_nan=False) + "\n")
    text = report(content)
    (out / TEXT).write_text(text)
    names = list(load_process().names)
    for family, found in content["families"].items():
        pictures.errors(found, out / PICTURES / f"errors_{family}.png")
        pictures.weights(found, names, out / PICTURES / f"weights_{family}.png")
    if "skipped" not in content["real"]:
        pictures.errors(content["real"], out / PICTURES / "errors_recorded.png")
        pictures.weights(content["real"], names, out / PICTURES / "weights_recorded.png")
    for guess, curve in families["optimal"]["curves"].items():
        values = ", ".join(
            f"{value:.2f} cm after {count}" for count, value in curve["warped_cm"].items()
        )
        console.print(f"{guess:<16} {values}", highlight=False)
    console.print(f"table: {out / TEXT}", highlight=False, soft_wrap=True)
    if MISSED in text and not smoke:
        raise typer.Exit(3)


def main() -> int:
    """Entry point."""
    app(prog_name="reproduce_hybrid.py")
    return 0
