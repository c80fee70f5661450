"""Costs of many trajectories at once, compiled: the planner's inner loop.

Every loop over time is free of branches and calls, so that the compiler turns it into vector
instructions: sine and cosine are polynomials, clamps are selections. All intermediate rows live in
one flat workspace with a constant row length, because the compiler can then prove that rows do not
overlap. A plain NumPy version of the same formulas stands in the tests.

Layout: a trajectory is (7, P), joints by time. Its columns 0 and 1 lie in the past (one and two
steps before the hand-over), column 2 is the state at the hand-over, the others are free.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hri_prediction.compiled import njit

FloatArray = NDArray[np.float64]

ROW = 160
"""Row length of the workspace, so the largest number of columns P of a trajectory."""

WORKSPACE_ROWS = 27
FIRST_FREE = 3
"""First column that a planner may change."""

TERMS = (
    "collision",
    "contact",
    "effort",
    "jerk",
    "joint_limits",
    "speed",
    "acceleration",
    "table",
    "goal",
    "control",
)
TERM_COUNT = len(TERMS)

# Rows of the workspace: shoulder 0-2, elbow 3-5, wrist 6-8, tool 9-11; then per column collision,
# contact and smallest distance; then sines and cosines.
_SHOULDER, _ELBOW, _WRIST, _TOOL = 0, 3, 6, 9
_OUT = 12
_COLLISION, _CONTACT, _NEAREST = 0, 1, 2
_SIN, _COS = 15, 21
_HUMAN_ROWS = 9
_LANES = 16  # columns are padded to this multiple, so that no scalar rest of a loop remains

# Positions in the parameter vector; costs.py fills it.
P_MARGIN, P_KAPPA, P_COLLISION, P_CONTACT_MARGIN, P_CONTACT = 0, 1, 2, 3, 4
P_EFFORT, P_JERK, P_LIMITS, P_LIMIT_SCALE, P_SPEED, P_SPEED_SHARE = 5, 6, 7, 8, 9, 10
P_ACCELERATION, P_ACCELERATION_LIMIT, P_TABLE, P_TABLE_HEIGHT = 11, 12, 13, 14
P_GOAL, P_CONTROL = 15, 16
P_GOAL_X = 17
PARAMETER_COUNT = 20

_HINGE = 1.0 / 0.05  # the collision cost's length scale of the thesis' follow-up, 5 cm
_CONTACT_HINGE = 1.0 / 0.01
_TABLE_HINGE = 1.0 / 0.02
_GRAVITY = 9.81
_FAR = 1e3
_FAST = {"contract", "reassoc", "nsz", "arcp"}


@njit(fastmath=_FAST)
def _points(q: FloatArray, columns: int, lengths: FloatArray, work: FloatArray) -> None:
    """Elbow, wrist and tool of every column into the workspace."""
    for joint in range(6):
        row = q[joint]
        sine = work[(_SIN + joint) * ROW : (_SIN + joint + 1) * ROW]
        cosine = work[(_COS + joint) * ROW : (_COS + joint + 1) * ROW]
        for i in range(columns):
            # Taylor series of the half angle (|q| <= 3.2 rad: error below 1e-13), then doubled.
            y = 0.5 * row[i]
            z = y * y
            s = z * (1.0 / 355687428096000.0)
            s = z * (-1.0 / 1307674368000.0 + s)
            s = z * (1.0 / 6227020800.0 + s)
            s = z * (-1.0 / 39916800.0 + s)
            s = z * (1.0 / 362880.0 + s)
            s = z * (-1.0 / 5040.0 + s)
            s = z * (1.0 / 120.0 + s)
            s = z * (-1.0 / 6.0 + s)
            s = y * (1.0 + s)
            c = z * (-1.0 / 6402373705728000.0)
            c = z * (1.0 / 20922789888000.0 + c)
            c = z * (-1.0 / 87178291200.0 + c)
            c = z * (1.0 / 479001600.0 + c)
            c = z * (-1.0 / 3628800.0 + c)
            c = z * (1.0 / 40320.0 + c)
            c = z * (-1.0 / 720.0 + c)
            c = z * (1.0 / 24.0 + c)
            c = z * (-1.0 / 2.0 + c)
            c = 1.0 + c
            sine[i] = 2.0 * s * c
            cosine[i] = 1.0 - 2.0 * s * s
    base, upper, lower, hand = lengths[0], lengths[1], lengths[2], lengths[3]
    for i in range(columns):
        c1, s1 = work[_COS * ROW + i], work[_SIN * ROW + i]
        c2, s2 = work[(_COS + 1) * ROW + i], work[(_SIN + 1) * ROW + i]
        c3, s3 = work[(_COS + 2) * ROW + i], work[(_SIN + 2) * ROW + i]
        c4, s4 = work[(_COS + 3) * ROW + i], work[(_SIN + 3) * ROW + i]
        c5, s5 = work[(_COS + 4) * ROW + i], work[(_SIN + 4) * ROW + i]
        c6, s6 = work[(_COS + 5) * ROW + i], work[(_SIN + 5) * ROW + i]
        z0, z1, z2 = -c1 * s2, -s1 * s2, c2
        e0, e1, e2 = upper * z0, upper * z1, base + upper * z2
        u0, u1, u2 = c3 * c1 * c2 - s3 * s1, c3 * s1 * c2 + s3 * c1, c3 * s2
        y0, y1, y2 = -c3 * s1 - s3 * c1 * c2, c3 * c1 - s3 * s1 * c2, -s3 * s2
        x0, x1, x2 = c4 * u0 - s4 * z0, c4 * u1 - s4 * z1, c4 * u2 - s4 * z2
        z0, z1, z2 = s4 * u0 + c4 * z0, s4 * u1 + c4 * z1, s4 * u2 + c4 * z2
        w0, w1, w2 = e0 + lower * z0, e1 + lower * z1, e2 + lower * z2
        u0, u1, u2 = c5 * x0 + s5 * y0, c5 * x1 + s5 * y1, c5 * x2 + s5 * y2
        work[_SHOULDER * ROW + i] = 0.0
        work[(_SHOULDER + 1) * ROW + i] = 0.0
        work[(_SHOULDER + 2) * ROW + i] = base
        work[_ELBOW * ROW + i] = e0
        work[(_ELBOW + 1) * ROW + i] = e1
        work[(_ELBOW + 2) * ROW + i] = e2
        work[_WRIST * ROW + i] = w0
        work[(_WRIST + 1) * ROW + i] = w1
        work[(_WRIST + 2) * ROW + i] = w2
        work[_TOOL * ROW + i] = w0 + hand * (c6 * z0 - s6 * u0)
        work[(_TOOL + 1) * ROW + i] = w1 + hand * (c6 * z1 - s6 * u1)
        work[(_TOOL + 2) * ROW + i] = w2 + hand * (c6 * z2 - s6 * u2)


@njit(fastmath=_FAST)
def _pair(
    padded: int,
    squared_length: float,
    radii: float,
    human: FloatArray,
    par: FloatArray,
    points: FloatArray,
    out: FloatArray,
) -> None:
    """Add one robot-human capsule pair to the collision rows.

    Inputs and outputs are different flat arrays with constant row lengths: only then can the
    compiler see, with a few checks at run time, that they do not overlap.

    Args:
        padded: Number of columns, rounded up.
        squared_length: Squared length of its axis [m^2].
        radii: Sum of both radii [m].
        human: (9 * ROW,): start, axis vector, inverse squared length, sigma at start and its rise.
        par: Parameter vector.
        points: Start and end of the robot's capsule (6 * ROW,) [m].
        out: Collision, contact and smallest distance (3 * ROW,).
    """
    margin, kappa, contact = par[P_MARGIN], par[P_KAPPA], par[P_CONTACT_MARGIN]
    inverse_length = 1.0 / squared_length
    for i in range(padded):
        p0, p1, p2 = points[i], points[ROW + i], points[2 * ROW + i]
        u0 = points[3 * ROW + i] - p0
        u1 = points[4 * ROW + i] - p1
        u2 = points[5 * ROW + i] - p2
        v0, v1, v2 = human[3 * ROW + i], human[4 * ROW + i], human[5 * ROW + i]
        r0, r1, r2 = p0 - human[i], p1 - human[ROW + i], p2 - human[2 * ROW + i]
        b = u0 * v0 + u1 * v1 + u2 * v2
        c = u0 * r0 + u1 * r1 + u2 * r2
        f = v0 * r0 + v1 * r1 + v2 * r2
        e = v0 * v0 + v1 * v1 + v2 * v2
        inverse = human[6 * ROW + i]
        s = (b * f - c * e) / (squared_length * e - b * b + 1e-14)
        s = s if s > 0.0 else 0.0
        s = s if s < 1.0 else 1.0
        t = (b * s + f) * inverse
        t = t if t > 0.0 else 0.0
        t = t if t < 1.0 else 1.0
        s = (b * t - c) * inverse_length
        s = s if s > 0.0 else 0.0
        s = s if s < 1.0 else 1.0
        g0, g1, g2 = r0 + s * u0 - t * v0, r1 + s * u1 - t * v1, r2 + s * u2 - t * v2
        d = np.sqrt(g0 * g0 + g1 * g1 + g2 * g2) - radii
        x = (margin + kappa * (human[7 * ROW + i] + t * human[8 * ROW + i]) - d) * _HINGE
        x = x if x > 0.0 else 0.0
        out[_COLLISION * ROW + i] += x * x
        y = (contact - d) * _CONTACT_HINGE
        y = y if y > 0.0 else 0.0
        out[_CONTACT * ROW + i] += y * y
        near = out[_NEAREST * ROW + i]
        out[_NEAREST * ROW + i] = near if near < d else d


@njit(fastmath=_FAST)
def _joint_costs(
    q: FloatArray,
    columns: int,
    step: float,
    lower: FloatArray,
    upper: FloatArray,
    velocity: FloatArray,
    par: FloatArray,
    terms: FloatArray,
) -> None:
    """Joint limits (eq. 6.11), speed, acceleration and control, summed over joints and time."""
    share, scale = par[P_SPEED_SHARE], par[P_LIMIT_SCALE]
    inverse = 1.0 / step
    limits, speed, acceleration, control = 0.0, 0.0, 0.0, 0.0
    largest = par[P_ACCELERATION_LIMIT]
    steep = 10.0 / largest
    for joint in range(7):
        row = q[joint]
        full = inverse / velocity[joint]
        # The exponential is cut to zero beyond ten scales from a limit (there below 5e-5 of K1).
        low, high = lower[joint] + 10.0 * scale, upper[joint] - 10.0 * scale
        inside = 0.0
        for i in range(1, columns - 1):
            rise, fall = row[i + 1] - row[i], row[i] - row[i - 1]
            a = (rise - fall) * inverse * inverse
            control += a * a
            x = (abs(a) - largest) * steep
            x = x if x > 0.0 else 0.0
            acceleration += x * x
            # The step before the hand-over is the same for all trajectories and within limits.
            x = (abs(rise) * full - share) * 20.0
            x = x if x > 0.0 else 0.0
            speed += x * x
            x, y = low - row[i + 1], row[i + 1] - high
            inside += (x if x > 0.0 else 0.0) + (y if y > 0.0 else 0.0)
        if inside > 0.0:
            for i in range(FIRST_FREE, columns):
                if row[i] < low:
                    limits += np.exp(min((lower[joint] - row[i]) / scale, 50.0))
                elif row[i] > high:
                    limits += np.exp(min((row[i] - upper[joint]) / scale, 50.0))
    terms[4] = par[P_LIMITS] * step * limits
    terms[5] = par[P_SPEED] * step * speed
    terms[6] = par[P_ACCELERATION] * step * acceleration
    terms[9] = 0.5 * par[P_CONTROL] * step * control


@njit(fastmath=_FAST)
def _motion_costs(
    columns: int,
    step: float,
    shoulder: float,
    masses: FloatArray,
    radii: FloatArray,
    par: FloatArray,
    work: FloatArray,
    terms: FloatArray,
) -> None:
    """Effort, hand jerk, table and goal, from the points in the workspace."""
    inverse = 1.0 / step
    effort, jerk, table, goal = 0.0, 0.0, 0.0, 0.0
    for i in range(2, columns - 1):
        height = 0.5 * (shoulder + work[(_ELBOW + 2) * ROW + i])
        effort += masses[0] * _GRAVITY * height
        height = 0.5 * (work[(_ELBOW + 2) * ROW + i] + work[(_WRIST + 2) * ROW + i])
        effort += masses[1] * _GRAVITY * height
        height = 0.5 * (work[(_WRIST + 2) * ROW + i] + work[(_TOOL + 2) * ROW + i])
        effort += masses[2] * _GRAVITY * height
        for axis in range(3):
            elbow = work[(_ELBOW + axis) * ROW + i + 1] - work[(_ELBOW + axis) * ROW + i]
            wrist = work[(_WRIST + axis) * ROW + i + 1] - work[(_WRIST + axis) * ROW + i]
            tool = work[(_TOOL + axis) * ROW + i + 1] - work[(_TOOL + axis) * ROW + i]
            speed = 0.5 * inverse * elbow
            effort += 0.5 * masses[0] * speed * speed
            speed = 0.5 * inverse * (elbow + wrist)
            effort += 0.5 * masses[1] * speed * speed
            speed = 0.5 * inverse * (wrist + tool)
            effort += 0.5 * masses[2] * speed * speed
    cube = inverse * inverse * inverse
    for axis in range(3):
        offset = (_TOOL + axis) * ROW
        for i in range(FIRST_FREE, columns):
            third = work[offset + i] - 3.0 * work[offset + i - 1]
            third = (third + 3.0 * work[offset + i - 2] - work[offset + i - 3]) * cube
            jerk += third * third
    for point in range(3):
        # Elbow and wrist end the wider capsules; the hand's own radius holds at the tool.
        radius = radii[1] if point < 2 else radii[2]
        lowest = par[P_TABLE_HEIGHT] + radius
        offset = (_ELBOW + 3 * point + 2) * ROW
        for i in range(FIRST_FREE, columns):
            x = (lowest - work[offset + i]) * _TABLE_HINGE
            x = x if x > 0.0 else 0.0
            table += x * x
    for i in range(FIRST_FREE, columns):
        g0 = work[_TOOL * ROW + i] - par[P_GOAL_X]
        g1 = work[(_TOOL + 1) * ROW + i] - par[P_GOAL_X + 1]
        g2 = work[(_TOOL + 2) * ROW + i] - par[P_GOAL_X + 2]
        goal += np.sqrt(g0 * g0 + g1 * g1 + g2 * g2)
    terms[2] = par[P_EFFORT] * step * effort
    terms[3] = par[P_JERK] * step * jerk
    terms[7] = par[P_TABLE] * step * table
    terms[8] = par[P_GOAL] * step * goal


@njit(fastmath=_FAST)
def _distances(
    q: FloatArray,
    columns: int,
    lengths: FloatArray,
    radii: FloatArray,
    humans: FloatArray,
    human_radii: FloatArray,
    par: FloatArray,
    work: FloatArray,
) -> None:
    """Forward kinematics and all capsule pairs of every column into the workspace.

    Arguments as :func:`many_costs`, ``q`` one of its trajectories.
    """
    padded = (columns + _LANES - 1) // _LANES * _LANES
    # What lies beyond the columns is finite and never summed up.
    _points(q, padded if q.shape[1] >= padded else columns, lengths, work)
    out = work[_OUT * ROW : (_OUT + 3) * ROW]
    for i in range(padded):
        out[_COLLISION * ROW + i] = 0.0
        out[_CONTACT * ROW + i] = 0.0
        out[_NEAREST * ROW + i] = _FAR
    for limb in range(humans.shape[0]):
        human = humans[limb]
        reach = human_radii[limb]
        for part in range(3):
            length = lengths[part + 1] * lengths[part + 1]
            # A slice, not an offset: indices must be seen to be positive, or nothing is vectorised.
            points = work[3 * part * ROW : (3 * part + 6) * ROW]
            _pair(padded, length, radii[part] + reach, human, par, points, out)


@njit(fastmath=_FAST)
def _clearance_costs(
    columns: int, step: float, par: FloatArray, work: FloatArray, terms: FloatArray
) -> float:
    """Sum up what the capsule pairs gave; returns the smallest clearance from the hand-over on [m]."""
    out = work[_OUT * ROW : (_OUT + 3) * ROW]
    collision, contact, nearest = 0.0, 0.0, _FAR
    for i in range(FIRST_FREE, columns):
        collision += out[_COLLISION * ROW + i]
        contact += out[_CONTACT * ROW + i]
    for i in range(2, columns):
        near = out[_NEAREST * ROW + i]
        nearest = near if near < nearest else nearest
    terms[0] = par[P_COLLISION] * step * collision
    terms[1] = par[P_CONTACT] * step * contact
    return nearest


@njit
def many_costs(
    trajectories: FloatArray,
    columns: int,
    step: float,
    lengths: FloatArray,
    masses: FloatArray,
    radii: FloatArray,
    lower: FloatArray,
    upper: FloatArray,
    velocity: FloatArray,
    humans: FloatArray,
    human_radii: FloatArray,
    par: FloatArray,
    work: FloatArray,
    terms: FloatArray,
    nearest: FloatArray,
) -> None:
    """Costs of many trajectories.

    Args:
        trajectories: (n, 7, P >= columns) [rad], see the module.
        columns: Columns in use, at most ROW.
        step: Time between columns [s].
        lengths: The arm's lengths (4,) [m].
        masses: Of upper arm, lower arm and hand (3,) [kg].
        radii: Of the robot's capsules (3,) [m].
        lower: Joint limits (7,) [rad].
        upper: Joint limits (7,) [rad].
        velocity: Speed limits (7,) [rad/s].
        humans: Capsules over time (limbs, 9 * ROW), see :func:`_pair`.
        human_radii: (limbs,) [m].
        par: Parameter vector.
        work: Workspace (WORKSPACE_ROWS * ROW,).
        terms: Result (n, TERM_COUNT): the weighted cost terms.
        nearest: Result (n,): smallest predicted clearance from the hand-over on [m].
    """
    for index in range(trajectories.shape[0]):
        q, result = trajectories[index], terms[index]
        _distances(q, columns, lengths, radii, humans, human_radii, par, work)
        nearest[index] = _clearance_costs(columns, step, par, work, result)
        _motion_costs(columns, step, lengths[0], masses, radii, par, work, result)
        _joint_costs(q, columns, step, lower, upper, velocity, par, result)


def clearance_row(work: FloatArray) -> FloatArray:
    """Clearance by column of the trajectory that was evaluated last, a view of the workspace."""
    return work[(_OUT + _NEAREST) * ROW : (_OUT + _NEAREST + 1) * ROW]
