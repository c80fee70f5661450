"""Distances of 3 x 3 capsules of many columns at once, compiled.

Every loop over columns is free of branches and calls, so that the compiler turns it into vector
instructions: clamps are selections.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hri_planner.ptomp.layout import (
    AHEAD,
    ARM_AXIS,
    ARM_LENGTH,
    ARM_RISE,
    ARM_SIGMA,
    AXES,
    COLLISION,
    ELBOW,
    FAR,
    FAST,
    FIRST_FREE,
    FREE,
    LANES,
    LENGTHS,
    NEAREST,
    P_CONTACT_MARGIN,
    P_KAPPA,
    P_MARGIN,
    P_PARALLEL,
    RADII,
    ROW,
)  # fmt: skip
from hri_planner.ptomp.points import points
from hri_prediction.compiled import njit

_HINGE = 1.0 / 0.05  # the collision cost's length scale of the thesis' follow-up, 5 cm
_CONTACT_HINGE = 1.0 / 0.01


@njit
def padded_columns(columns: int) -> int:
    """Columns rounded up to whole lanes: so many are computed."""
    return (columns + LANES - 1) // LANES * LANES


@njit
def filled_columns(columns: int) -> int:
    """Columns that must hold numbers: differences in time look beyond those that are computed."""
    return padded_columns(columns) + LANES


@njit
def mark_columns(columns: int, work: Any) -> None:
    """Write the two rows of ones and zeros that say which columns count."""
    one, zero = work.dtype.type(1.0), work.dtype.type(0.0)
    for i in range(ROW):
        work[AHEAD * ROW + i] = one if 2 <= i < columns else zero
        work[FREE * ROW + i] = one if FIRST_FREE <= i < columns else zero


@njit(fastmath=FAST)
def nearest_on(
    r: Any,
    u: Any,
    v: Any,
    b: Any,
    c: Any,
    f: Any,
    length: Any,
    other: Any,
    near_one: Any,
    zero: Any,
) -> Any:
    """Squared distance of two axes, and the place of the nearest point along the second [m].

    Ericson, Real-Time Collision Detection (2005), section 5.1.9, with unit vectors along the axes and
    selections for branches. Arguments as :func:`_pair`.
    """
    s = (b * f - c) / (near_one - b * b)
    s = s if s > zero else zero
    s = s if s < length else length
    t = b * s + f
    t = t if t > zero else zero
    t = t if t < other else other
    s = b * t - c
    s = s if s > zero else zero
    s = s if s < length else length
    g0 = r[0] + s * u[0] - t * v[0]
    g1 = r[1] + s * u[1] - t * v[1]
    g2 = r[2] + s * u[2] - t * v[2]
    return g0 * g0 + g1 * g1 + g2 * g2, t


@njit(fastmath=FAST)
def _pair(
    r: Any, u: Any, v: Any, b: Any, c: Any, f: Any, length: Any, other: Any, par: Any, wide: Any,
    rise: Any, near_one: Any, zero: Any,
) -> Any:  # fmt: skip
    """Collision and contact cost of two capsules, and the distance of their surfaces [m].

    Args:
        r: From the start of the second axis to the start of the first (3 numbers) [m].
        u: Unit vector along the first.
        v: Unit vector along the second.
        b: u.v
        c: u.r [m]
        f: v.r [m]
        length: Of the first [m].
        other: Length of the second [m].
        par: Sum of the radii [m], where contact costs begin [m], the inverse scales of both costs [1/m].
        wide: Where collision costs begin, at the start of the second [m].
        rise: What that rises by along each metre of the second.
        near_one: A little more than 1, so that parallel axes divide by more than zero.
        zero: 0 of the type to compute in.
    """
    radii, contact, hinge, contact_hinge = par
    squared, t = nearest_on(r, u, v, b, c, f, length, other, near_one, zero)
    gap = np.sqrt(squared) - radii
    x = (wide + rise * t - gap) * hinge
    x = x if x > zero else zero
    y = (contact - gap) * contact_hinge
    y = y if y > zero else zero
    return x * x, y * y, gap


@njit(fastmath=FAST)
def _arm(padded: int, arm: Any, reach: Any, body: Any, par: Any, robot: Any, out: Any) -> None:
    """Add the nine pairs of one arm with the robot to the collision rows.

    One loop for all nine, since they share most products: with r from one start to the other, the next
    part's is r + length u, the next limb's r - length v.

    Args:
        padded: Number of columns, rounded up.
        arm: (ARM_ROWS * ROW,), see the layout.
        reach: Radii of its limbs (3,) [m].
        body: The robot's vector.
        par: Parameter vector.
        robot: Elbow, wrist and tool, then unit vectors along the parts (18 * ROW,).
        out: Collision, contact and smallest distance (3 * ROW,).
    """
    real = out.dtype.type
    zero, one = real(0.0), real(1.0)
    near_one = one + par[P_PARALLEL]
    margin, kappa = par[P_MARGIN], par[P_KAPPA]
    base, l1, l2, l3 = body[LENGTHS], body[LENGTHS + 1], body[LENGTHS + 2], body[LENGTHS + 3]
    same = (par[P_CONTACT_MARGIN], real(_HINGE), real(_CONTACT_HINGE))
    k11, k12, k13 = (
        (body[RADII] + reach[0], *same), (body[RADII] + reach[1], *same),
        (body[RADII] + reach[2], *same),
    )  # fmt: skip
    k21, k22, k23 = (
        (body[RADII + 1] + reach[0], *same), (body[RADII + 1] + reach[1], *same),
        (body[RADII + 1] + reach[2], *same),
    )  # fmt: skip
    k31, k32, k33 = (
        (body[RADII + 2] + reach[0], *same), (body[RADII + 2] + reach[1], *same),
        (body[RADII + 2] + reach[2], *same),
    )  # fmt: skip
    for i in range(padded):
        p = (robot[i], robot[ROW + i], robot[2 * ROW + i])
        w = (robot[3 * ROW + i], robot[4 * ROW + i], robot[5 * ROW + i])
        u1 = (robot[AXES * ROW + i], robot[(AXES + 1) * ROW + i], robot[(AXES + 2) * ROW + i])
        u2 = (robot[(AXES + 3) * ROW + i], robot[(AXES + 4) * ROW + i], robot[(AXES + 5) * ROW + i])
        u3 = (robot[(AXES + 6) * ROW + i], robot[(AXES + 7) * ROW + i], robot[(AXES + 8) * ROW + i])
        h = (arm[i], arm[ROW + i], arm[2 * ROW + i])
        v = (arm[ARM_AXIS * ROW + i], arm[(ARM_AXIS + 1) * ROW + i], arm[(ARM_AXIS + 2) * ROW + i])
        other = arm[ARM_LENGTH * ROW + i]
        wide = margin + kappa * arm[ARM_SIGMA * ROW + i]
        rise = kappa * arm[ARM_RISE * ROW + i]
        # Upper arm.
        r1 = (-h[0], -h[1], base - h[2])
        r2 = (p[0] - h[0], p[1] - h[1], p[2] - h[2])
        r3 = (w[0] - h[0], w[1] - h[1], w[2] - h[2])
        c1, c2, c3 = dot(u1, r1), dot(u2, r2), dot(u3, r3)
        b1, b2, b3 = dot(u1, v), dot(u2, v), dot(u3, v)
        f = dot(v, r1)
        x, y, near = _pair(r1, u1, v, b1, c1, f, l1, other, k11, wide, rise, near_one, zero)
        f = f + l1 * b1
        x2, y2, gap = _pair(r2, u2, v, b2, c2, f, l2, other, k21, wide, rise, near_one, zero)
        x, y, near = x + x2, y + y2, (near if near < gap else gap)
        f = f + l2 * b2
        x2, y2, gap = _pair(r3, u3, v, b3, c3, f, l3, other, k31, wide, rise, near_one, zero)
        x, y, near = x + x2, y + y2, (near if near < gap else gap)
        # Forearm.
        c1, c2, c3 = c1 - other * b1, c2 - other * b2, c3 - other * b3
        h = (arm[3 * ROW + i], arm[4 * ROW + i], arm[5 * ROW + i])
        v = (
            arm[(ARM_AXIS + 3) * ROW + i],
            arm[(ARM_AXIS + 4) * ROW + i],
            arm[(ARM_AXIS + 5) * ROW + i],
        )
        other = arm[(ARM_LENGTH + 1) * ROW + i]
        wide = margin + kappa * arm[(ARM_SIGMA + 1) * ROW + i]
        rise = kappa * arm[(ARM_RISE + 1) * ROW + i]
        r1 = (-h[0], -h[1], base - h[2])
        r2 = (p[0] - h[0], p[1] - h[1], p[2] - h[2])
        r3 = (w[0] - h[0], w[1] - h[1], w[2] - h[2])
        b1, b2, b3 = dot(u1, v), dot(u2, v), dot(u3, v)
        f = dot(v, r1)
        x2, y2, gap = _pair(r1, u1, v, b1, c1, f, l1, other, k12, wide, rise, near_one, zero)
        x, y, near = x + x2, y + y2, (near if near < gap else gap)
        f = f + l1 * b1
        x2, y2, gap = _pair(r2, u2, v, b2, c2, f, l2, other, k22, wide, rise, near_one, zero)
        x, y, near = x + x2, y + y2, (near if near < gap else gap)
        f = f + l2 * b2
        x2, y2, gap = _pair(r3, u3, v, b3, c3, f, l3, other, k32, wide, rise, near_one, zero)
        x, y, near = x + x2, y + y2, (near if near < gap else gap)
        # Hand.
        c1, c2, c3 = c1 - other * b1, c2 - other * b2, c3 - other * b3
        h = (arm[6 * ROW + i], arm[7 * ROW + i], arm[8 * ROW + i])
        v = (
            arm[(ARM_AXIS + 6) * ROW + i],
            arm[(ARM_AXIS + 7) * ROW + i],
            arm[(ARM_AXIS + 8) * ROW + i],
        )
        other = arm[(ARM_LENGTH + 2) * ROW + i]
        wide = margin + kappa * arm[(ARM_SIGMA + 2) * ROW + i]
        rise = kappa * arm[(ARM_RISE + 2) * ROW + i]
        r1 = (-h[0], -h[1], base - h[2])
        r2 = (p[0] - h[0], p[1] - h[1], p[2] - h[2])
        r3 = (w[0] - h[0], w[1] - h[1], w[2] - h[2])
        b1, b2, b3 = dot(u1, v), dot(u2, v), dot(u3, v)
        f = dot(v, r1)
        x2, y2, gap = _pair(r1, u1, v, b1, c1, f, l1, other, k13, wide, rise, near_one, zero)
        x, y, near = x + x2, y + y2, (near if near < gap else gap)
        f = f + l1 * b1
        x2, y2, gap = _pair(r2, u2, v, b2, c2, f, l2, other, k23, wide, rise, near_one, zero)
        x, y, near = x + x2, y + y2, (near if near < gap else gap)
        f = f + l2 * b2
        x2, y2, gap = _pair(r3, u3, v, b3, c3, f, l3, other, k33, wide, rise, near_one, zero)
        x, y, near = x + x2, y + y2, (near if near < gap else gap)
        out[i] += x
        out[ROW + i] += y
        before = out[2 * ROW + i]
        out[2 * ROW + i] = before if before < near else near


@njit(fastmath=FAST)
def dot(x: Any, y: Any) -> Any:
    """Scalar product of two vectors, three numbers each."""
    return x[0] * y[0] + x[1] * y[1] + x[2] * y[2]


@njit
def distances(
    q: Any, columns: int, body: Any, humans: Any, human_radii: Any, par: Any, work: Any
) -> None:
    """Forward kinematics and all capsule pairs of every column into the workspace.

    Args:
        q: Trajectory (7, ROW) [rad], standing still beyond its last column.
        columns: Columns in use.
        body: The robot's vector.
        humans: Arms over time (arms, ARM_ROWS * ROW), see the layout.
        human_radii: Of their limbs (arms, 3) [m].
        par: Parameter vector.
        work: Workspace.
    """
    padded = padded_columns(columns)
    # Slices, not offsets: indices must be seen to be positive, or nothing is vectorised.
    robot = work[ELBOW * ROW : (AXES + 9) * ROW]
    points(padded, q.reshape(7 * ROW), body, robot)
    out = work[COLLISION * ROW : (NEAREST + 1) * ROW]
    real = work.dtype.type
    for i in range(padded):
        out[i] = real(0.0)
        out[ROW + i] = real(0.0)
        out[2 * ROW + i] = real(FAR)
    for arm in range(humans.shape[0]):
        _arm(padded, humans[arm], human_radii[arm], body, par, robot, out)


@njit
def many_clearances(
    trajectories: Any, columns: int, body: Any, humans: Any, human_radii: Any, par: Any,
    work: Any, clearances: Any,
) -> None:  # fmt: skip
    """Smallest clearance at every column of many trajectories.

    Arguments as :func:`hri_planner.ptomp.kernel.many_costs`; ``clearances`` is the result
    (n, P >= columns) [m].
    """
    for index in range(trajectories.shape[0]):
        distances(trajectories[index], columns, body, humans, human_radii, par, work)
        for i in range(columns):
            clearances[index, i] = work[NEAREST * ROW + i]
