"""Slower, later and stopped motions: what to do when there is no safe way now."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hri_planner.ptomp import quintic
from hri_planner.ptomp.motion import Grid, Motion, State, to_posture
from hri_planner.ptomp.plan import JointPlan
from hri_planner.robot.model import RobotModel

FloatArray = NDArray[np.float64]

_DURATIONS = 0.12 * 1.12 ** np.arange(34)  # 0.12 s to 5 s
_SAMPLES = 13
_SPEED_SHARE = 0.92
_ADAPT_S = 0.25  # time in which the speed along the path changes
_RATES = (0.75, 0.5, 0.3)
_PAUSES_S = (0.1, 0.4, 0.8)
_STRETCHES = (1.0, 1.2, 1.5, 2.0)


def fastest_duration(
    robot: RobotModel, acceleration_limit: float, state: State, q_end: FloatArray
) -> float:
    """Shortest duration of a quintic to rest at a posture within all limits [s].

    Args:
        robot: Limits of angles and speeds.
        acceleration_limit: [rad/s^2], or what the state already has if that is more.
        state: (q, qd, qdd) to start from.
        q_end: Posture (7,) [rad].

    Returns:
        One of a fixed series of durations, the longest if none keeps the limits.
    """
    return _fastest(robot, acceleration_limit, state, np.tile(q_end, (len(_DURATIONS), 1)))


def _fastest(robot: RobotModel, acceleration_limit: float, state: State, ends: FloatArray) -> float:
    """As :func:`fastest_duration`, with a posture for each duration (34, 7)."""
    _, v0, a0 = state
    index = quintic.first_within(
        _DURATIONS,
        np.stack(state),
        ends,
        _SAMPLES,
        robot.lower,
        robot.upper,
        np.maximum(_SPEED_SHARE * robot.velocity, np.abs(v0) + 1e-9),
        np.maximum(acceleration_limit, np.abs(a0) + 1e-9),
    )
    return float(_DURATIONS[index])


def direct_motions(
    robot: RobotModel, acceleration_limit: float, grid: Grid, q_goal: FloatArray
) -> list[Motion]:
    """Fresh reaches to the goal posture, as fast as allowed and slower."""
    duration = fastest_duration(robot, acceleration_limit, grid.state, q_goal)
    motions = [to_posture(grid, q_goal, s * duration, "direct", True) for s in _STRETCHES]
    return [motion for motion in motions if motion is not None]


def stop_motion(robot: RobotModel, acceleration_limit: float, grid: Grid) -> Motion | None:
    """The quickest smooth stop."""
    q0, v0, a0 = grid.state
    t = _DURATIONS[:, None]
    ends = np.clip(q0 + 0.5 * v0 * t + a0 * t * t / 12.0, robot.lower, robot.upper)
    duration = _fastest(robot, acceleration_limit, grid.state, ends)
    return to_posture(grid, ends[np.searchsorted(_DURATIONS, duration)], duration, "stop", False)


def slowed_motions(plan: JointPlan, grid: Grid) -> list[Motion]:
    """The present plan's path at a lower speed, or with a pause on the way."""
    t = np.linspace(0.0, grid.offsets[-1], 8 * (grid.knots - 1) + 1)
    profiles = []
    for rate in _RATES:
        down, slope = _smoothstep(t / _ADAPT_S)
        profiles.append(("slow", 1.0 - (1.0 - rate) * down, -(1.0 - rate) * slope / _ADAPT_S))
    for pause in _PAUSES_S:
        down, fall = _smoothstep(t / _ADAPT_S)
        up, rise = _smoothstep((t - _ADAPT_S - pause) / _ADAPT_S)
        profiles.append(("pause", 1.0 - down + up, (rise - fall) / _ADAPT_S))
    motions = []
    for kind, speed, slope in profiles:
        steps = 0.5 * (speed[1:] + speed[:-1]) * (t[1] - t[0])
        along = grid.start_s + np.concatenate(([0.0], np.cumsum(steps)))[::8]
        if along[-1] < plan.end_s:
            continue
        q, qd, qdd = plan.sample(along)
        rates, change = speed[::8, None], slope[::8, None]
        qdd = qdd * rates**2 + qd * change
        qd = qd * rates
        q[0], qd[0], qdd[0] = grid.state
        arrival = max(int(np.searchsorted(along, plan.end_s - 1e-9)), 1)
        q[arrival:] = plan.q[-1]
        qd[arrival:] = 0.0
        qdd[arrival:] = 0.0
        motions.append(Motion(kind, q, qd, qdd, arrival))
    return motions


def _smoothstep(x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Rise from 0 to 1 over 0..1 without a kink in its slope, and the slope."""
    x = np.clip(x, 0.0, 1.0)
    return x**3 * (10.0 - 15.0 * x + 6.0 * x * x), 30.0 * x * x * (1.0 - x) ** 2
