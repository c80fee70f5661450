"""A whole experiment with one simulated person, without ROS, and what the person makes of the policies."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hri_planner.dmp.policy import DmpPolicy
from hri_planner.pibb.costs import Terms
from hri_planner.pibb.experiment import Experiment
from hri_planner.pibb.session import Result, Session
from hri_planner.robot.model import RobotModel
from hri_prediction.errors import DataError
from hri_sim.readability.participant import Participant
from hri_sim.readability.traits import Traits, draw_other_traits, draw_traits
from hri_sim.readability.trial import Bench

FloatArray = NDArray[np.float64]

TRAITS, TRIALS, LEARNING, EVALUATION, OTHERS = range(5)
"""Streams of random numbers of a seed."""
MOST_IN_ROW = 5
"""So many trials one after the other that are broken off end it, as in the graph."""


def generator(seed: int, stream: int) -> np.random.Generator:
    """One of a seed's streams."""
    return np.random.default_rng([seed, stream])


@dataclass(frozen=True)
class Reading:
    """How people read a policy, over some trials of each goal.

    Attributes:
        trials: How many; figures are of those in which the robot arrived and the person answered.
        prediction_time: Mean J_pred [s].
        decision_time: Mean time until the person showed the goal, without the hand's way [s].
        error: Share of wrong guesses.
        human_duration: Mean duration of the hand's motion [s].
        clearance: Smallest of all trials [m].
        contacts: Trials in which the robot touched the person, an obstacle or the table.
        broken_off: Trials in which the robot did not arrive, or the person did not answer.
    """

    trials: int
    prediction_time: float
    decision_time: float
    error: float
    human_duration: float
    clearance: float
    contacts: int
    broken_off: int


def read_policy(bench: Bench, policy: DmpPolicy, traits: Traits, seed: int, trials: int) -> Reading:
    """Let a person read a policy; the same seed draws the same person's moods for any policy."""
    times, shown, wrong, durations, gaps = [], [], [], [], []
    broken_off = 0
    for index, goal in enumerate(policy.names):
        for number in range(trials):
            rng = np.random.default_rng([seed, EVALUATION, index, number])
            participant = _participant(bench.experiment, traits, rng)
            record = bench.run(policy, goal, participant)
            gaps.append(record.clearance)
            if not record.counts:
                broken_off += 1
                continue
            times.append(record.response_s)
            shown.append(record.shown_s)
            wrong.append(record.guess != goal)
            durations.append(record.hand_s)
    if not times:
        raise DataError(
            f"a policy was read by person {seed} in none of {len(gaps)} trials",
            expected="a robot that arrives, and a person who answers",
        )
    return Reading(
        trials=len(gaps),
        prediction_time=float(np.mean(times)),
        decision_time=float(np.mean(shown)),
        error=float(np.mean(wrong)),
        human_duration=float(np.mean(durations)),
        clearance=float(np.min(gaps)),
        contacts=int(np.sum(np.array(gaps) <= 0.0)),
        broken_off=broken_off,
    )


@dataclass(frozen=True, eq=False)
class Learnt:
    """What came of an experiment with one person.

    Attributes:
        seed: Of the person and of all that was drawn.
        traits: Of the person.
        first: The policy before.
        last: The policy after.
        means: The policy that each update began with, and what the last one made of it.
        units: What terms of the costs were compared with, by goal.
        results: Of all trials, in their order.
        before: How the person reads the first policy.
        after: How the person reads the last one.
        others_before: How a person of another kind reads the first.
        others_after: How that person reads the last.
        contacts: Trials of the experiment in which the robot touched the person, an obstacle or the table.
        from_person: Smallest distance of robot and person in the experiment [m].
        from_obstacles: Of robot and boxes or table [m].
        broken_off: Trials that were made again, for the robot did not arrive, or the person did not answer.
    """

    seed: int
    traits: Traits
    first: DmpPolicy
    last: DmpPolicy
    means: tuple[DmpPolicy, ...]
    units: dict[str, Terms]
    results: tuple[Result, ...]
    before: Reading
    after: Reading
    others_before: Reading
    others_after: Reading
    contacts: int
    from_person: float
    from_obstacles: float
    broken_off: int

    @property
    def improved(self) -> bool:
        """Whether the person takes at least 10 % less time, and is not wrong more often."""
        return (
            self.after.prediction_time <= 0.9 * self.before.prediction_time
            and self.after.error <= self.before.error
        )


def learn(
    robot: RobotModel,
    experiment: Experiment,
    seed: int,
    *,
    first: DmpPolicy | None = None,
    readings: int = 40,
    on_trial: Callable[[Result], None] = lambda result: None,
) -> Learnt:
    """Let a policy improve by one simulated person.

    Args:
        robot: The robot.
        experiment: What is done.
        seed: Of person and trials.
        first: The policy to begin with; none: the experiment's initial one.
        readings: Trials of each goal, before and after, by which policies are compared.
        on_trial: Called after each trial.

    Raises:
        DataError: when too many trials in a row are broken off.
    """
    bench = Bench(robot, experiment)
    traits = draw_traits(generator(seed, TRAITS), len(experiment.goals))
    others = draw_other_traits(generator(seed, OTHERS), len(experiment.goals))
    begun = first or experiment.initial_policy(robot)
    session = Session.begin(experiment, begun, generator(seed, LEARNING))
    participant = _participant(experiment, traits, generator(seed, TRIALS))
    means: list[DmpPolicy] = [begun]
    contacts, from_person, from_obstacles = 0, np.inf, np.inf
    broken_off = in_row = 0
    while (trial := session.next_trial()) is not None:
        policy = session.policy_of(trial)
        record = bench.run(policy, trial.goal, participant)
        contacts += record.clearance <= 0.0
        from_person = min(from_person, record.from_person)
        from_obstacles = min(from_obstacles, record.from_obstacles)
        if not record.counts:
            broken_off, in_row = broken_off + 1, in_row + 1
            if in_row == MOST_IN_ROW:
                raise DataError(
                    f"person {seed}, {trial.goal}: {in_row} trials in a row broken off",
                    expected="a robot that arrives, and a person who answers",
                )
            continue
        in_row = 0
        terms = record.terms(policy, trial.goal, session.indistinctness(trial))
        on_trial(session.finish(trial, record.guess, terms, record.clearance))
        if session.state.policy is not means[-1]:
            means.append(session.state.policy)
    last = session.state.policy
    return Learnt(
        seed=seed,
        traits=traits,
        first=begun,
        last=last,
        means=tuple(means),
        units=session.state.units,
        results=session.state.results,
        before=read_policy(bench, begun, traits, seed, readings),
        after=read_policy(bench, last, traits, seed, readings),
        others_before=read_policy(bench, begun, others, seed, readings),
        others_after=read_policy(bench, last, others, seed, readings),
        contacts=contacts,
        from_person=from_person,
        from_obstacles=from_obstacles,
        broken_off=broken_off,
    )


def _participant(experiment: Experiment, traits: Traits, rng: np.random.Generator) -> Participant:
    return Participant(traits, experiment.targets, hand=experiment.response == "hand", rng=rng)
