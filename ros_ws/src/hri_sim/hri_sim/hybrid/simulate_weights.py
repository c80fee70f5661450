"""Command line of ``scripts/simulate_weights.py``: mean reaches of simulated people, explained."""

from __future__ import annotations

import functools
import json
from collections.abc import Callable
from contextlib import closing
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from numpy.typing import NDArray
from rich.console import Console

from hri_prediction.errors import HriError
from hri_prediction.hybrid.body import CONVENTION
from hri_prediction.motor_control import design
from hri_prediction.motor_control.arm_model import ArmModel
from hri_prediction.motor_control.batch import Job, Kept, correlated, explain_all, prepare
from hri_prediction.motor_control.costs import CHAPTER_3
from hri_prediction.motor_control.observed import ObservedReach
from hri_prediction.motor_control.scaling import MAXIMUM
from hri_prediction.results.options import Workers, make_folders, resumable, run_app
from hri_prediction.results.origin import available_cores, results_origin
from hri_prediction.results.progress import ProgressLine
from hri_prediction.results.workers import do_all
from hri_sim.motor_control.averaged import mean_reach
from hri_sim.motor_control.people import Reacher, draw_people, measured_arm, record, see

Array = NDArray[np.float64]

FILE, REACHES = "results.json", "reaches.jsonl"
PEOPLE = 15
_PHASES = np.linspace(0.0, 1.0, 101)
_ARM_FROM = 9
"""Recordings that an arm is measured in."""

app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)

Task = tuple[int, int]


def tasks_of(smoke: bool) -> tuple[Task, ...]:
    """Start postures and targets of the thesis' chapter 3; for a smoke run a few."""
    every = [(start, target) for start in range(len(design.STARTS_12_DEG)) for target in range(9)]
    return tuple(every[::9] if smoke else every)


@dataclass(frozen=True, eq=False)
class Person:
    """One person's part.

    Attributes:
        reacher: Who.
        tasks: What they reach from and for.
        seed: Of all that they do.
    """

    reacher: Reacher
    tasks: tuple[Task, ...]
    seed: tuple[int, ...]


def seen_of(person: Person) -> tuple[str, list[ObservedReach]]:
    """The mean of a person's repetitions of each task, as recordings are seen."""
    rng = np.random.default_rng(person.seed)
    recorded = [
        record(person.reacher, start, target, rng, starts_deg=design.STARTS_12_DEG)
        for start, target in person.tasks
    ]
    arm = measured_arm(person.reacher, recorded[:_ARM_FROM])
    return person.reacher.name, [see(each, arm) for each in recorded]


def means_of(
    reaches: dict[str, list[ObservedReach]], tasks: tuple[Task, ...]
) -> list[ObservedReach]:
    """The mean of all people's reaches of each task, as the arm of nobody makes it."""
    arm = ArmModel.of_body(convention=CONVENTION)
    found = []
    for number, (start, target) in enumerate(tasks):
        own = [each[number] for _, each in sorted(reaches.items())]
        angles = np.array([[np.interp(_PHASES, e.phases, q) for q in e.angles.T] for e in own])
        problems = [each.problem for each in own]
        found.append(
            mean_reach(
                angles.swapaxes(1, 2),
                np.array([problem.duration for problem in problems]),
                np.array([problem.v_start for problem in problems]),
                np.array([problem.v_end for problem in problems]),
                arm,
                f"P{start + 1} T{target + 1}",
            )
        )
    return found


def explained(
    reaches: list[ObservedReach], kept: Kept, workers: int, progress: Callable[[int, int], None]
) -> list[dict[str, Any]]:
    """Each as ``fit_ioc.py`` writes it, for ``fit_weights.py``."""
    arm = ArmModel.of_body(convention=CONVENTION)
    jobs = [Job(i, e, arm, CHAPTER_3, correlated=correlated(e)) for i, e in enumerate(reaches)]
    outcomes = explain_all(jobs, workers=workers, kept=kept, progress=progress)
    return [
        {
            **asdict(outcome),
            "q_start_deg": np.degrees(each.problem.q_start).tolist(),
            "q_end_deg": np.degrees(each.problem.q_end).tolist(),
            "duration_s": each.problem.duration,
        }
        for outcome, each in zip(outcomes, reaches, strict=True)
    ]


@app.command(context_settings={"help_option_names": ["-h", "--help"]})
def simulate_weights(
    out: Annotated[Path, typer.Option(help=f"Folder for {FILE}, and {REACHES}, a line a reach.")],
    people: Annotated[int, typer.Option(help="Simulated people.", min=2)] = PEOPLE,
    seed: Annotated[int, typer.Option(help="Of people and all that they do.", min=0)] = 0,
    workers: Workers = None,
    smoke: Annotated[bool, typer.Option("--smoke", help="Two people, twelve reaches.")] = False,
) -> None:
    """Have simulated people reach, and explain the mean reach of each task by five costs.

    The design is that of the thesis' chapter 3: twelve postures to begin in, nine targets, three
    repetitions, seen by motion capture with noise. Fit weights to what comes out with
    scripts/fit_weights.py OUT/results.json: those that ship were made so.
    """
    console = Console()
    make_folders(out=out)
    origin, tasks = results_origin(), tasks_of(smoke)
    count = 2 if smoke else people
    drawn = draw_people(
        count, np.random.default_rng([seed, count]), design.STARTS_12_DEG, CONVENTION
    )
    parts = [Person(one, tasks, (seed, count, index)) for index, one in enumerate(drawn)]
    cores = workers or available_cores()
    reaches: dict[str, list[ObservedReach]] = {}
    with resumable(console, out), ProgressLine(console) as progress:
        progress.say("people reach")
        compiled = functools.partial(prepare, (CONVENTION,))
        with closing(
            do_all(seen_of, parts, workers=cores, prepare=compiled, computed_with=dict)
        ) as results:
            for name, seen in results:
                reaches[name] = seen
                progress.count(len(reaches), len(parts))
        progress.say("explaining mean reaches")
        rows = explained(means_of(reaches, tasks), Kept(out / REACHES), cores, progress.count)
    failed = [row for row in rows if row["error"]]
    if len(failed) == len(rows):
        raise HriError(f"no reach was explained: {failed[0]['error']}")
    content = {
        "origin": origin,
        "people": count,
        "seed": seed,
        "smoke": smoke,
        "costs": list(CHAPTER_3),
        "scaling": MAXIMUM,
        "convention": CONVENTION,
        "reaches": rows,
    }
    (out / FILE).write_text(json.dumps(content, indent=1, allow_nan=False) + "\n")
    console.print(
        f"{out / FILE}: {len(rows) - len(failed)} mean reaches of {count} people",
        highlight=False,
        soft_wrap=True,
    )


def main(argv: list[str] | None = None) -> int:
    """Run with ``argv`` (default: the process' arguments); its exit code."""
    return run_app(app, "simulate_weights.py", argv)
