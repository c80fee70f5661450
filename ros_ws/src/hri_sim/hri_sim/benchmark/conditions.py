"""The conditions of the benchmark: 30 tasks of 15 conditions to test on, and others to tune on.

A task is a person who reaches from a home to a target, or to one of two or three, which only
watching tells (ambiguous intent); its predictor learns from 25 recorded reaches to each. A
condition is one repetition of such a reach, as it truly happens with its motor variability, and a
start and goal of the robot on opposite sides. A condition is kept if the robot's nominal motion
makes it a fair test of the `RULES`; no planner is ever asked.

Everything follows from the names of split, task and condition: whatever is drawn, in whatever
order and process, it is the same.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from hri_planner.robot import load_robot
from hri_prediction.errors import ConfigError, PlanningError
from hri_sim.people.person import SimulatedPerson
from hri_sim.people.seeding import reach_generator
from hri_sim.scenario.conditions import (
    CANDIDATES_APART_M,
    DELAY_S,
    DURATION_S,
    ROBOT_DURATION_S,
    SHORTEST_REACH_M,
    TARGET,
    Drawing,
    draw_candidates,
    draw_person,
)
from hri_sim.scenario.examination import RULES, examine_motions, robot_part
from hri_sim.scenario.schema import PersonSpec, ReachSpec, Scenario, TableSpec, Vector3

SPLITS = ("tuning", "test")
TASKS = 30
CONDITIONS_A_TASK = 15
AMBIGUOUS_EVERY = 5
"""Every so manieth task is ambiguous: six of thirty."""
ROBOT_GOAL = "robot_goal"

_ENTROPY = 20141203  # of all draws; changing it makes another benchmark
_TASK_TRIES = 50
_TRIES = 400  # draws of one condition before its task is given up

TASK_RULES = {
    "home": "the person's hand gets to its home",
    "target": f"the targets are within its reach, {100 * SHORTEST_REACH_M:.0f} cm and more from "
    f"home, {100 * CANDIDATES_APART_M:.0f} cm and more from each other",
    "conditions": f"each condition is found within {_TRIES} draws",
}
"""What a task must be like, in the order in which it is looked at."""
CONDITION_RULES = {"reach": "the robot's start and goal are within its reach", **RULES}
"""What a condition must be like, in the order in which it is looked at."""


@dataclass(frozen=True)
class Task:
    """A person and where the hand goes.

    Attributes:
        split: ``tuning`` or ``test``.
        number: From 0.
        person: Who it is; the hand is at home before a reach.
        targets: Of the hand tip, by name [m]; several where the intent is ambiguous.
    """

    split: str
    number: int
    person: PersonSpec
    targets: dict[str, Vector3]

    @property
    def ambiguous(self) -> bool:
        """Whether only watching tells where the hand goes."""
        return len(self.targets) > 1


@dataclass(frozen=True)
class Condition:
    """One reach of the robot beside one of the person.

    Attributes:
        task: Whose reach it is.
        number: From 0, within the task.
        scenario: Scene, places and timing; a live run of it sees the same person.
        staying_clearance: Of the nominal motion if the hand stayed at home [m]: positive where
            only the person's movement makes the collision.
    """

    task: Task
    number: int
    scenario: Scenario
    staying_clearance: float

    @property
    def robot_goal(self) -> Vector3:
        """Goal of the robot's tool [m]."""
        return self.scenario.targets[ROBOT_GOAL]

    def person(self) -> SimulatedPerson:
        """The person as the reach truly happens; time 0 is the robot's start."""
        return person_of(self.scenario)


@dataclass(frozen=True)
class TaskConditions:
    """A task and all its conditions.

    Attributes:
        task: The task.
        conditions: In order.
        drawn: How many tasks and conditions were drawn for it: ``tasks``, ``conditions``.
        rejected: How many of them each rule turned down, the first that was broken.
    """

    task: Task
    conditions: tuple[Condition, ...]
    drawn: Counter[str]
    rejected: Counter[str]


def person_of(scenario: Scenario) -> SimulatedPerson:
    """The person of a condition's scenario, whose reach is planned."""
    (spec,), (reach,) = scenario.persons, scenario.reaches
    assert reach.person_target is not None
    person = SimulatedPerson(spec, scenario.seed)
    rng = reach_generator(scenario.seed, spec.id, 0)
    target = scenario.targets[reach.person_target]
    person.plan_reach(target, reach.person_delay, reach.person_duration, rng)
    return person


