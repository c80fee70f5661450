"""Generator of test conditions: a robot and a seated person reach through the same space.

Everything is drawn by one seed. What is drawn is kept when both nominal motions make it a fair test
(:class:`~hri_sim.scenario.examination.ReachReport`): they collide, but start and goal are clear and
the robot is neither too fast nor on the table. No planner's outcome is ever looked at.

The robot goes from side to side, the person from one place on the table to the next without going
back between. Reach i is drawn given reach i - 1; when a reach does not succeed, the generator goes
back and draws the one before it again.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from hri_planner.robot import RobotModel, load_robot
from hri_prediction.arm.geometry import FloatArray
from hri_prediction.errors import ConfigError, PlanningError
from hri_sim.scenario.examination import (
    RobotPart,
    examine_reach,
    robot_part,
    staying_clearance,
)
from hri_sim.scenario.schema import PersonSpec, ReachSpec, Scenario, TableSpec, Vector3

# Ranges of the benchmark [m], robot base frame.
SHOULDER = ((0.68, 0.85), (-0.20, 0.20), (0.36, 0.44))
TARGET = ((0.33, 0.60), (-0.25, 0.25), (0.08, 0.22))
ROBOT_X = (0.30, 0.60)
ROBOT_ABS_Y = (0.25, 0.50)
ROBOT_Z = (0.12, 0.35)
"""Height of the robot's start and goals: tool above the table, within the person's space."""
DELAY_S = (0.0, 0.6)
"""Start of the person's reach after the robot's: both are under way at the same time."""
DURATION_S = (1.0, 1.7)
ROBOT_DURATION_S = 1.5
SHORTEST_REACH_M = 0.15
"""Shortest distance between two successive places of the hand."""
STAYING_M = 0.02
"""With ``moving``: smallest clearance of the nominal motion if the hand stayed."""
MOVING_OVERLAP_M = -0.02
"""With ``moving``: largest clearance of the two nominal motions."""
CANDIDATES_APART_M = 0.12
"""Smallest distance between targets among which an observer must choose."""

_ROBOT_DRAWS = 40  # goals of the robot tried for one reach
_PERSON_DRAWS = 12  # targets and timings of the person tried for one goal
_STEPS_BACK = 12  # before a new person is drawn
_SCENES = 200  # persons tried before giving up
_CANDIDATE_DRAWS = 300  # places tried as further candidate targets of one reach
_ELBOW_UP = np.array([0.0, -0.4, 0.0, 1.5, 0.0, -0.8, 0.0])


@dataclass
class DrawCounts:
    """How much was drawn for one scenario; the acceptance rates follow from it.

    Attributes:
        scenes: Persons with home and start posture.
        robot_goals: Goals of the robot.
        robot_accepted: Goals with fair speed and a clear table.
        reaches: Person's targets and timings.
        reaches_accepted: Those that make a fair test.
    """

    scenes: int = 0
    robot_goals: int = 0
    robot_accepted: int = 0
    reaches: int = 0
    reaches_accepted: int = 0


@dataclass(frozen=True, eq=False)
class _Reach:
    """An accepted reach."""

    robot_goal: Vector3
    part: RobotPart
    person_target: Vector3
    spec: ReachSpec


@dataclass
class Drawing:
    """State of a generator: one source of randomness and what does not change.

    Attributes:
        rng: Source of all randomness.
        robot: The robot.
        side: Which arm persons use.
        table: The table.
        moving: See :func:`draw_scenario`.
        counts: How much has been drawn.
    """

    rng: np.random.Generator
    robot: RobotModel
    side: str
    table: TableSpec
    moving: bool = False
    counts: DrawCounts = field(default_factory=DrawCounts)

    def between(self, low: float, high: float) -> float:
        """An even draw, rounded to a millimetre (or millisecond): scenario files stay readable."""
        return round(float(self.rng.uniform(low, high)), 3)

    def point(self, box: tuple[tuple[float, float], ...]) -> Vector3:
        """A point of a box [m]."""
        x, y, z = (self.between(*bounds) for bounds in box)
        return x, y, z

    def robot_point(self, left: bool) -> Vector3:
        """A start or goal of the robot's tool on one side [m]."""
        y = self.between(*ROBOT_ABS_Y)
        return self.between(*ROBOT_X), y if left else -y, self.between(*ROBOT_Z)

    def start_posture(self, position: Vector3) -> FloatArray | None:
        """An elbow-up posture with the tool at a position, or none."""
        seed = _ELBOW_UP.copy()
        seed[0] = np.arctan2(position[1], position[0])
        try:
            posture = robot_part(self.robot, seed, position, 1.0, self.table).goal
        except PlanningError:
            return None
        return np.round(posture, 4) + 0.0  # adding 0.0 turns -0.0 into 0.0


