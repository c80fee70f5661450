"""One motion of the ptomp node: the goal, what has happened since, and how it ends."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hri_planner.ros.inputs import NOBODY
from hri_prediction.ros.messages import ReachTarget

FloatArray = NDArray[np.float64]


@dataclass
class Motion:
    """A goal under way.

    Attributes:
        handle: rclpy's goal handle.
        target: Tool position (3,) [m].
        duration_s: Wanted duration [s].
        accepted_ns: ROS time of acceptance [ns].
        number: Motions since the node started, from 1.
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
    costs: dict[str, float] = field(default_factory=dict)

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
