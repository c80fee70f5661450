"""The final posture: all postures reach the goal, one suits the person best (section 6.4).

The constraint that the tool is at the goal holds exactly: postures are solutions of the inverse
kinematics over its redundancy, and the present motion is warped to each.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hri_planner.ptomp.motion import Grid, Motion
from hri_planner.robot.ik import ik_candidates
from hri_planner.robot.model import RobotModel

FloatArray = NDArray[np.float64]

_MIN_KNOTS = 7
_LARGEST_CHANGE = 1.5  # rad: beyond this no warp of the rest of a motion is worth its speed


def posture_motions(
    motion: Motion,
    grid: Grid,
    robot: RobotModel,
    goal: FloatArray,
    count: int,
    rng: np.random.Generator,
) -> list[Motion]:
    """The motion warped to other final postures with the tool at the goal.

    Args:
        motion: A motion that arrives.
        grid: Its grid.
        robot: The robot.
        goal: Tool goal (3,) [m].
        count: Starting points of the inverse kinematics.
        rng: Draws them.

    Returns:
        Possibly no motion at all: too late, or nothing else is near.
    """
    arrival = motion.arrival
    if arrival is None or arrival < _MIN_KNOTS or count == 0:
        return []
    present = motion.q[arrival]
    x = np.clip(np.arange(grid.knots) / arrival, 0.0, 1.0)[:, None]
    blend = x**3 * (10.0 - 15.0 * x + 6.0 * x * x)
    motions = []
    for posture in ik_candidates(robot, goal, present, rng, count=count):
        change = posture - present
        size = float(np.abs(change).max())
        if 0.02 < size < _LARGEST_CHANGE:
            motions.append(motion.moved(blend * change, grid.step, "posture"))
    return motions
