"""How near the robot came to people, obstacles and the table."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hri_planner.policy.link_bounds import box_clearance
from hri_planner.robot.model import RobotModel

FloatArray = NDArray[np.float64]


class Nearness:
    """The smallest distance so far.

    Args:
        robot: The robot.
        solids: Centre and half the size of boxes, the table among them (k, 2, 3) [m], base frame.

    Attributes:
        distance: Between surfaces [m]; infinite so far, negative where they overlapped.
    """

    def __init__(self, robot: RobotModel, solids: FloatArray) -> None:
        self._robot, self._solids = robot, solids
        self.distance = float("inf")

    def take(self, q: FloatArray, from_people: float) -> None:
        """Take joint angles (7,) [rad], and the distance from people there [m]."""
        from_solids = box_clearance(self._robot, q[None], self._solids)
        self.distance = min(self.distance, from_people, from_solids)

    def join(self, other: Nearness) -> None:
        """What another one has seen counts here too."""
        self.distance = min(self.distance, other.distance)
