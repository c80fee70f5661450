"""Costs of many trajectories at once, compiled: the planner's inner loop.

Written once for float64 and float32: the type is that of the arrays. The same formulas in NumPy, for
comparison, are in :mod:`hri_planner.benchmarks.plain_iteration`; :mod:`hri_planner.ptomp.layout` says how
the arrays lie.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hri_planner.ptomp.clearance import distances, mark_columns, padded_columns
from hri_planner.ptomp.layout import (
    AHEAD,
    COLLISION,
    CONTACT,
    ELBOW,
    FAR,
    FAST,
    FREE,
    LENGTHS,
    LOWER,
    MASSES,
    NEAREST,
    P_ACCELERATION,
    P_ACCELERATION_LIMIT,
    P_COLLISION,
    P_CONTACT,
    P_CONTROL,
    P_EFFORT,
    P_GOAL,
    P_GOAL_X,
    P_GRAVITY,
    P_JERK,
    P_LEARNT,
    P_LIMIT_SCALE,
    P_LIMITS,
    P_LITERAL,
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
)  # fmt: skip
from hri_planner.ptomp.learnt import fill_nearness, sum_nearness
from hri_planner.ptomp.literal import literal_collisions
from hri_prediction.compiled import njit

TABLE_HINGE = 1.0 / 0.02
STEEP = 20.0  # the speed cost is one where the speed exceeds its share of the limit by 1 / 20
STEEP_ACCELERATION = 10.0
LIMIT_SCALES = 10.0  # beyond so many scales from a limit its cost is zero (there below 5e-5 of K1)
LIMIT_MOST = 50.0


@njit(fastmath=FAST)
def _limit_costs(row: Any, padded: int, lower: Any, upper: Any, scale: Any, free: Any) -> Any:
    """Sum of exp(x / scale) of one joint, x beyond its nearer limit (eq. 6.11)."""
    real = row.dtype.type
    zero, one = real(0.0), real(1.0)
    least, most = real(-LIMIT_SCALES), real(LIMIT_MOST)
    inverse, part = one / scale, real(1.0 / 64.0)
    c3, c4, c5 = real(1.0 / 6.0), real(1.0 / 24.0), real(1.0 / 120.0)
    c6, c7, c8 = real(1.0 / 720.0), real(1.0 / 5040.0), real(1.0 / 40320.0)
    c9, c10, c11 = real(1.0 / 362880.0), real(1.0 / 3628800.0), real(1.0 / 39916800.0)
    half, total = real(0.5), zero
    for i in range(padded):
        x, y = lower - row[i], row[i] - upper
        x = (x if x > y else y) * inverse
        weight = free[i] if x > least else zero
        x = x if x > least else least
        x = x if x < most else most
        # Series of exp(x / 64), |x / 64| < 0.8, then squared six times: error below 1e-13.
        x = x * part
        y = c10 + x * c11
        y = c9 + x * y
        y = c8 + x * y
        y = c7 + x * y
        y = c6 + x * y
        y = c5 + x * y
        y = c4 + x * y
        y = c3 + x * y
        y = half + x * y
        y = one + x * (one + x * y)
        y = y * y
        y = y * y
        y = y * y
        y = y * y
        y = y * y
        y = y * y
        total += weight * y
    return total


@njit(fastmath=FAST)
def _joint_costs(q: Any, columns: int, body: Any, par: Any, work: Any, terms: Any) -> None:
    """Joint limits (eq. 6.11), speed, acceleration and control, summed over joints and time."""
    real = work.dtype.type
    zero = real(0.0)
    padded = padded_columns(columns)
    step, share, scale = par[P_STEP], par[P_SPEED_SHARE], par[P_LIMIT_SCALE]
    inverse = real(1.0) / step
    square = inverse * inverse
    largest = par[P_ACCELERATION_LIMIT]
    steep_a, steep_v = real(STEEP_ACCELERATION) / largest, real(STEEP)
    limits, speed, acceleration, control = zero, zero, zero, zero
    ahead = work[AHEAD * ROW + 2 : (AHEAD + 1) * ROW]
    for joint in range(7):
        q0 = q[joint]
        q1, q2 = q0[1:], q0[2:]
        full = inverse / body[VELOCITY + joint]
        low = body[LOWER + joint] + real(LIMIT_SCALES) * scale
        high = body[UPPER + joint] - real(LIMIT_SCALES) * scale
        # Sums of this joint alone: the next one need not wait until they are added up.
        bends, hard, fast, outside = zero, zero, zero, zero
        for i in range(padded):
            # Of three columns in turn, the last one ahead; what lies beyond the end does not count.
            rise, fall = (q2[i] - q1[i]) * ahead[i], (q1[i] - q0[i]) * ahead[i]
            a = (rise - fall) * square
            bends += a * a
            x = (abs(a) - largest) * steep_a
            x = x if x > zero else zero
            hard += x * x
            # The step before the hand-over is the same for all trajectories and within limits.
            x = (abs(rise) * full - share) * steep_v
            x = x if x > zero else zero
            fast += x * x
            x, y = low - q2[i], q2[i] - high
            outside += (x if x > zero else zero) + (y if y > zero else zero)
        control += bends
        acceleration += hard
        speed += fast
        if outside > zero:
            limits += _limit_costs(
                q0, padded, body[LOWER + joint], body[UPPER + joint], scale, work[FREE * ROW :]
            )
    terms[4] = par[P_LIMITS] * step * limits
    terms[5] = par[P_SPEED] * step * speed
    terms[6] = par[P_ACCELERATION] * step * acceleration
    terms[9] = real(0.5) * par[P_CONTROL] * step * control


@njit(fastmath=FAST)
def _effort(columns: int, body: Any, par: Any, work: Any) -> Any:
    """Kinetic and potential energy of the three parts, summed over time."""
    real = work.dtype.type
    zero, half = real(0.0), real(0.5)
    inverse = half / par[P_STEP]
    m1, m2, m3 = body[MASSES], body[MASSES + 1], body[MASSES + 2]
    # Heights of the middles of the parts: half the sum of their ends' heights.
    weight = half * par[P_GRAVITY]
    lift1, lift2, lift3 = weight * (m1 + m2), weight * (m2 + m3), weight * m3
    bottom = weight * m1 * body[LENGTHS]
    e, w, t = work[ELBOW * ROW :], work[WRIST * ROW :], work[TOOL * ROW :]
    en, wn, tn = e[1:], w[1:], t[1:]
    counts = work[FREE * ROW + 1 : (FREE + 1) * ROW]
    total = real(0.0)
    for i in range(padded_columns(columns)):
        value = bottom + lift1 * e[2 * ROW + i] + lift2 * w[2 * ROW + i] + lift3 * t[2 * ROW + i]
        e0, e1, e2 = en[i] - e[i], en[ROW + i] - e[ROW + i], en[2 * ROW + i] - e[2 * ROW + i]
        w0, w1, w2 = wn[i] - w[i], wn[ROW + i] - w[ROW + i], wn[2 * ROW + i] - w[2 * ROW + i]
        t0, t1, t2 = tn[i] - t[i], tn[ROW + i] - t[ROW + i], tn[2 * ROW + i] - t[2 * ROW + i]
        t0, t1, t2 = t0 + w0, t1 + w1, t2 + w2
        w0, w1, w2 = w0 + e0, w1 + e1, w2 + e2
        moving = m1 * (e0 * e0 + e1 * e1 + e2 * e2) + m2 * (w0 * w0 + w1 * w1 + w2 * w2)
        moving += m3 * (t0 * t0 + t1 * t1 + t2 * t2)
        value += half * inverse * inverse * moving
        # Selected, not multiplied: beyond the padding there may be anything.
        total += value if counts[i] > zero else zero
    return total


@njit(fastmath=FAST)
def _jerk(columns: int, par: Any, work: Any) -> Any:
    """Squared third derivative of the tool's path, summed over time."""
    real = work.dtype.type
    zero, three = real(0.0), real(3.0)
    inverse = real(1.0) / par[P_STEP]
    tool = work[TOOL * ROW : (TOOL + 3) * ROW]
    counts = work[FREE * ROW + 3 : (FREE + 1) * ROW]
    total = zero
    t1, t2, t3 = tool[1:], tool[2:], tool[3:]
    for i in range(padded_columns(columns)):
        x = (t3[i] - tool[i]) + three * (t1[i] - t2[i])
        y = (t3[ROW + i] - tool[ROW + i]) + three * (t1[ROW + i] - t2[ROW + i])
        z = (t3[2 * ROW + i] - tool[2 * ROW + i]) + three * (t1[2 * ROW + i] - t2[2 * ROW + i])
        total += (x * x + y * y + z * z) if counts[i] > zero else zero
    cube = inverse * inverse * inverse
    return total * cube * cube