def draw_scenario(
    seed: int,
    reaches: int = 3,
    *,
    ambiguous: bool = False,
    moving: bool = False,
    side: str = "right",
    counts: DrawCounts | None = None,
) -> Scenario:
    """Draw a scenario with a sequence of fair reaches.

    Args:
        seed: Equal arguments give equal scenarios.
        reaches: Number of reaches.
        ambiguous: Each reach gets two or three candidate targets for the person's hand, of which
            one is the true one: an observer can tell only by watching.
        moving: Only the person's movement may make the collisions: if the hand stayed, the nominal
            motion would pass at least 2 cm away, and as it moves, they overlap by at least 2 cm (so
            that motor variability does not undo the collision). Without it, in four of five
            reaches the arm is in the way before it moves, and prediction matters less.
        side: Which arm the person uses.
        counts: Filled with the number of draws, when given.

    Raises:
        ConfigError: when ``reaches`` is less than one or the side is unknown.
        PlanningError: when no scenario is found (not seen for up to six reaches).
    """
    if reaches < 1:
        raise ConfigError(f"reaches = {reaches!r}", expected="at least 1")
    if side not in ("left", "right"):
        raise ConfigError(f"side = {side!r}", expected="left or right")
    rng = np.random.default_rng((seed, reaches, ambiguous, moving, side == "left"))
    drawing = Drawing(rng, load_robot(), side, TableSpec(), moving)
    if counts is not None:
        drawing.counts = counts
    for _ in range(_SCENES):
        drawing.counts.scenes += 1
        person = draw_person(drawing)
        left = bool(rng.integers(2))
        q_start = drawing.start_posture(drawing.robot_point(left))
        if person is None or q_start is None:
            continue
        sequence = _draw_sequence(drawing, person, q_start, left, reaches)
        scenario = sequence and _scenario(drawing, seed, person, q_start, sequence, ambiguous)
        if scenario:
            return scenario
    raise PlanningError(
        f"no fair scenario with {reaches} reaches found for seed {seed}",
        hint="try another seed or fewer reaches",
    )


def vary_scenario(scenario: Scenario, seed: int, tries: int = 500) -> Scenario:
    """Another condition of the same task: same places, new timing and motor noise.

    Args:
        scenario: The task, a drawn scenario.
        seed: Seed of the new condition; also the scenario's new seed.
        tries: Timings tried for each reach.

    Raises:
        PlanningError: when no timing makes a fair test.
    """
    rng = np.random.default_rng((scenario.seed, seed))
    drawing = Drawing(rng, load_robot(), "right", scenario.table)
    q = np.array(scenario.robot_start)
    specs = []
    for index, reach in enumerate(scenario.reaches):
        goal = scenario.targets[reach.robot_target]
        part = robot_part(drawing.robot, q, goal, reach.duration, scenario.table)
        person, start = scenario.person_of(index), scenario.person_from(index)
        target = None if reach.person_target is None else scenario.targets[reach.person_target]
        for _ in range(tries):
            timing = {
                "person_delay": drawing.between(*DELAY_S),
                "person_duration": drawing.between(*DURATION_S),
            }
            spec = reach.model_copy(update=timing)
            report = examine_reach(drawing.robot, part, person, start, target, spec, scenario.table)
            if report.accepted:
                break
        else:
            raise PlanningError(f"no fair timing of reach {index} of {scenario.name} found")
        specs.append(spec)
        q = part.goal
    name = f"{scenario.name}_condition_{seed}"
    return scenario.model_copy(update={"name": name, "seed": seed, "reaches": tuple(specs)})


def draw_person(drawing: Drawing) -> PersonSpec | None:
    """A person whose hand can rest at a place on the table, or none."""
    shoulder, home = drawing.point(SHOULDER), drawing.point(TARGET)
    try:
        return PersonSpec.model_validate({"side": drawing.side, "shoulder": shoulder, "home": home})
    except ValueError:
        return None  # the home is out of reach


