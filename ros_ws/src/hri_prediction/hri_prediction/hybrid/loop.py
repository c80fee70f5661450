"""The hybrid loop of all people that a predictor follows: questions and answers."""

from __future__ import annotations

import contextlib
import os
import traceback
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hri_prediction.errors import HriError
from hri_prediction.hybrid.body import CONVENTION
from hri_prediction.hybrid.config import HybridConfig
from hri_prediction.hybrid.person import HybridPerson, NoTarget, Rest, SeenReach
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


@dataclass(frozen=True, eq=False)
class Setup:
    """What the loop needs to know.

    Attributes:
        targets: Where tips of hands may end, by name (3,) [m], in the world.
        predictor: Settings of the predictors that are given libraries.
        config: Of the hybrid.
        weights: File of a process of weights; none: the one that ships with the package.
        store: Folder of people; none: nothing is kept.
        people: Names of those who are kept there; others are forgotten at the end.
    """

    targets: Mapping[str, Array]
    predictor: PredictorConfig
    config: HybridConfig
    weights: Path | None = None
    store: Path | None = None
    people: frozenset[str] = frozenset()


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


@dataclass(frozen=True)
class Left:
    """A person who is not kept has gone, and is not waited for: nothing more is known of them."""

    person: str


@dataclass(frozen=True, eq=False)
class Expected:
    """What an arm may do next.

    Attributes:
        person: Whose.
        side: Which arm.
        library: Its tasks.
        remarks: Targets that cannot be reached, or without an optimum, and why.
        spread: Of tasks that were never seen: standard deviation of the logarithms of the weights that
            were guessed.
    """

    person: str
    side: str
    library: TaskLibrary
    remarks: dict[str, str]
    spread: dict[str, float]


@dataclass(frozen=True)
class Learnt:
    """A reach was learnt.

    Attributes:
        person: Whose.
        side: Of the arm.
        task: Which.
        seen: Reaches of it so far.
        divergence: Of this update, by weight.
    """

    person: str
    side: str
    task: str
    seen: int
    divergence: float


@dataclass(frozen=True, eq=False)
class Explained:
    """A mean path was explained."""

    person: str
    side: str
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