@njit(fastmath=FAST)
def _place_costs(columns: int, body: Any, par: Any, work: Any, terms: Any) -> Any:
    """Collision, contact, table and goal; returns the smallest clearance from the hand-over on [m]."""
    real = work.dtype.type
    zero = real(0.0)
    step, far, steep = par[P_STEP], real(FAR), real(TABLE_HINGE)
    # Elbow and wrist end the wider capsules; the hand's own radius holds at the tool.
    low = (par[P_TABLE_HEIGHT] + body[RADII + 1]) * steep
    low_tool = (par[P_TABLE_HEIGHT] + body[RADII + 2]) * steep
    goal0, goal1, goal2 = par[P_GOAL_X], par[P_GOAL_X + 1], par[P_GOAL_X + 2]
    collision, contact, table, goal, nearest = zero, zero, zero, zero, far
    for i in range(padded_columns(columns)):
        free = work[FREE * ROW + i]
        collision += free * work[COLLISION * ROW + i]
        contact += free * work[CONTACT * ROW + i]
        x = low - steep * work[(ELBOW + 2) * ROW + i]
        y = low - steep * work[(WRIST + 2) * ROW + i]
        z = low_tool - steep * work[(TOOL + 2) * ROW + i]
        x = x if x > zero else zero
        y = y if y > zero else zero
        z = z if z > zero else zero
        table += free * (x * x + y * y + z * z)
        g0 = work[TOOL * ROW + i] - goal0
        g1 = work[(TOOL + 1) * ROW + i] - goal1
        g2 = work[(TOOL + 2) * ROW + i] - goal2
        goal += free * np.sqrt(g0 * g0 + g1 * g1 + g2 * g2)
    for i in range(2, columns):
        near = work[NEAREST * ROW + i]
        nearest = near if near < nearest else nearest
    terms[0] = par[P_COLLISION] * step * collision
    terms[1] = par[P_CONTACT] * step * contact
    terms[7] = par[P_TABLE] * step * table
    terms[8] = par[P_GOAL] * step * goal
    return nearest