def _draw_sequence(
    drawing: Drawing, person: PersonSpec, q_start: FloatArray, left: bool, reaches: int
) -> list[_Reach] | None:
    """Draw the reaches of one scene, going back where no next one is found; or none."""
    sequence: list[_Reach] = []
    steps_back = 0
    while len(sequence) < reaches:
        q = sequence[-1].part.goal if sequence else q_start
        place = sequence[-1].person_target if sequence else person.home
        to_left = left == (len(sequence) % 2 == 1)
        reach = _draw_reach(drawing, person, q, place, to_left, len(sequence) + 1)
        if reach is not None:
            sequence.append(reach)
            continue
        steps_back += 1
        if not sequence or steps_back > _STEPS_BACK:
            return None
        sequence.pop()
    return sequence


def _draw_reach(
    drawing: Drawing,
    person: PersonSpec,
    q: FloatArray,
    place: Vector3,
    to_left: bool,
    number: int,
) -> _Reach | None:
    """Draw a fair reach from posture ``q``, the hand being at ``place``; or none."""
    robot, table, counts = drawing.robot, drawing.table, drawing.counts
    for _ in range(_ROBOT_DRAWS):
        counts.robot_goals += 1
        goal = drawing.robot_point(to_left)
        try:
            part = robot_part(robot, q, goal, ROBOT_DURATION_S, table)
        except PlanningError:
            continue
        if part.speed_share > 0.9 or part.table_clearance <= 0.0:
            continue
        if drawing.moving and staying_clearance(robot, part, person, place) < STAYING_M:
            continue
        counts.robot_accepted += 1
        for _ in range(_PERSON_DRAWS):
            counts.reaches += 1
            target = drawing.point(TARGET)
            spec = ReachSpec(
                robot_target=f"robot_{number}",
                person_target=f"person_{number}",
                person_delay=drawing.between(*DELAY_S),
                person_duration=drawing.between(*DURATION_S),
                duration=ROBOT_DURATION_S,
            )
            apart = float(np.linalg.norm(np.subtract(target, place)))
            if apart < SHORTEST_REACH_M or not person.arm.can_reach(target):
                continue
            report = examine_reach(robot, part, person, place, target, spec, table)
            if report.start_clearance < 0.10:
                return None  # neither goal nor target can mend where both stand now
            if report.accepted and (not drawing.moving or report.clearance <= MOVING_OVERLAP_M):
                counts.reaches_accepted += 1
                return _Reach(goal, part, target, spec)
    return None


def draw_candidates(
    drawing: Drawing, person: PersonSpec, place: Vector3, target: Vector3
) -> list[Vector3]:
    """One or two other targets that the person might be reaching for from ``place``."""
    wanted = int(drawing.rng.integers(1, 3))
    others: list[Vector3] = []
    for _ in range(_CANDIDATE_DRAWS):
        other = drawing.point(TARGET)
        gaps = [float(np.linalg.norm(np.subtract(other, p))) for p in (target, *others)]
        length = float(np.linalg.norm(np.subtract(other, place)))
        if min(gaps) < CANDIDATES_APART_M or length < SHORTEST_REACH_M:
            continue
        if person.arm.can_reach(other):
            others.append(other)
        if len(others) == wanted:
            break
    return others


def _scenario(
    drawing: Drawing,
    seed: int,
    person: PersonSpec,
    q_start: FloatArray,
    sequence: list[_Reach],
    ambiguous: bool,
) -> Scenario | None:
    """The accepted reaches as a scenario; none when candidates are wanted and none were found."""
    targets: dict[str, Vector3] = {}
    specs = []
    place = person.home
    for number, reach in enumerate(sequence, start=1):
        targets[f"robot_{number}"] = reach.robot_goal
        targets[f"person_{number}"] = reach.person_target
        spec = reach.spec
        if ambiguous:
            others = draw_candidates(drawing, person, place, reach.person_target)
            if not others:
                return None
            names = [f"person_{number}_{letter}" for letter in "bc"[: len(others)]]
            targets.update(zip(names, others, strict=True))
            candidates = (f"person_{number}", *names)
            spec = spec.model_copy(update={"person_candidates": candidates})
        specs.append(spec)
        place = reach.person_target
    return Scenario.model_validate(
        {
            "name": f"drawn_{seed}",
            "seed": seed,
            "robot_start": tuple(float(angle) for angle in q_start),
            "table": drawing.table,
            "targets": targets,
            "persons": (person,),
            "reaches": tuple(specs),
        }
    )
