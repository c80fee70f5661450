"""The study of the thesis' chapters 2 and 3 with simulated people: each reaches, and is explained.

A person's reaches are one piece of work, kept on the disk when it is done.
"""

from __future__ import annotations

import functools
import hashlib
import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hri_prediction.compiled import processor
from hri_prediction.errors import DataError
from hri_prediction.motor_control import design
from hri_prediction.motor_control.analyses.table import ReachTable, load, table_of, together
from hri_prediction.motor_control.arm_model import ArmModel
from hri_prediction.motor_control.batch import Job, correlated, explain_job, prepare
from hri_prediction.motor_control.convention import YAW_PITCH
from hri_prediction.motor_control.costs import CHAPTER_2
from hri_prediction.results.dependencies import dependency_hash
from hri_prediction.results.workers import computed_with, do_all, versions
from hri_sim.motor_control.people import (
    Reacher,
    Recorded,
    draw_people,
    measured_arm,
    record,
    see,
)

Array = NDArray[np.float64]

WORK = "hri_sim.motor_control.study"
PACKAGES = ("numpy", "scipy", "numba", "casadi")
PEOPLE = 15
_ARM_FROM = 9
"""Recordings that a person's arm is measured in."""


@dataclass(frozen=True)
class Study:
    """What is done.

    Attributes:
        seed: Of people and all that they do.
        people: How many.
        starts: Indices of start postures among the twelve.
        targets: Indices of targets.
    """

    seed: int = 0
    people: int = PEOPLE
    starts: tuple[int, ...] = tuple(range(len(design.STARTS_12_DEG)))
    targets: tuple[int, ...] = tuple(range(len(design.TARGETS_DEG)))

    @property
    def tasks(self) -> list[tuple[int, int]]:
        """Indices of start and target of each."""
        return [(start, target) for start in self.starts for target in self.targets]


SMOKE = Study(people=3, starts=(0, 1, 2, 4), targets=(0, 2, 8))


@dataclass(frozen=True)
class Turn:
    """One person's part.

    Attributes:
        study: What is done.
        index: Which person.
        folder: Where it is kept.
    """

    study: Study
    index: int
    folder: Path

    @property
    def path(self) -> Path:
        """Its file, whose name stands for all that decides about it."""
        parts = repr((_made_by(), self.study, self.index))
        return self.folder / f"{hashlib.sha256(parts.encode()).hexdigest()[:20]}.npz"


@functools.cache
def _made_by() -> str:
    return repr((dependency_hash(WORK), processor(), sorted(versions(PACKAGES).items())))


def people_of(study: Study) -> list[Reacher]:
    """The people of a study."""
    rng = np.random.default_rng([study.seed, study.people])
    return draw_people(study.people, rng, design.STARTS_12_DEG)


def _recorded(study: Study, index: int) -> Iterator[Recorded]:
    """What a person does, task by task."""
    person = people_of(study)[index]
    rng = np.random.default_rng([study.seed, study.people, index])
    for task in study.tasks:
        yield record(person, *task, rng, starts_deg=design.STARTS_12_DEG)


def arm_as_measured(study: Study, index: int) -> ArmModel:
    """The arm of a person as recordings have it: what their reaches are seen and explained with."""
    first = itertools.islice(_recorded(study, index), _ARM_FROM)
    return measured_arm(people_of(study)[index], list(first))


def do_turn(turn: Turn) -> tuple[int, ReachTable]:
    """Let a person reach, see and explain it; the number of the person, and what came of it."""
    study = turn.study
    person = people_of(study)[turn.index]
    tasks = study.tasks
    recorded = list(_recorded(study, turn.index))
    arm = measured_arm(person, recorded[:_ARM_FROM])
    reaches = [see(each, arm) for each in recorded]
    outcomes = [
        explain_job(Job(i, each, arm, correlated=correlated(each)))
        for i, each in enumerate(reaches)
    ]
    nothing = np.full(len(CHAPTER_2), np.nan)
    table = table_of(
        CHAPTER_2,
        reaches,
        outcomes,
        person=[person.name] * len(tasks),
        start=[f"P{start + 1}" for start, _ in tasks],
        target=[f"T{target + 1}" for _, target in tasks],
        # Weights mean nothing without scale factors: the true ones, with those of the reach as it was seen.
        truth=np.array(
            [
                nothing if o.error else one.alpha_with(np.array(o.factors))
                for one, o in zip(recorded, outcomes, strict=True)
            ]
        ),
    )
    return turn.index, table


def carry_out(
    study: Study,
    folder: Path,
    *,
    workers: int,
    scheduler: str | None = None,
    progress: Callable[[int, int], None] = lambda done, of: None,
) -> ReachTable:
    """Do what is not done yet of a study.

    Args:
        study: What is done.
        folder: Where people's turns are kept; it is there.
        workers: Processes.
        scheduler: Of a Dask cluster that does it instead; what they return is kept here.
        progress: Called with people who are done, and their number.

    Raises:
        ConfigError: on a scheduler that does not answer, or whose workers run other code.
    """
    turns = [Turn(study, index, folder.resolve()) for index in range(study.people)]
    tables: dict[int, ReachTable] = {}
    for turn in turns:
        try:
            tables[turn.index] = load(turn.path)
        except DataError:
            continue
    progress(len(tables), len(turns))
    missing = [turn for turn in turns if turn.index not in tables]
    results = do_all(
        do_turn,
        missing,
        workers=workers,
        scheduler=scheduler,
        prepare=functools.partial(prepare, (YAW_PITCH.name,)),
        computed_with=functools.partial(computed_with, WORK, PACKAGES),
    )
    for index, found in results if missing else ():
        path = turns[index].path
        new = path.with_suffix(f".{index}.new.npz")
        found.save(new)
        new.replace(path)
        tables[index] = found
        progress(len(tables), len(turns))
    return together([tables[turn.index] for turn in turns])
