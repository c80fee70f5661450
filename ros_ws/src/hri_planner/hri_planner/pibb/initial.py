"""The policy that an experiment begins with: straight ways, raised just over what stands in them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from hri_planner.dmp.policy import PERIOD_S, DmpPolicy
from hri_planner.dmp.response import response
from hri_planner.robot.model import RobotModel
from hri_prediction.errors import PlanningError

FloatArray = NDArray[np.float64]

CLEAR_M = 0.025
"""Raised ways keep the tool's capsule clear of obstacles by so much [m]."""
_RAISE_M = 0.005
_MOST_RAISED_M = 0.6


def straight_policy(
    robot: RobotModel,
    posture: FloatArray,
    goals: Mapping[str, FloatArray],
    boxes: FloatArray,
    duration: float,
) -> DmpPolicy:
    """Straight ways with the speed of a bell, raised where an obstacle stands in the way.

    Args:
        robot: The robot.
        posture: In which it starts (7,) [rad].
        goals: Where ways lead (3,) [m], by name.
        boxes: Centre and half the size of obstacles (k, 2, 3) [m].
        duration: Of a motion [s].

    Raises:
        DataError: when they make no policy.
        PlanningError: when obstacles leave no way to a goal.
    """
    start = robot.frames(posture)[3]
    weights = {}
    fitted = response(duration, PERIOD_S)
    u = np.minimum(fitted.times / duration, 1.0)
    bell = u**3 * (10.0 + u * (-15.0 + 6.0 * u))
    margin = float(robot.capsule_radii[2]) + CLEAR_M
    for name, goal in goals.items():
        straight = start + bell[:, None] * (goal - start)
        raised, lift = straight, 0.0
        while lift < _MOST_RAISED_M and _gap(raised, boxes) < margin:
            lift += _RAISE_M
            raised = straight.copy()
            # In the middle of the way, as measured in space.
            raised[:, 2] += lift * 16.0 * (bell * (1.0 - bell)) ** 2
        if _gap(raised, boxes) < margin:
            raise PlanningError(
                f"an obstacle stands before goal {name}, and no way leads over it",
                expected=f"ways that are raised by less than {_MOST_RAISED_M} m",
                hint="move the goal or the obstacle",
            )
        weights[name] = fitted.fit(raised)
    return DmpPolicy(start, posture, dict(goals), weights, duration)


def _gap(path: FloatArray, boxes: FloatArray) -> float:
    """Smallest distance of a path (n, 3) from boxes (k, 2, 3) [m]."""
    gaps = [
        float(np.linalg.norm(np.maximum(np.abs(path - centre) - half, 0.0), axis=1).min())
        for centre, half in boxes
    ]
    return min(gaps, default=np.inf)
