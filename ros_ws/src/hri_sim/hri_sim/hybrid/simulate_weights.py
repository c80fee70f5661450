"""Command line of ``scripts/simulate_weights.py``: simulated people reach, and a law is found for each."""

from __future__ import annotations

import functools
import json
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console

from hri_prediction.errors import DataError
from hri_prediction.hybrid.body import CONVENTION
from hri_prediction.motor_control import design
from hri_prediction.motor_control.batch import prepare
from hri_prediction.motor_control.collected import CollectedReach
from hri_prediction.motor_control.costs import CHAPTER_3
from hri_prediction.motor_control.person_laws import person_law, to_mapping
from hri_prediction.motor_control.scaling import MAXIMUM
from hri_prediction.results.kept import kept
from hri_prediction.results.options import Workers, make_folders, resumable, run_app
from hri_prediction.results.origin import available_cores, results_origin
from hri_prediction.results.progress import ProgressLine
from hri_prediction.results.workers import do_all
from hri_sim.motor_control.people import (
    FACING_RAD,
    Reacher,
    draw_people,
    measured_arm,
    record,
    see_whole,
)

FILE, LAWS = "results.json", "laws"
PEOPLE = 15
WORK, PACKAGES = "hri_sim.hybrid.simulate_weights", ("numpy", "scipy", "numba", "casadi")
"""What decides about laws."""
_REPETITIONS = 1
"""Of each task: people differ by more than a second look at one of them would tell."""
_ARM_FROM = 9
"""Recordings that an arm is measured in."""

app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)

Task = tuple[int, int]


def tasks_of(smoke: bool) -> tuple[Task, ...]:
    """Start postures and targets of the thesis' chapter 3; for a smoke run a few."""
    every = [(start, target) for start in range(len(design.STARTS_12_DEG)) for target in range(9)]
    return tuple(every[::4] if smoke else every)


@dataclass(frozen=True, eq=False)
class Person:
    """One person's part.

    Attributes:
        reacher: Who.
        tasks: What they reach from and for.
        seed: Of all that they do.
        kept: Folder of laws that were found, which are not found again.
    """

    reacher: Reacher
    tasks: tuple[Task, ...]
    seed: tuple[int, ...]
    kept: Path


def law_of(person: Person) -> dict[str, Any]:
    """The law of a person's reaches, as they are seen, from rest to rest.

    Raises:
        HriError: too few reaches are found, or no optimum of one.
    """
    key = repr((person.reacher.name, person.seed, person.tasks))
    return kept(person.kept, WORK, PACKAGES, key, functools.partial(_found, person))


def _found(person: Person) -> dict[str, Any]:
    rng = np.random.default_rng(person.seed)
    recorded = [
        record(
            person.reacher,
            start,
            target,
            rng,
            starts_deg=design.STARTS_12_DEG,
            repetitions=_REPETITIONS,
        )
        for start, target in person.tasks
    ]
    arm = measured_arm(person.reacher, recorded[:_ARM_FROM])
    facing_deg, name = float(np.degrees(FACING_RAD)), person.reacher.name
    reaches = [
        CollectedReach(
            whole.between, arm, facing_deg, name, f"P{each.start + 1} T{each.target + 1}", whole
        )
        for each in recorded
        for whole in see_whole(each, arm)
    ]
    if not reaches:
        raise DataError(f"no whole reach of {name} is found", expected="one or more")
    return to_mapping(person_law(name, reaches, CHAPTER_3, MAXIMUM))


@app.command(context_settings={"help_option_names": ["-h", "--help"]})
def simulate_weights(
    out: Annotated[Path, typer.Option(help=f"Folder for {FILE}, and {LAWS}/, a file a person.")],
    people: Annotated[int, typer.Option(help="Simulated people.", min=1)] = PEOPLE,
    seed: Annotated[int, typer.Option(help="Of people and all that they do.", min=0)] = 0,
    workers: Workers = None,
    smoke: Annotated[bool, typer.Option("--smoke", help="Two people, 27 reaches.")] = False,
) -> None:
    """Have simulated people reach, and find the law by which each of them weighs five costs.

    The design is that of the thesis' chapter 3: twelve postures to begin in, nine targets, seen by motion
    capture with noise; when reaches begin and end is not known. What comes out is as of scripts/fit_ioc.py
    --law --whole: fit weights to it with scripts/fit_weights.py OUT/results.json. Those that ship were
    made so. One or two minutes a person and core.
    """
    console = Console()
    folder = out / LAWS
    make_folders(out=out, laws=folder)
    origin, tasks = results_origin(), tasks_of(smoke)
    count = 2 if smoke else people
    drawn = draw_people(
        count, np.random.default_rng([seed, count]), design.STARTS_12_DEG, CONVENTION
    )
    parts = [Person(one, tasks, (seed, count, index), folder) for index, one in enumerate(drawn)]
    found: dict[str, dict[str, Any]] = {}
    with resumable(console, out), ProgressLine(console) as progress:
        progress.say("people reach, and their laws are found")
        compiled = functools.partial(prepare, (CONVENTION,))
        cores = workers or available_cores()
        with closing(
            do_all(law_of, parts, workers=cores, prepare=compiled, computed_with=dict)
        ) as results:
            for law in results:
                found[law["person"]] = law
                progress.count(len(found), len(parts))
    content = {
        "origin": origin,
        "people": count,
        "seed": seed,
        "smoke": smoke,
        "costs": list(CHAPTER_3),
        "scaling": MAXIMUM,
        "convention": CONVENTION,
        "whole": True,
        "reaches": [],
        "laws": [found[each.reacher.name] for each in parts],
    }
    (out / FILE).write_text(json.dumps(content, indent=1, allow_nan=False) + "\n")
    console.print(
        f"{out / FILE}: laws of {count} people, {len(tasks)} reaches",
        highlight=False,
        soft_wrap=True,
    )


def main(argv: list[str] | None = None) -> int:
    """Run with ``argv`` (default: the process' arguments); its exit code."""
    return run_app(app, "simulate_weights.py", argv)
