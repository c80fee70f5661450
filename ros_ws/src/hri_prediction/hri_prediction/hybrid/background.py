"""The hybrid loop beside a predictor: in a process of its own, so that no prediction ever waits for it.

Optimal control, its inverse and learning take milliseconds to a second, and hold the interpreter while they
do. So they are asked for, and what comes of it is fetched when it is there. A question that a newer one of
the same arm overtakes is dropped.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hri_prediction.errors import HriError
from hri_prediction.hybrid.body import CONVENTION
from hri_prediction.hybrid.config import HybridConfig
from hri_prediction.hybrid.person import HybridPerson, Rest, SeenReach
from hri_prediction.hybrid.prior_path import solver_of
from hri_prediction.hybrid.store import PeopleStore
from hri_prediction.hybrid.task import TaskKey
from hri_prediction.hybrid.weight_file import load_process
from hri_prediction.hybrid.why import Why
from hri_prediction.motor_control.arm_model import ANATOMICAL, ArmModel
from hri_prediction.motor_control.costs import COSTS
from hri_prediction.motor_control.ioc import explain
from hri_prediction.motor_control.observed import of_angles
from hri_prediction.motor_control.problem import ReachProblem
from hri_prediction.prediction.config import PredictorConfig
from hri_prediction.prediction.library import TaskLibrary

Array = NDArray[np.float64]

_NICE = 10
"""The process steps back behind those of the graph."""
_END_S = 2.0


@dataclass(frozen=True, eq=False)
class Setup:
    """What the loop needs to know.

    Attributes:
        targets: Where tips of hands may end, by name (3,) [m], in the world.
        predictor: Settings of the predictors that are given libraries.
        config: Of the hybrid.
        weights: File of a process of weights; none: the one that ships with the package.
        store: Folder of people; none: nothing is kept.
    """

    targets: Mapping[str, Array]
    predictor: PredictorConfig
    config: HybridConfig
    weights: Path | None = None
    store: Path | None = None


@dataclass(frozen=True, eq=False)
class Rested:
    """An arm of a person rests: what may it do next?"""

    person: str
    rest: Rest


@dataclass(frozen=True, eq=False)
class Reached:
    """A reach of a person has ended."""

    person: str
    reach: SeenReach


@dataclass(frozen=True, eq=False)
class Expected:
    """What an arm may do next.

    Attributes:
        person: Whose.
        side: Which arm.
        library: Its tasks.
        unreachable: Targets that cannot be reached, and why.
    """

    person: str
    side: str
    library: TaskLibrary
    unreachable: dict[str, str]


@dataclass(frozen=True)
class Learnt:
    """A reach was learnt.

    Attributes:
        person: Whose.
        task: Which.
        seen: Reaches of it so far.
        divergence: Of this update, by weight.
    """

    person: str
    task: str
    seen: int
    divergence: float


@dataclass(frozen=True, eq=False)
class Explained:
    """A mean path was explained."""

    person: str
    why: Why


@dataclass(frozen=True)
class Trouble:
    """Something could not be done.

    Attributes:
        person: Whose it is.
        text: What, and why.
    """

    person: str
    text: str


Question = Rested | Reached
Answer = Expected | Learnt | Explained | Trouble


class Loop:
    """The hybrid loop of all people that a predictor follows; see :class:`Background`.

    Args:
        setup: What it needs to know.

    Raises:
        DataError: the file of weights cannot be used.
    """

    def __init__(self, setup: Setup) -> None:
        warm_loop()
        self._setup = setup
        self._weights = load_process(setup.weights)
        self._store = PeopleStore(setup.store) if setup.store is not None else None
        self._people: dict[str, HybridPerson] = {}

    def answer(self, question: Question) -> list[Answer]:
        """Do what is asked for."""
        try:
            person = self._person(question.person)
            if isinstance(question, Rested):
                library = person.at_rest(question.rest)
                side = question.rest.body.side
                return [Expected(question.person, side, library, dict(person.unreachable))]
            key = person.reached(question.reach)
            self._keep(question.person, [key])
        except HriError as error:
            return [Trouble(question.person, str(error))]
        task = person.tasks[key]
        return [Learnt(question.person, key.name, task.seen, task.divergences[-1])]

    def explain_next(self) -> Answer | None:
        """Explain one mean path that has settled, if there is one."""
        for name, person in self._people.items():
            waiting = person.to_explain()
            if not waiting:
                continue
            try:
                found = person.explain(waiting[0])
                self._keep(name, waiting[:1])
            except HriError as error:
                return Trouble(name, f"{waiting[0].name} is not explained: {error}")
            return Explained(name, found)
        return None

    def _person(self, name: str) -> HybridPerson:
        if name not in self._people:
            tasks, own = self._store.load(name) if self._store is not None else ([], None)
            self._people[name] = HybridPerson(
                self._setup.targets,
                self._weights,
                self._setup.predictor,
                self._setup.config,
                tasks=tasks,
                own=own,
            )
        return self._people[name]

    def _keep(self, name: str, keys: list[TaskKey]) -> None:
        if self._store is not None:
            person = self._people[name]
            self._store.save(name, [person.tasks[key] for key in keys], person.weights.own)


def warm_loop() -> None:
    """Explain a reach once: models and kernels are compiled before anything is asked."""
    solver = solver_of(ArmModel.of_body(convention=CONVENTION), ANATOMICAL)
    problem = ReachProblem.at_rest([0.9, 1.0, 1.2], [0.4, 1.3, 0.6], 1.0)
    angles = solver.solve(problem, np.ones(len(COSTS))).angles(np.linspace(0.0, 1.0, 20))
    explain(solver, of_angles(problem, angles, solver.arm))


class Inline:
    """The loop in the process and at the time of the question: for virtual time, where nothing is late.

    Args:
        setup: What it needs to know.
    """

    def __init__(self, setup: Setup) -> None:
        self._loop = Loop(setup)
        self._answers: deque[Answer] = deque()

    def ask(self, question: Question) -> None:
        """Do what is asked for, at once."""
        self._answers.extend(self._loop.answer(question))
        if isinstance(question, Reached) and (found := self._loop.explain_next()) is not None:
            self._answers.append(found)

    def answers(self) -> list[Answer]:
        """What came of it since last asked."""
        found = list(self._answers)
        self._answers.clear()
        return found

    @property
    def alive(self) -> bool:
        """Whether it can still answer."""
        return True

    def close(self) -> None:
        """End it."""


@dataclass(eq=False)
class Background:
    """The loop in a process of its own.

    Args:
        setup: What it needs to know.
    """

    setup: Setup
    _connection: Connection = field(init=False, repr=False)
    _process: Any = field(init=False, repr=False)

    def __post_init__(self) -> None:
        load_process(
            self.setup.weights
        )  # a file that cannot be used is named now, not in the process
        context = multiprocessing.get_context("spawn")
        self._connection, theirs = context.Pipe()
        self._process = context.Process(
            target=_work, args=(theirs, self.setup), name="hybrid", daemon=True
        )
        self._process.start()
        theirs.close()

    def ask(self, question: Question) -> None:
        """Have something done; does not wait."""
        with contextlib.suppress(OSError):
            self._connection.send(question)

    def answers(self) -> list[Answer]:
        """What came of it since last asked; does not wait."""
        found = []
        with contextlib.suppress(OSError, EOFError):
            while self._connection.poll():
                found.append(self._connection.recv())
        return found

    @property
    def alive(self) -> bool:
        """Whether the process is there."""
        return bool(self._process.is_alive())

    def close(self) -> None:
        """End the process, when it has done what it is at."""
        with contextlib.suppress(OSError):
            self._connection.send(None)
        self._process.join(_END_S)
        if self._process.is_alive():
            self._process.kill()
            self._process.join()
        self._connection.close()


def _work(connection: Connection, setup: Setup) -> None:
    """The process: questions first, then what waits to be explained; ends with whoever started it."""
    with contextlib.suppress(OSError):
        os.nice(_NICE)
    with contextlib.suppress(EOFError, OSError, KeyboardInterrupt):
        loop = Loop(setup)
        while True:
            questions: list[Question | None] = []
            while not questions or connection.poll():
                if not questions and not connection.poll():
                    found = loop.explain_next()
                    if found is not None:
                        connection.send(found)
                        continue
                questions.append(connection.recv())
            for question in _still_asked(questions):
                if question is None:
                    return
                for answer in loop.answer(question):
                    connection.send(answer)


def _still_asked(questions: list[Question | None]) -> list[Question | None]:
    """Without questions of resting arms that a later one has overtaken."""
    newest = {
        (question.person, question.rest.body.side): index
        for index, question in enumerate(questions)
        if isinstance(question, Rested)
    }
    return [
        question
        for index, question in enumerate(questions)
        if not isinstance(question, Rested)
        or newest[question.person, question.rest.body.side] == index
    ]
