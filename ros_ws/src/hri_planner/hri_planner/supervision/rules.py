"""By what motions are judged."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Rules:
    """By what a motion is judged.

    Attributes:
        interval_ns: Time between hand-overs [ns].
        transport_ns: A plan must be ready so long before its hand-over [ns].
        late_timeout_s: A replan that is late by this much stops the robot [s].
        lost_timeout_s: A motion that is paused for so long is given up [s].
        max_duration_s: A motion that takes longer is given up [s].
        goal_tolerance: Distance of the tool at which the goal counts as reached [m].
        rest_speed: Joint speed below which the robot counts as at rest [rad/s].
        heartbeat: Whether the speed scale is ours; else only a dropped trajectory stops the robot.
        plans_once: Whether the planner plans once, and before the robot sets off has as long for it as
            others have during the motion.
        knows_table: Whether the planner was given a table.
    """

    interval_ns: int
    transport_ns: int
    late_timeout_s: float
    lost_timeout_s: float
    max_duration_s: float
    goal_tolerance: float
    rest_speed: float
    heartbeat: bool
    plans_once: bool
    knows_table: bool
