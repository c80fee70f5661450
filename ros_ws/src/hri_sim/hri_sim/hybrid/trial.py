"""One person on trial: how predictions get better with each reach, from each first guess."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hri_prediction.errors import HriError
from hri_prediction.hybrid.config import HybridConfig
from hri_prediction.hybrid.person import HybridPerson
from hri_prediction.hybrid.task import PersonalTask, TaskKey, TaskRules
from hri_prediction.hybrid.weight_file import load_process
from hri_prediction.hybrid.why import Why
from hri_prediction.prediction.config import PredictorConfig
from hri_prediction.prediction.library import TaskModel
from hri_sim.hybrid.first_guesses import GUESSES, OPTIMAL, Guess, other_guesses
from hri_sim.hybrid.scores import Calibration, Score, calibration, told, untold
from hri_sim.hybrid.subjects import HAVE_TRUTH, Subject

Array = NDArray[np.float64]

COUNTS = (0, 1, 2, 5, 10, 40)
"""Reaches that were seen of a task before predictions are judged."""
_JUDGED = 10
"""Reaches that each prediction is judged by; none of them is learnt."""


@dataclass(frozen=True)
class Judged:
    """Scores of one person, target, first guess and number of reaches seen.

    Attributes:
        person: Name.
        target: Name.
        guess: One of `GUESSES`.
        seen: Reaches that were learnt.
        warped_m: Mean over the reaches judged, target and duration told.
        end_m: Likewise, of the end point.
        untold_m: Mean distance by warping when neither is told: of all targets that the person has.
        untold_end_m: Likewise, of the end point.
        sure: How sure predictions were, target and duration told.
        untold_sure: Likewise when neither is.
    """

    person: str
    target: str
    guess: str
    seen: int
    warped_m: float
    end_m: float
    untold_m: float
    untold_end_m: float
    sure: Calibration
    untold_sure: Calibration


@dataclass(frozen=True, eq=False)
class Course:
    """What came of one person.

    Attributes:
        judged: Scores.
        divergences: Of each update by weight, from the first guess of optimal control, by target.
        whys: What explained the mean paths, by target; or why nothing did.
        truth: True weights by target, of families that have any.
        guessed: Distance of the guessed weights to the true ones, mean absolute, by target, likewise: with
            the process of all people, and with what was learnt from the person's other targets.
    """

    judged: list[Judged]
    divergences: dict[str, list[float]]
    whys: dict[str, Why | str]
    truth: dict[str, list[float]]
    guessed: dict[str, tuple[float, float]]


def run_person(
    subject: Subject,
    others: list[Subject],
    rng: np.random.Generator,
    *,
    variability_m: float,
    counts: tuple[int, ...] = COUNTS,
    judged: int = _JUDGED,
) -> Course:
    """Let a person reach for each target, predict, and learn."""
    config, predictor, people = HybridConfig(), PredictorConfig(), load_process()
    person = HybridPerson(
        {name: habit.tip for name, habit in subject.habits.items()}, people, predictor, config
    )
    person.at_rest(subject.rest)
    keys = {key.target: key for key in person.tasks}
    learnt = {
        target: [subject.reach(target, rng, variability_m) for _ in range(max(counts))]
        for target in keys
    }
    tests = {
        target: [subject.reach(target, rng, variability_m) for _ in range(judged)]
        for target in keys
    }
    state: dict[str, dict[str, Guess]] = {guess: {} for guess in GUESSES}
    usual = person.usual_duration()
    for target, key in keys.items():
        task = person.tasks[key]
        paths = [other.habits[target].mean for other in others]
        state[OPTIMAL][target] = Guess(person.rules, task)
        made = other_guesses(
            person.rules, task, people, tests[target][0], task.geometry, paths, config.duration
        )
        for guess, begun in made.items():
            state[guess][target] = begun
    found: list[Judged] = []
    for guess in GUESSES:
        tasks = state[guess]
        for seen in range(max(counts) + 1):
            if seen in counts:
                found += _judge(subject.name, guess, seen, tasks, tests, predictor, usual)
            if seen < max(counts):
                tasks = {
                    target: Guess(each.rules, _learn(each, learnt[target][seen]))
                    for target, each in tasks.items()
                }
        state[guess] = tasks
    return Course(
        judged=found,
        divergences={
            target: list(each.task.divergences) for target, each in state[OPTIMAL].items()
        },
        **_explained(person, keys, state[OPTIMAL], subject),
    )


def _learn(guess: Guess, reach: Any) -> PersonalTask:
    return guess.rules.updated(guess.task, reach.phases, reach.values, reach.duration_s)


def _model(rules: TaskRules, task: PersonalTask, usual: tuple[float, float]) -> TaskModel:
    return rules.model(task, *usual)


def _judge(
    person: str,
    guess: str,
    seen: int,
    tasks: dict[str, Guess],
    tests: dict[str, list[Any]],
    predictor: PredictorConfig,
    usual: tuple[float, float],
) -> list[Judged]:
    models = {target: _model(each.rules, each.task, usual) for target, each in tasks.items()}
    rows = []
    for target, reaches in tests.items():
        by_told: list[Score] = [told(models[target], reach) for reach in reaches]
        by_itself = [untold(tuple(models.values()), reach, predictor) for reach in reaches]
        rows.append(
            Judged(
                person,
                target,
                guess,
                seen,
                float(np.mean([score.warped_m for score in by_told])),
                float(np.mean([score.end_m for score in by_told])),
                float(np.mean([score.warped_m for score in by_itself])),
                float(np.mean([score.end_m for score in by_itself])),
                calibration(by_told),
                calibration(by_itself),
            )
        )
    return rows


def _explained(
    person: HybridPerson, keys: dict[str, TaskKey], states: dict[str, Guess], subject: Subject
) -> dict[str, Any]:
    """Explain the mean paths of all targets, one after the other, each guessed before."""
    whys: dict[str, Why | str] = {}
    guessed: dict[str, tuple[float, float]] = {}
    truths = {
        target: _with_all(habit.alpha, subject, person.weights.names)
        for target, habit in subject.habits.items()
        if subject.family in HAVE_TRUTH
    }
    before = {
        target: person.weights.guess(task.task.path.q_start, task.task.path.q_end).alpha
        for target, task in states.items()
    }
    for target, key in keys.items():
        person.tasks[key] = states[target].task
        path = states[target].task.path
        after = person.weights.guess(path.q_start, path.q_end).alpha
        if target in truths:
            guessed[target] = (
                float(np.abs(before[target] - truths[target]).mean()),
                float(np.abs(after - truths[target]).mean()),
            )
        try:
            whys[target] = person.explain(key)
        except HriError as error:
            whys[target] = str(error)
    truth = {target: alpha.tolist() for target, alpha in truths.items()}
    return {"whys": whys, "truth": truth, "guessed": guessed}


def _with_all(alpha: Array, subject: Subject, names: tuple[str, ...]) -> Array:
    """True weights, 0 of costs that the person has not."""
    found = np.zeros(len(names))
    for value, name in zip(alpha, subject.costs, strict=True):
        found[names.index(name)] = value
    return found
