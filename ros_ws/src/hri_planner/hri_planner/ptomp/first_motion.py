"""The motion that a reach begins with: smooth, and to the final posture that costs least."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hri_planner.ptomp.config import PtompConfig
from hri_planner.ptomp.costs import CostModel, TableBox
from hri_planner.ptomp.motion import State
from hri_planner.ptomp.plan import JointPlan, connect
from hri_planner.ptomp.timing import fastest_duration
from hri_planner.robot.ik import ik_candidates
from hri_planner.robot.model import RobotModel
from hri_prediction.errors import PlanningError

FloatArray = NDArray[np.float64]

_POSTURES = 32
_LONGER = 10.0  # cost of each second beyond the wanted duration


def check_reach(
    robot: RobotModel,
    table: TableBox | None,
    state: tuple[FloatArray, FloatArray],
    goal: FloatArray,
    duration_s: float,
) -> None:
    """Check what a reach is asked for.

    Raises:
        PlanningError: when the state is unusable, the goal in the table, or the duration out of range.
    """
    q, qd = state
    for name, values, size in (("q0", q, 7), ("qd0", qd, 7), ("goal", goal, 3)):
        if values.shape != (size,) or not np.all(np.isfinite(values)):
            raise PlanningError(f"{name} = {values}", expected=f"{size} finite numbers")
    if not robot.within_limits(q, 1e-3):
        raise PlanningError("start posture lies outside of the joint limits")
    if not 0.1 <= duration_s <= 60.0:
        raise PlanningError(f"duration {duration_s} s", expected="0.1 to 60 s")
    if table is not None:
        lowest = table.top + float(robot.capsule_radii[2])
        if goal[2] < lowest:
            raise PlanningError(
                f"goal height {goal[2]:.3f} m puts the hand into the table",
                expected=f"at least {lowest:.3f} m",
            )


def first_posture(
    robot: RobotModel,
    config: PtompConfig,
    costs: CostModel,
    rng: np.random.Generator,
    state: State,
    goal: FloatArray,
    duration_s: float,
    time0_s: float,
) -> tuple[FloatArray, float]:
    """The final posture (7,) [rad] of least cost without people, and the duration of the way to it [s].

    Args:
        robot: The robot.
        config: Of the planner.
        costs: Its cost model; bound anew.
        rng: Draws the candidates.
        state: Joint state (q, qd, qdd) at the start.
        goal: Tool goal (3,) [m].
        duration_s: Wanted duration [s].
        time0_s: Plan clock at the start [s].

    Raises:
        PlanningError: when the goal is out of reach.
    """
    best: tuple[float, FloatArray, float] | None = None
    for posture in ik_candidates(robot, goal, state[0], rng, count=_POSTURES):
        shortest = fastest_duration(robot, config.acceleration_limit, state, posture)
        seconds = max(shortest, duration_s)
        cost = _cost(config, costs, state, posture, seconds, time0_s, goal)
        cost += _LONGER * (seconds - duration_s)
        if best is None or cost < best[0]:
            best = (cost, posture, seconds)
    assert best is not None
    return best[1], best[2]


def smooth_plan(
    state: State, q_end: FloatArray, duration_s: float, time0_s: float, steps: int
) -> JointPlan:
    """Quintic from a state to rest at a posture (7,) [rad], in so many time steps."""
    times = np.linspace(0.0, duration_s, steps + 1)
    return JointPlan(time0_s + times, *connect(state, q_end, duration_s, times))


def _cost(
    config: PtompConfig,
    costs: CostModel,
    state: State,
    posture: FloatArray,
    duration_s: float,
    time0_s: float,
    goal: FloatArray,
) -> float:
    steps = config.num_timesteps
    times = np.linspace(0.0, duration_s, steps + 1)
    q = connect(state, posture, duration_s, times)[0]
    past = state[0] - times[[2, 1], None] * state[1]
    spacing = duration_s / steps
    grid_s = np.asarray(time0_s + spacing * np.arange(-2, steps + 1), dtype=np.float64)
    costs.bind(grid_s, goal, [], 0.0)
    columns = np.ascontiguousarray(np.concatenate((past, q)).T)
    return float(costs.evaluate(columns[None])[0][0])
