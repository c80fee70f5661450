"""One motion of the ptomp node: the goal, what has happened since, and how it ends."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hri_planner.ptomp.costs import TableBox
from hri_planner.ptomp.planner import PlannerSnapshot
from hri_planner.ptomp.result import ReplanResult
from hri_planner.ros.handover import Joint
from hri_planner.ros.inputs import NOBODY
from hri_prediction.ros.messages import ReachTarget

FloatArray = NDArray[np.float64]

STUCK_NS = 2_000_000_000
"""How long the tool may stay off the goal once its plan has ended there [ns]."""


@dataclass(frozen=True)
class Cycle:
    """What one replan was made from and for.

    Attributes:
        motion_number: The motion that it was made for; the newest one while its goal is held.
        handover_ns: When the plan takes effect, ROS time [ns].
        newest_sample_ns: Newest human sample that it used [ns].
        joint: Where it meets the plan before.
        before: The planner as it was, for when the plan is dropped.
        result: The plan and how it came about.
        compute_s: What it took [s].
    """

    motion_number: int
    handover_ns: int
    newest_sample_ns: int
    joint: Joint | None
    before: PlannerSnapshot
    result: ReplanResult
    compute_s: float

    def is_over(self, plan_time_s: float) -> bool:
        """Whether the plan has brought the tool to the goal by that time [s]."""
        if self.result.stage == "holding":
            return True
        return self.result.stage == "reaching" and plan_time_s >= self.result.plan.end_s - 1e-9


@dataclass
class Motion:
    """A goal under way.

    Attributes:
        handle: rclpy's goal handle.
        target: Tool position (3,) [m].
        duration_s: Wanted duration [s].
        accepted_ns: ROS time of acceptance [ns].
        number: Motions since the node started, from 1.
        lost_since_ns: Since when the inputs are away [ns]; none while they are there.
        over_since_ns: Since when the tool should have been at the goal [ns]; none before.
    """

    handle: Any
    target: FloatArray
    duration_s: float
    accepted_ns: int
    number: int
    started: bool = False
    cancelling: bool = False
    cancelled_ns: int | None = None
    ended: bool = False
    replans: int = 0
    misses: int = 0
    min_separation: float = NOBODY
    lost_since_ns: int | None = None
    over_since_ns: int | None = None
    costs: dict[str, float] = field(default_factory=dict)

    def is_held_up(self, now_ns: int, over: bool) -> bool:
        """Whether the tool is off the goal for too long after its plan was ``over``."""
        if not over:
            self.over_since_ns = None
        elif self.over_since_ns is None:
            self.over_since_ns = now_ns
        return self.over_since_ns is not None and now_ns - self.over_since_ns > STUCK_NS

    def end(self, outcome: int, reason: str, now_ns: int, goal_error: float) -> Any:
        """Mark the motion as over and make its result."""
        self.ended = True
        return ReachTarget.Result(
            outcome=outcome,
            reason=reason,
            duration=(now_ns - self.accepted_ns) * 1e-9,
            min_separation=self.min_separation,
            goal_error=goal_error,
            replans=self.replans,
            cost_names=list(self.costs),
            costs=list(self.costs.values()),
        )


def held_up(distance: float, table: TableBox | None) -> str:
    """What is said of a robot that does not get to where its plan ends, ``distance`` [m] off."""
    unseen = "" if table else ", which was given no table"
    return (
        f"the plan has ended at the goal, but the robot is held up {distance:.3f} m away: "
        f"something is in the way that the planner does not know{unseen}"
    )
