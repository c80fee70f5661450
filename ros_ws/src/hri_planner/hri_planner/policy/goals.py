"""Goals that a tool can be sent to."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hri_planner.policy.stretch import Limits
from hri_planner.robot.ik import solve_ik
from hri_planner.robot.model import RobotModel
from hri_prediction.errors import PlanningError

FloatArray = NDArray[np.float64]

SLACK_M = 0.003
"""So much nearer to a box than the tool keeps a goal may be: the tool arrives all the same [m]."""


def check_goal(
    robot: RobotModel, goal: FloatArray, q: FloatArray, limits: Limits, rng: np.random.Generator
) -> None:
    """Check a goal.

    Args:
        robot: The robot.
        goal: Where its tool is to go (3,) [m], base frame.
        q: Joint angles (7,) [rad] from which a posture is looked for.
        limits: What the tool keeps to.
        rng: Draws where the search begins.

    Raises:
        PlanningError: when it is not finite, below the floor, in a box, or no posture reaches it.
    """
    if np.shape(goal) != (3,) or not np.isfinite(goal).all():
        raise PlanningError(f"goal {goal}", expected="three finite coordinates in m")
    if limits.floor is not None and goal[2] < limits.floor:
        raise PlanningError(
            f"goal height {goal[2]:.3f} m puts the hand into the table",
            expected=f"at least {limits.floor:.3f} m",
        )
    for box, (centre, half) in enumerate(limits.boxes):
        gap = float(np.linalg.norm(np.maximum(np.abs(goal - centre) - half, 0.0)))
        if gap < limits.margin - SLACK_M:
            raise PlanningError(
                f"goal ({', '.join(f'{v:.3f}' for v in goal)}) is {100 * gap:.1f} cm from box {box}",
                expected=f"at least {100 * limits.margin:.1f} cm, the tool's radius and box_margin",
            )
    solve_ik(robot, np.array(goal, dtype=float), np.array(q, dtype=float), rng)