@njit
def trajectory_costs(
    q: Any, columns: int, body: Any, humans: Any, human_radii: Any, par: Any, work: Any, terms: Any
) -> Any:
    """Costs of one trajectory (7, ROW) into ``terms`` (TERM_COUNT,); returns its smallest clearance [m].

    Arguments as :func:`many_costs`, whose workspace has its columns marked already.
    """
    distances(q, columns, body, humans, human_radii, par, work)
    if par[P_LITERAL] > par.dtype.type(0.0):
        literal_collisions(columns, body, humans, human_radii, par, work)
    nearest = _place_costs(columns, body, par, work, terms)
    terms[2] = par[P_EFFORT] * par[P_STEP] * _effort(columns, body, par, work)
    terms[3] = par[P_JERK] * par[P_STEP] * _jerk(columns, par, work)
    _joint_costs(q, columns, body, par, work, terms)
    terms[10] = par.dtype.type(0.0)
    if par[P_LEARNT] > par.dtype.type(0.0):
        fill_nearness(columns, body, humans, par, work)
        terms[10] = par[P_LEARNT] * par[P_STEP] * sum_nearness(columns, work)
    return nearest


@njit
def many_costs(
    trajectories: Any, columns: int, body: Any, humans: Any, human_radii: Any, par: Any, work: Any,
    terms: Any, nearest: Any,
) -> None:  # fmt: skip
    """Costs of many trajectories.

    Args:
        trajectories: (n, 7, ROW) [rad], see the layout.
        columns: Columns in use, at most MAX_COLUMNS.
        body: The robot's vector (BODY_SIZE,).
        humans: Arms over time (arms, ARM_ROWS * ROW).
        human_radii: Of their limbs (arms, 3) [m].
        par: Parameter vector (PARAMETER_COUNT,).
        work: Workspace (WORKSPACE_ROWS * ROW,).
        terms: Result (n, TERM_COUNT): the weighted cost terms.
        nearest: Result (n,): smallest predicted clearance from the hand-over on [m].
    """
    mark_columns(columns, work)
    for index in range(trajectories.shape[0]):
        nearest[index] = trajectory_costs(
            trajectories[index], columns, body, humans, human_radii, par, work, terms[index]
        )