Question = Rested | Reached | Left
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
        # Which folder a person is kept in, and what of it could not be written yet.
        self._kept: dict[str, tuple[int, int]] = {}
        self._unsaved: dict[str, set[TaskKey]] = {}
        self._claims: dict[str, int] = {}
        # Whose folder could not be looked at: nothing of theirs is explained until they are asked for.
        self._unseen: set[str] = set()

    def answer(self, question: Question) -> list[Answer]:
        """Do what is asked for; what goes wrong is an answer too."""
        name = question.person
        if isinstance(question, Left):
            if name not in self._setup.people:
                self._people.pop(name, None)
            return []
        forgotten: list[Answer] = []
        self._unseen.discard(name)
        try:
            forgotten = self._forget_deleted(name)
            if isinstance(question, Rested):
                person = self._person(name)
                library = person.at_rest(question.rest)
                side = question.rest.body.side
                guessed = person.guessed_sd.items()
                spread = {key.name: sd for key, sd in guessed if key.side == side}
                return [*forgotten, Expected(name, side, library, dict(person.remarks), spread)]
            key = self._person(name).reached(question.reach)
        except NoTarget:
            return forgotten
        except Exception as error:  # whatever it is, the next question may go well
            return [*forgotten, Trouble(name, _told(error))]
        task = self._people[name].tasks[key]
        learnt = Learnt(name, key.side, key.name, task.seen, task.divergences[-1])
        return [*forgotten, learnt, *self._kept_or_not(name, key)]

    def explain_next(self) -> list[Answer]:
        """Explain one mean path that has settled; nothing when there is none."""
        for name, person in list(self._people.items()):
            waiting = person.to_explain()
            if not waiting or name in self._unseen:
                continue
            key = waiting[0]
            try:
                if forgotten := self._forget_deleted(name):
                    return forgotten
            except Exception as error:  # at once it would go as badly, and again, without end
                self._unseen.add(name)
                return [Trouble(name, f"{key.name} is not explained yet: {_told(error)}")]
            try:
                found = person.explain(key)
                # It takes a while, in which folders may be moved.
                forgotten = self._forget_deleted(name)
            except Exception as error:  # the path stays unexplained until more is known
                return [Trouble(name, f"{key.name} is not explained: {_told(error)}")]
            return forgotten or [Explained(name, key.side, found), *self._kept_or_not(name, key)]
        return []

    def close(self) -> None:
        """Leave people to others, who may learn them from now on."""
        for name in list(self._unsaved):
            # A folder may be one that cannot be looked at any more.
            with contextlib.suppress(HriError, OSError):
                if name in self._claims and not self._forget_deleted(name):
                    self._kept_or_not(name, next(iter(self._unsaved[name])))
        for claim in self._claims.values():
            os.close(claim)
        self._claims.clear()

    def _forget_deleted(self, name: str) -> list[Answer]:
        """Forget a person whose folder was deleted, moved, or exchanged, while it was known here."""
        if name not in self._kept or self._store is None:
            return []
        if self._store.identity(name) == self._kept[name]:
            return []
        del self._kept[name], self._people[name]
        self._unsaved.pop(name, None)
        if name in self._claims:
            os.close(self._claims.pop(name))
        return [
            Trouble(name, "the folder is gone, or another one: who was learnt here is forgotten")
        ]

    def _stored(self, name: str) -> PeopleStore | None:
        """Where a person is kept; strangers are not."""
        return self._store if name in self._setup.people else None

    def _person(self, name: str) -> HybridPerson:
        if name not in self._people:
            store = self._stored(name)
            if store is not None and name in store.names():
                self._claim(store, name)
            tasks, own = store.load(name) if store is not None else ([], None)
            self._people[name] = HybridPerson(
                self._setup.targets,
                self._weights,
                self._setup.predictor,
                self._setup.config,
                tasks=tasks,
                own=own,
            )
            self._remember_folder(name)
        return self._people[name]

    def _remember_folder(self, name: str) -> None:
        """Know the folder again that a person is kept in: that which is claimed, whatever its name."""
        store = self._stored(name)
        if name in self._claims:
            claimed = os.fstat(self._claims[name])
            self._kept[name] = claimed.st_dev, claimed.st_ino
        elif store is not None and (identity := store.identity(name)) is not None:
            self._kept[name] = identity

    def _kept_or_not(self, name: str, key: TaskKey) -> list[Answer]:
        """Keep what was learnt; it is learnt whether that goes well or not."""
        try:
            self._keep(name, key)
        except Exception as error:  # a full disk, another predictor: it may go well the next time
            return [Trouble(name, _told(error))]
        return []

    def _keep(self, name: str, key: TaskKey) -> None:
        store = self._stored(name)
        if store is None:
            return
        # What a full disk did not take is still to be written when it has room.
        unsaved = self._unsaved.setdefault(name, set())
        unsaved.add(key)
        if name not in self._claims and name not in self._kept and name not in store.names():
            self._claim(store, name)  # the first that is ever kept of this person
        if name not in self._claims:
            raise HriError(
                f"{store.folder / name} is another predictor's, which learns this person: what is "
                "learnt here is not kept",
                hint="give this person another name here, or end the other one and start this anew",
            )
        person = self._people[name]
        store.save(name, [person.tasks[each] for each in sorted(unsaved)], person.weights.own)
        del self._unsaved[name]
        self._remember_folder(name)

    def _claim(self, store: PeopleStore, name: str) -> None:
        claim = store.claim(name)
        if claim is not None:
            self._claims[name] = claim


def _told(error: Exception) -> str:
    """What went wrong, in a line; where it is none of ours, the traceback is on stderr."""
    if isinstance(error, HriError):
        return str(error)
    traceback.print_exception(error)
    return f"{type(error).__name__}: {error}"


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
        if isinstance(question, Reached):
            self._answers.extend(self._loop.explain_next())

    def answers(self) -> list[Answer]:
        """What came of it since last asked."""
        found = list(self._answers)
        self._answers.clear()
        return found

    @property
    def alive(self) -> bool:
        """Whether it can still answer."""
        return True

    @property
    def stalled(self) -> bool:
        """Whether it has been asked, and said nothing for long."""
        return False

    def close(self) -> None:
        """End it."""
        self._loop.close()
