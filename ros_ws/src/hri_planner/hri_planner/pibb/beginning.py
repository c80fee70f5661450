"""Sessions as they begin: with straight ways, with another's policy, or where they were left."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from hri_planner.dmp.model_file import load_dmp
from hri_planner.dmp.policy import DmpPolicy
from hri_planner.pibb.experiment import Experiment, find_experiment, load_experiment
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


def opened_session(
    folder: Path, experiment: str, *, person: str, seed: int, policy: str, robot: RobotModel
) -> Session:
    """The session that a folder holds, or a new one, which it then holds.

    Args:
        folder: Of the trials.
        experiment: A file, or an experiment that ships.
        person: Who takes part.
        seed: Of a new session.
        policy: That a new session begins with, a file; empty: straight ways.
        robot: The robot.

    Raises:
        ConfigError: when the folder holds another person's trials, or the experiment cannot be done.
        DataError: when a file cannot be read.
        HriError: when the folder cannot be written.
        PlanningError: when the policy has other goals than the experiment.
    """
    if (folder / SESSION).exists():
        session, header = load_session(folder)
        if header.get("person") != person:
            raise ConfigError(
                f"{folder} holds trials of {header.get('person')!r}",
                expected=f"those of {person!r}",
                hint="choose another folder",
            )
        session.experiment.check(robot)
        return session
    found = load_experiment(find_experiment(experiment))
    found.check(robot)
    session = Session.begin(found, first_policy(found, robot, policy), np.random.default_rng(seed))
    save_session(folder, session, person=person, seed=seed)
    return session
