"""Ways around: bumps in the present motion, and places to retreat to."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from hri_planner.ptomp.forecast import HumanForecast
from hri_planner.ptomp.motion import Grid, Motion, to_posture
from hri_planner.ptomp.timing import fastest_duration
from hri_planner.robot.ik import newton_to_position
from hri_planner.robot.model import RobotModel

FloatArray = NDArray[np.float64]

_TOLERANCE = 1e-3
_SHIFTS = ((0.0, 0.0, 0.12), (0.0, 0.0, 0.25), (-0.12, 0.0, 0.10), (-0.25, 0.0, 0.05))
_WINDOWS = ((0.0, 1.0), (0.0, 0.65), (0.35, 1.0))
_AWAY = 0.2
_MIN_KNOTS = 7


def _shifted_posture(robot: RobotModel, q: FloatArray, shift: FloatArray) -> FloatArray | None:
    """The nearest posture with the tool moved by a vector (3,); None when there is none."""
    posture = np.array(q)
    target = robot.frames(q)[3] + shift
    missing = newton_to_position(
        posture, target, robot.lengths, robot.lower, robot.upper, _TOLERANCE
    )
    return posture if missing <= _TOLERANCE else None


def detour_motions(
    motion: Motion,
    grid: Grid,
    robot: RobotModel,
    shifts: Sequence[Sequence[float]] | FloatArray = _SHIFTS,
    kind: str = "detour",
) -> list[Motion]:
    """The motion with its tool path bent early, late or all along.

    Args:
        motion: Motion to bend.
        grid: Its grid.
        robot: The robot.
        shifts: Shifts of the tool (3,) [m]; up and back towards the robot by default.
        kind: Name of the results.
    """
    last = motion.arrival if motion.arrival is not None else grid.knots - 1
    if last < _MIN_KNOTS:
        return []
    motions = []
    for begin, end in _WINDOWS:
        x = np.clip((np.arange(grid.knots) / last - begin) / (end - begin), 0.0, 1.0)
        bump = 64.0 * (x * (1.0 - x)) ** 3
        middle = motion.q[int(np.argmax(bump))]
        for shift in shifts:
            posture = _shifted_posture(robot, middle, np.array(shift))
            if posture is not None:
                offset = bump[:, None] * (posture - middle)
                motions.append(motion.moved(offset, grid.step, kind))
    return motions


def retreat_motions(
    grid: Grid,
    robot: RobotModel,
    acceleration_limit: float,
    forecasts: Sequence[HumanForecast],
    home: FloatArray,
) -> list[Motion]:
    """Motions to rest off the goal: up, back, away from each hand, and towards a known posture."""
    q = grid.state[0]
    tool = robot.frames(q)[3]
    shifts = [np.array(shift) for shift in _SHIFTS]
    for forecast in forecasts:
        for hand in forecast.sample(np.array([grid.start_s + 0.3]))[0][:, 0, 3]:
            away = tool - hand
            away /= max(float(np.linalg.norm(away)), 1e-6)
            shifts.append(_AWAY * away)
    postures = [_shifted_posture(robot, q, shift) for shift in shifts]
    motions = []
    for posture in [*postures, home]:
        if posture is None:
            continue
        duration = fastest_duration(robot, acceleration_limit, grid.state, posture)
        motion = to_posture(grid, posture, duration, "retreat", False)
        if motion is not None:
            motions.append(motion)
    return motions
