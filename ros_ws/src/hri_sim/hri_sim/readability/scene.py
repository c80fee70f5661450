"""Experiments as scenes: for the simulator, and for launching one policy."""

from __future__ import annotations

import numpy as np

from hri_planner.dmp.policy import HOME, DmpPolicy
from hri_planner.pibb.experiment import Experiment
from hri_planner.robot.model import RobotModel
from hri_sim.readability.participant import participant_spec
from hri_sim.scenario.schema import BoxSpec, PersonSpec, ReachSpec, Scenario, TableSpec

PERSON_S = (0.6, 1.0)
"""Duration of a hand's reach [s]."""
DELAY_S = (0.4, 1.4)
"""After so long a hand begins to move [s]."""


def experiment_scenario(
    experiment: Experiment, robot: RobotModel, person: str | None = "person1"
) -> Scenario:
    """The scene of an experiment; what is done in it, the adaptation node says.

    Args:
        experiment: The experiment.
        robot: The robot.
        person: Name of the simulated body; none: nobody is simulated.
    """
    first = next(iter(experiment.goals))
    people = () if person is None else (participant_spec(person),)
    return _scenario(experiment, robot, people, [ReachSpec(robot_target=first)])


def policy_scenario(
    experiment: Experiment, robot: RobotModel, policy: DmpPolicy, seed: int, reaches: int
) -> Scenario:
    """Reaches to goals in random order and back, while a person reaches for targets beside them.

    Args:
        experiment: Where goals, targets and obstacles are.
        robot: The robot.
        policy: Says how long a reach takes.
        seed: Draws goals, and what the person does.
        reaches: How many, those back to the start not counted.
    """
    rng = np.random.default_rng(seed)
    names, steps = list(experiment.goals), []
    for index in range(reaches):
        goal = names[rng.integers(len(names))]
        steps.append(
            ReachSpec(
                robot_target=goal,
                # Mostly what a person does who has read the robot; sometimes not.
                person_target=f"person_{goal if rng.random() < 0.7 else rng.choice(names)}",
                person_delay=float(rng.uniform(*DELAY_S)),
                person_duration=float(rng.uniform(*PERSON_S)),
                duration=policy.duration,
            )
        )
        if index < reaches - 1:
            steps.append(
                ReachSpec(
                    robot_target=HOME,
                    person_target="person_home",
                    person_duration=0.8,
                    duration=policy.duration,
                )
            )
    return _scenario(experiment, robot, (participant_spec(),), steps)


def _scenario(
    experiment: Experiment,
    robot: RobotModel,
    people: tuple[PersonSpec, ...],
    reaches: list[ReachSpec],
) -> Scenario:
    def place(values: np.ndarray) -> tuple[float, float, float]:
        x, y, z = (round(float(value), 6) for value in values)
        return x, y, z

    targets = {name: place(goal) for name, goal in experiment.goals.items()}
    targets[HOME] = place(robot.frames(experiment.posture)[3])
    targets |= {f"person_{name}": place(target) for name, target in experiment.targets.items()}
    if people:
        targets["person_home"] = people[0].home
    a, b, c, d, e, f, g = (float(angle) for angle in experiment.posture)
    return Scenario(
        name=experiment.name,
        robot_start=(a, b, c, d, e, f, g),
        targets=targets,
        persons=people,
        reaches=tuple(reaches),
        table=TableSpec(center=place(experiment.table[0]), size=place(2.0 * experiment.table[1])),
        obstacles=tuple(
            BoxSpec(center=place(centre), size=place(2.0 * half))
            for centre, half in experiment.boxes
        ),
    )
