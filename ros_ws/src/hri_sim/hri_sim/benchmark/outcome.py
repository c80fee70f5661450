"""What became of one condition, measured on the true motions of robot and person."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hri_planner.robot import RobotModel
from hri_prediction.arm.geometry import ArmRadii, FloatArray
from hri_sim.scenario.examination import clearance_series, height_above_table
from hri_sim.scenario.schema import TableSpec

GOAL_M = 0.01
"""The goal is reached when the tool is this near to it, and the robot at rest."""
REST_SPEED = 0.02
"""Joint speed below which the robot is at rest [rad/s]."""
LIMIT_S = 10.0
"""A robot that has not arrived by then has failed [s]."""
HOLD_S = 0.6
"""How long the robot is watched at the goal [s]."""
SPEED_SHARE = 1.05
"""Largest joint speed of a strict success, as a share of the limit."""
CLEARANCES_M = (0.02, 0.05)


@dataclass(frozen=True)
class Execution:
    """Robot and person at 250 Hz.

    Attributes:
        step_s: Time between rows [s].
        q: Joint angles (N, 7) [rad], from the start of the motion to the end of the hold.
        qd: [rad/s].
        qdd: [rad/s^2].
        arm: True keypoints of the person (N, 4, 3) [m].
        arrived: First row at rest at the goal; none when the robot did not get there.
    """

    step_s: float
    q: FloatArray
    qd: FloatArray
    qdd: FloatArray
    arm: FloatArray
    arrived: int | None


@dataclass(frozen=True)
class Outcome:
    """Measures of one condition; the motion ends with the arrival, or with the time limit.

    Attributes:
        clearance: Smallest distance of robot and person during the motion [m], negative if they
            overlap.
        hold_clearance: The same at the goal for 0.6 s; none without arrival.
        goal_error: Of the tool at the end of the motion [m].
        hold_error: Largest at the goal for 0.6 s [m]; none without arrival.
        time_to_goal: When the robot is at rest at the goal [s]; none without arrival.
        speed_share: Highest joint speed, as a share of its limit.
        table_clearance: Lowest point of the robot above the table [m].
        accel_cost: Integral of the squared joint accelerations over the motion [rad^2/s^3].
        time_to_collision: Smallest clearance divided by the speed at which it shrinks [s]; zero after
            a collision, none if it never shrinks.
        replans: How many were made.
        failures: How many of them gave no plan, or one that the robot's controller refused.
        iterations: Optimisation steps of all.
        tracking_error: Largest distance of a joint from the plan [rad]; zero on paper.
    """

    clearance: float
    hold_clearance: float | None
    goal_error: float
    hold_error: float | None
    time_to_goal: float | None
    speed_share: float
    table_clearance: float
    accel_cost: float
    time_to_collision: float | None
    replans: int
    failures: int
    iterations: int
    tracking_error: float = 0.0

    @property
    def ok(self) -> bool:
        """No contact during the motion, and the goal reached to 1 cm."""
        return self.clearance > 0.0 and self.time_to_goal is not None

    @property
    def strict(self) -> bool:
        """Ok, held for 0.6 s without contact, limits kept, table clear."""
        return (
            self.ok
            and self.hold_clearance is not None
            and self.hold_clearance > 0.0
            and self.hold_error is not None
            and self.hold_error <= GOAL_M
            and self.speed_share <= SPEED_SHARE
            and self.table_clearance > 0.0
        )

    def clear(self, distance: float) -> bool:
        """Ok with at least this clearance [m]."""
        return self.ok and self.clearance >= distance


def goal_errors(robot: RobotModel, q: FloatArray, goal: FloatArray) -> FloatArray:
    """Distance of the tool from the goal (N,) [m] in postures (N, 7) [rad]."""
    return np.asarray(np.linalg.norm(robot.frames(q)[:, 3] - goal, axis=1))


def resting_at(robot: RobotModel, q: FloatArray, qd: FloatArray, goal: FloatArray) -> int | None:
    """The first of the rows in which the robot rests at the goal."""
    there = goal_errors(robot, q, goal) <= GOAL_M
    there &= np.abs(qd).max(axis=1) < REST_SPEED
    return int(np.argmax(there)) if there.any() else None


def measure(
    robot: RobotModel,
    run: Execution,
    goal: FloatArray,
    table: TableSpec,
    *,
    replans: int,
    failures: int,
    iterations: int,
    tracking_error: float = 0.0,
) -> Outcome:
    """Measure an execution; see :class:`Outcome`."""
    radii = robot.capsule_radii
    distance = clearance_series(run.q, robot.lengths, radii, run.arm, ArmRadii().array)
    error = goal_errors(robot, run.q, goal)
    end = len(distance) if run.arrived is None else run.arrived + 1
    motion, hold = slice(0, end), slice(end - 1, None)
    arrived = run.arrived is not None
    return Outcome(
        clearance=float(distance[motion].min()),
        hold_clearance=float(distance[hold].min()) if arrived else None,
        goal_error=float(error[end - 1]),
        hold_error=float(error[hold].max()) if arrived else None,
        time_to_goal=(end - 1) * run.step_s if arrived else None,
        speed_share=float((np.abs(run.qd) / robot.velocity).max()),
        table_clearance=height_above_table(robot.frames(run.q), radii, table),
        accel_cost=float((run.qdd[motion] ** 2).sum() * run.step_s),
        time_to_collision=time_to_collision(distance[motion], run.step_s),
        replans=replans,
        failures=failures,
        iterations=iterations,
        tracking_error=tracking_error,
    )


def time_to_collision(distance: FloatArray, step_s: float) -> float | None:
    """Smallest time after which contact would come if the distance (N,) [m] went on shrinking [s].

    None if it never shrinks.
    """
    if distance.min() <= 0.0:
        return 0.0
    closing = -np.diff(distance) / step_s
    near = closing > 1e-9
    return float((distance[1:][near] / closing[near]).min()) if near.any() else None