def check_split(split: str) -> None:
    """Refuse an unknown split.

    Raises:
        ConfigError: naming those that exist.
    """
    if split not in SPLITS:
        raise ConfigError(f"split {split}", expected="one of " + ", ".join(SPLITS))


@lru_cache(maxsize=4 * TASKS)
def task_conditions(split: str, number: int) -> TaskConditions:
    """Draw a task and its conditions.

    Args:
        split: ``tuning`` or ``test``; their tasks are drawn apart.
        number: Of the task, from 0.

    Raises:
        ConfigError: for an unknown split.
        PlanningError: when no task of this number is found (not seen).
    """
    check_split(split)
    drawn: Counter[str] = Counter()
    rejected: Counter[str] = Counter()
    for attempt in range(_TASK_TRIES):
        key = (SPLITS.index(split), number, attempt)
        seeds = np.random.SeedSequence(_ENTROPY, spawn_key=key).spawn(1 + CONDITIONS_A_TASK)
        drawn["tasks"] += 1
        task = _draw_task(split, number, _drawing(seeds[0]), rejected)
        if task is None:
            continue
        conditions = []
        for index, seed in enumerate(seeds[1:]):
            condition = _draw_condition(task, index, _drawing(seed), drawn, rejected)
            if condition is None:
                rejected["conditions"] += 1
                break
            conditions.append(condition)
        else:
            return TaskConditions(task, tuple(conditions), drawn, rejected)
    raise PlanningError(f"no fair task {number} of {split} found in {_TASK_TRIES} draws")


def _drawing(seed: np.random.SeedSequence) -> Drawing:
    return Drawing(np.random.default_rng(seed), load_robot(), "right", TableSpec())


def _draw_task(split: str, number: int, drawing: Drawing, rejected: Counter[str]) -> Task | None:
    """A person with home and target, and further ones where the intent is ambiguous; or none."""
    person = draw_person(drawing)
    target = drawing.point(TARGET)
    if person is None:
        rejected["home"] += 1
        return None
    length = float(np.linalg.norm(np.subtract(target, person.home)))
    ambiguous = number % AMBIGUOUS_EVERY == AMBIGUOUS_EVERY - 1
    usable = length >= SHORTEST_REACH_M and person.arm.can_reach(target)
    others = draw_candidates(drawing, person, person.home, target) if usable and ambiguous else []
    if not usable or (ambiguous and not others):
        rejected["target"] += 1
        return None
    places = [target, *others]
    return Task(split, number, person, {f"person_{i}": p for i, p in enumerate(places, 1)})


def _draw_condition(
    task: Task, number: int, drawing: Drawing, drawn: Counter[str], rejected: Counter[str]
) -> Condition | None:
    """A fair condition of a task; none when it is not found soon.

    Where the hand truly goes is drawn first and kept, so that fair tests of one target do not
    make it likelier than the others.
    """
    names = tuple(task.targets)
    truth = names[int(drawing.rng.integers(len(names)))]
    for _ in range(_TRIES):
        drawn["conditions"] += 1
        left = bool(drawing.rng.integers(2))
        q_start = drawing.start_posture(drawing.robot_point(left))
        goal = drawing.robot_point(not left)
        reach = ReachSpec(
            robot_target=ROBOT_GOAL,
            person_target=truth,
            person_delay=drawing.between(*DELAY_S),
            person_duration=drawing.between(*DURATION_S),
            person_candidates=names if task.ambiguous else (),
            duration=ROBOT_DURATION_S,
        )
        seed = int(drawing.rng.integers(2**31))
        try:
            if q_start is None:
                raise PlanningError("the start is out of reach")
            part = robot_part(drawing.robot, q_start, goal, reach.duration, drawing.table)
        except PlanningError:
            rejected["reach"] += 1
            continue
        scenario = Scenario.model_validate(
            {
                "name": f"{task.split}_{task.number}_{number}",
                "seed": seed,
                "robot_start": tuple(float(angle) for angle in q_start),
                "table": drawing.table,
                "targets": {ROBOT_GOAL: goal, **task.targets},
                "persons": (task.person,),
                "reaches": (reach,),
            }
        )
        report = examine_motions(drawing.robot, part, person_of(scenario), drawing.table)
        if report.broken_rule is None:
            return Condition(task, number, scenario, report.staying_clearance)
        rejected[report.broken_rule] += 1
    return None
