"""Costs of a trajectory column by column, for weights at each time step (STOMP), compiled.

The terms that belong to one time step: collision, contact, joint limits, speed, acceleration, table and
learnt costs.
Effort, jerk and control span several and are left to the smoothness of noise and update; the distance from
the goal is a cost of waiting, and where nothing else costs, weights by it would pull every step there. The
formulas are those of :mod:`hri_planner.ptomp.kernel`, which sums them: a test holds one against the other.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hri_planner.ptomp.kernel import (
    LIMIT_MOST,
    LIMIT_SCALES,
    STEEP,
    STEEP_ACCELERATION,
    TABLE_HINGE,
)
from hri_planner.ptomp.layout import (
    COLLISION,
    CONTACT,
    ELBOW,
    FIRST_FREE,
    LEARNT,
    LOWER,
    P_ACCELERATION,
    P_ACCELERATION_LIMIT,
    P_COLLISION,
    P_CONTACT,
    P_LEARNT,
    P_LIMIT_SCALE,
    P_LIMITS,
    P_SPEED,
    P_SPEED_SHARE,
    P_STEP,
    P_TABLE,
    P_TABLE_HEIGHT,
    RADII,
    ROW,
    TOOL,
    UPPER,
    VELOCITY,
    WRIST,
)
from hri_prediction.compiled import njit


@njit
def _joints(q: Any, i: int, body: Any, par: Any) -> Any:
    """Joint limits (eq. 6.11), speed and acceleration at column i."""
    step, scale, largest = par[P_STEP], par[P_LIMIT_SCALE], par[P_ACCELERATION_LIMIT]
    cost = 0.0
    for joint in range(7):
        row = q[joint]
        rise, fall = row[i] - row[i - 1], row[i - 1] - row[i - 2]
        share = abs(rise) / (step * body[VELOCITY + joint])
        fast = STEEP * max(share - par[P_SPEED_SHARE], 0.0)
        bend = abs(rise - fall) / (step * step)
        hard = STEEP_ACCELERATION / largest * max(bend - largest, 0.0)
        cost += par[P_SPEED] * fast * fast + par[P_ACCELERATION] * hard * hard
        beyond = max(body[LOWER + joint] - row[i], row[i] - body[UPPER + joint]) / scale
        if beyond > -LIMIT_SCALES:
            cost += par[P_LIMITS] * np.exp(min(beyond, LIMIT_MOST))
    return cost


@njit
def _places(i: int, body: Any, par: Any, work: Any) -> Any:
    """Collision, contact, table and learnt costs at column i."""
    low = par[P_TABLE_HEIGHT] + body[RADII + 1]
    low_tool = par[P_TABLE_HEIGHT] + body[RADII + 2]
    x = TABLE_HINGE * max(low - work[(ELBOW + 2) * ROW + i], 0.0)
    y = TABLE_HINGE * max(low - work[(WRIST + 2) * ROW + i], 0.0)
    z = TABLE_HINGE * max(low_tool - work[(TOOL + 2) * ROW + i], 0.0)
    cost = par[P_COLLISION] * work[COLLISION * ROW + i] + par[P_CONTACT] * work[CONTACT * ROW + i]
    cost += par[P_LEARNT] * work[LEARNT * ROW + i]
    return cost + par[P_TABLE] * (x * x + y * y + z * z)


@njit
def column_costs(q: Any, columns: int, body: Any, par: Any, work: Any, out: Any) -> None:
    """Costs of the free columns of one trajectory; of the others zero.

    Args:
        q: Trajectory (7, ROW) [rad], whose places and collisions are in the workspace.
        columns: Columns in use.
        body: The robot's vector.
        par: Parameter vector.
        work: Workspace, as :func:`hri_planner.ptomp.kernel.trajectory_costs` leaves it.
        out: Result (ROW,).
    """
    out[:] = out.dtype.type(0.0)
    for i in range(FIRST_FREE, columns):
        cost = _joints(q, i, body, par) + _places(i, body, par, work)
        out[i] = out.dtype.type(par[P_STEP] * cost)
