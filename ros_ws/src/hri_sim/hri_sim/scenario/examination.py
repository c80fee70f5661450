"""What a reach of a scenario is like when both nominal motions are carried out.

Only the nominal motions count here: the robot's from
:func:`~hri_sim.scenario.nominal.nominal_motion`, the person's without variability. No planner is
asked.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hri_planner.robot import RobotModel, load_robot
from hri_prediction.arm.geometry import ArmRadii, FloatArray
from hri_prediction.compiled import njit
from hri_prediction.geometry.minimum_jerk import minimum_jerk
from hri_sim.people.person import SimulatedPerson, nominal_motion_of
from hri_sim.scenario.nominal import nominal_goal, speed_share
from hri_sim.scenario.schema import PersonSpec, ReachSpec, Scenario, TableSpec, Vector3
from hri_sim.simulator.distances import arm_clearance

STEP_S = 0.02
"""Time step of the examination [s]."""
HOLD_S = 1.1
"""How long the goal posture must stay clear after arrival [s]."""

RULES = {
    "speed": "the robot's nominal motion keeps to 90 % of its speed limits",
    "table": "it stays clear of the table",
    "start": "its start is at least 10 cm clear of the person",
    "collision": "it collides with the person's reach",
    "goal": "its goal posture stays at least 3 cm clear for 1.1 s after arrival",
    "person_table": "the person's arm stays clear of the table",
}
"""What a reach must be like to be a fair test, in the order in which it is looked at."""


@dataclass(frozen=True)
class ReachReport:
    """Measures of one reach; distances are between surfaces [m], negative when they overlap.

    Attributes:
        clearance: Smallest robot-person distance during the nominal motion.
        start_clearance: The same at the start.
        staying_clearance: What ``clearance`` would be if the person stayed: positive where only the
            person's movement makes the collision.
        hold_clearance: Smallest distance of the goal posture for 1.1 s after arrival.
        table_clearance: Lowest point of the robot above the plane of the table top.
        person_table_clearance: Lowest point of the person's arm above that plane.
        speed_share: Highest joint speed as a share of its limit.
    """

    clearance: float
    start_clearance: float
    staying_clearance: float
    hold_clearance: float
    table_clearance: float
    person_table_clearance: float
    speed_share: float

    @property
    def broken_rule(self) -> str | None:
        """The first of `RULES` that the reach breaks; none when it is a fair test."""
        kept = {
            "speed": self.speed_share <= 0.9,
            "table": self.table_clearance > 0.0,
            "start": self.start_clearance >= 0.10,
            "collision": self.clearance < 0.0,
            "goal": self.hold_clearance >= 0.03,
            "person_table": self.person_table_clearance > 0.0,
        }
        return next((rule for rule in RULES if not kept[rule]), None)

    @property
    def accepted(self) -> bool:
        """Whether the reach is a fair test: nominally a collision, yet not a hopeless one."""
        return self.broken_rule is None


@dataclass(frozen=True, eq=False)
class RobotPart:
    """The robot's nominal motion of one reach, from its start to the end of the hold.

    Attributes:
        goal: Posture at the end (7,) [rad].
        time: (N,) [s] from the robot's start.
        q: Postures (N, 7) [rad].
        arrived: First row at the goal.
        table_clearance: See :class:`ReachReport`.
        speed_share: See :class:`ReachReport`.
    """

    goal: FloatArray
    time: FloatArray
    q: FloatArray
    arrived: int
    table_clearance: float
    speed_share: float


def robot_part(
    robot: RobotModel, q0: FloatArray, position: Vector3, duration: float, table: TableSpec
) -> RobotPart:
    """The robot's nominal motion from a posture q0 (7,) [rad] to a tool position [m].

    Raises:
        PlanningError: when the position is out of reach.
    """
    goal = nominal_goal(robot, q0, position)
    # A grid with the arrival on it.
    arrived = max(1, round(duration / STEP_S))
    time = np.arange(arrived + round(HOLD_S / STEP_S) + 1) * (duration / arrived)
    q = np.asarray(q0 + minimum_jerk(time / duration)[:, None] * (goal - q0), dtype=float)
    above = height_above_table(robot.frames(q[: arrived + 1]), robot.capsule_radii, table)
    speed = speed_share(robot, q0, goal, duration)
    return RobotPart(goal, time.astype(float), q, arrived, above, speed)


def height_above_table(points: FloatArray, radii: FloatArray, table: TableSpec) -> float:
    """Lowest point of an arm above the plane of the table top [m].

    Args:
        points: Its four points over time (N, 4, 3) [m]; capsules lie between them.
        radii: Of the capsules (3,) [m].
        table: The table.
    """
    ends = np.minimum(points[:, :-1, 2], points[:, 1:, 2])
    return float((ends - radii).min()) - table.top


def examine_reach(
    robot: RobotModel,
    part: RobotPart,
    spec: PersonSpec,
    person_from: Vector3,
    person_to: Vector3 | None,
    reach: ReachSpec,
    table: TableSpec,
) -> ReachReport:
    """Measure one reach.

    Args:
        robot: The robot.
        part: Its nominal motion.
        spec: The person.
        person_from: Hand tip before the reach [m].
        person_to: Hand tip after it [m]; none: the person stays.
        reach: Timing of the person.
        table: The table.
    """
    target = person_from if person_to is None else person_to
    person = nominal_motion_of(spec, person_from, target, reach.person_delay, reach.person_duration)
    return examine_motions(robot, part, person, table)


def examine_motions(
    robot: RobotModel, part: RobotPart, person: SimulatedPerson, table: TableSpec
) -> ReachReport:
    """Measure the robot's nominal motion beside what a person truly does.

    Args:
        robot: The robot.
        part: Its nominal motion.
        person: The person, at home until the reach, which is planned; time 0 is the robot's start.
        table: The table.
    """
    arm = person.truth(part.time)
    radii = ArmRadii().array
    distance = clearance_series(part.q, robot.lengths, robot.capsule_radii, arm, radii)
    return ReachReport(
        clearance=float(distance[: part.arrived + 1].min()),
        start_clearance=float(distance[0]),
        staying_clearance=staying_clearance(robot, part, person.spec, person.spec.home),
        hold_clearance=float(distance[part.arrived :].min()),
        table_clearance=part.table_clearance,
        person_table_clearance=height_above_table(arm, radii, table),
        speed_share=part.speed_share,
    )


def staying_clearance(
    robot: RobotModel, part: RobotPart, spec: PersonSpec, place: Vector3
) -> float:
    """Smallest robot-person distance [m] when the hand stays at ``place`` [m] all the time."""
    q = part.q[: part.arrived + 1]
    pose = spec.arm.posture(np.array(place), spec.swivel)
    arm = np.repeat(pose[None], len(q), axis=0)
    radii = ArmRadii().array
    return float(clearance_series(q, robot.lengths, robot.capsule_radii, arm, radii).min())


def examine_scenario(scenario: Scenario) -> list[ReachReport]:
    """Measure all reaches of a scenario, one after the other from nominal end to nominal end.

    Only the person who reaches is reckoned with. A scenario without persons gives no reports.

    Raises:
        PlanningError: when the robot cannot get to a target.
    """
    if not scenario.persons:
        return []
    robot, q = load_robot(), np.array(scenario.robot_start)
    reports = []
    for index, reach in enumerate(scenario.reaches):
        goal = scenario.targets[reach.robot_target]
        part = robot_part(robot, q, goal, reach.duration, scenario.table)
        target = None if reach.person_target is None else scenario.targets[reach.person_target]
        spec, start = scenario.person_of(index), scenario.person_from(index)
        reports.append(examine_reach(robot, part, spec, start, target, reach, scenario.table))
        q = part.goal
    return reports


@njit
def clearance_series(
    q: FloatArray,
    lengths: FloatArray,
    robot_radii: FloatArray,
    arms: FloatArray,
    limb_radii: FloatArray,
) -> FloatArray:
    """Smallest robot-person distance in each row.

    Args:
        q: Joint angles (N, 7) [rad].
        lengths: Lengths of the robot (4,) [m].
        robot_radii: Radii of the robot's capsules (3,) [m].
        arms: Keypoints of one arm (N, 4, 3) [m], base frame.
        limb_radii: Radii of its capsules (3,) [m].

    Returns:
        (N,) [m], signed.
    """
    points = np.empty((4, 3))
    series = np.empty(q.shape[0])
    for row in range(q.shape[0]):
        found = arm_clearance(q[row], lengths, robot_radii, arms[row : row + 1], limb_radii, points)
        series[row] = found[0]
    return series
