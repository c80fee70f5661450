"""Sessions as they begin: with straight ways, with another's policy, or where they were left."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hri_planner.dmp.model_file import load_dmp
from hri_planner.dmp.policy import DmpPolicy
from hri_planner.pibb.experiment import Experiment
from hri_planner.pibb.experiment_file import find_experiment, load_experiment, to_mapping
from hri_planner.pibb.session import Session
from hri_planner.pibb.storage import SESSION, load_session, save_session
from hri_planner.robot.model import RobotModel
from hri_prediction.errors import ConfigError, PlanningError


def first_policy(experiment: Experiment, robot: RobotModel, file: str | Path = "") -> DmpPolicy:
    """The policy that an experiment begins with.

    Args:
        experiment: What is done.
        robot: The robot.
        file: Another's policy, whose ways are turned and stretched to fit; empty: straight ways.

    Raises:
        DataError: when the file cannot be read.
        PlanningError: when it has other goals.
    """
    initial = experiment.initial_policy(robot)
    if not str(file):
        return initial
    given = load_dmp(file)
    if set(given.names) != set(initial.names):
        raise PlanningError(
            f"{file} has goals {', '.join(given.names)}",
            expected=f"those of {experiment.name}: {', '.join(initial.names)}",
        )
    return given.moved(initial.start, initial.posture, initial.goals)


def mark_of(policy: DmpPolicy) -> str:
    """Tells policies apart."""
    arrays = (policy.start, policy.posture, *policy.goals.values(), *policy.weights.values())
    whole = b"".join(np.ascontiguousarray(array, dtype=float).tobytes() for array in arrays)
    return hashlib.sha256(whole).hexdigest()[:16]


@dataclass(frozen=True)
class Opened:
    """A session, and what is saved with it.

    Attributes:
        session: The trials.
        begun: Mark of the policy that it began with.
    """

    session: Session
    begun: str


def opened_session(
    folder: Path, experiment: str, *, person: str, seed: int, policy: str, robot: RobotModel
) -> Opened:
    """The session that a folder holds, or a new one, which it then holds.

    Args:
        folder: Of the trials.
        experiment: A file, or an experiment that ships.
        person: Who takes part.
        seed: Of a new session.
        policy: That a new session begins with, a file; empty: straight ways.
        robot: The robot.

    Raises:
        ConfigError: when the folder holds trials of another person, experiment, seed or beginning, or the
            experiment cannot be done.
        DataError: when a file cannot be read.
        HriError: when the folder cannot be written.
        PlanningError: when the policy has other goals than the experiment.
    """
    found = load_experiment(find_experiment(experiment))
    found.check(robot)
    first = first_policy(found, robot, policy)
    if (folder / SESSION).exists():
        session, header = load_session(folder)
        check_same(folder, session.experiment, header, found, first, person=person, seed=seed)
        return Opened(session, mark_of(first))
    session = Session.begin(found, first, np.random.default_rng(seed))
    save_session(folder, session, person=person, seed=seed, begun=mark_of(first))
    return Opened(session, mark_of(first))


def check_same(
    folder: Path,
    experiment: Experiment,
    header: Mapping[str, Any],
    wanted: Experiment,
    first: DmpPolicy,
    *,
    person: str,
    seed: int,
) -> None:
    """Check that trials which a folder holds are those that are wanted.

    Args:
        folder: That holds them.
        experiment: Of them.
        header: Of their file.
        wanted: What is to be done.
        first: The policy that it is to begin with.
        person: Who is to take part.
        seed: What random numbers are to begin with.

    Raises:
        ConfigError: naming each difference.
    """
    pairs = {
        "person": (header.get("person"), person),
        "seed": (header.get("seed"), seed),
        **_differences(to_mapping(experiment), to_mapping(wanted)),
    }
    if header.get("begun") != mark_of(first) and experiment.name == wanted.name:
        pairs["first policy"] = ("that which they began with", "another one (see --policy)")
    different = {name: pair for name, pair in pairs.items() if pair[0] != pair[1]}
    if different:
        raise ConfigError(
            f"{folder} holds trials with "
            + ", ".join(f"{name} {held!r}" for name, (held, _) in different.items()),
            expected=", ".join(f"{name} {asked!r}" for name, (_, asked) in different.items()),
            hint="choose another folder, or what these trials began with (of a run in real time the "
            "experiment is in its run_1/experiment.yaml)",
        )


def _differences(held: Mapping[str, Any], asked: Mapping[str, Any]) -> dict[str, tuple[Any, Any]]:
    """What differs between two experiments, by name; of weights and plans only the values that do."""
    found: dict[str, tuple[Any, Any]] = {}
    for name, value in held.items():
        other = asked[name]
        if isinstance(value, dict) and isinstance(other, dict) and set(value) == set(other):
            found |= {
                f"{name}.{key}": (value[key], other[key])
                for key in value
                if value[key] != other[key]
            }
        elif value != other:
            found[name] = (value, other)
    return found
