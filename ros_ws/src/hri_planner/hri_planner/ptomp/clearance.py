"""Forward kinematics and distances of 3 x 3 capsules of many columns at once, compiled.

Every loop over columns is free of branches and calls, so that the compiler turns it into vector
instructions: sine and cosine are polynomials, clamps are selections.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hri_planner.ptomp.layout import (
    AHEAD,
    COLLISION,
    ELBOW,
    FAR,
    FAST,
    FIRST_FREE,
    FREE,
    LANES,
    LENGTHS,
    LIMB_AXIS,
    LIMB_INVERSE,
    LIMB_RISE,
    LIMB_SIGMA,
    LIMB_SQUARE,
    NEAREST,
    P_CONTACT_MARGIN,
    P_KAPPA,
    P_MARGIN,
    RADII,
    ROW,
    TOOL,
)  # fmt: skip
from hri_prediction.compiled import njit

_HINGE = 1.0 / 0.05  # the collision cost's length scale of the thesis' follow-up, 5 cm
_CONTACT_HINGE = 1.0 / 0.01
_PARALLEL = 1e-14  # m^4, keeps the division of parallel axes finite


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
def _sine_cosine(angle: Any, series: Any) -> Any:
    """Both of one angle: error below 1e-12 for angles up to 3.6 rad.

    Taylor series of the half angle, then doubled. ``series`` holds their coefficients, highest power of
    the square first: nine of the sine over its argument, ten of the cosine.
    """
    y = series[0] * angle
    z = y * y
    s = series[1] * z + series[2]
    s = s * z + series[3]
    s = s * z + series[4]
    s = s * z + series[5]
    s = s * z + series[6]
    s = s * z + series[7]
    s = s * z + series[8]
    s = s * z * y + y
    c = series[9] * z + series[10]
    c = c * z + series[11]
    c = c * z + series[12]
    c = c * z + series[13]
    c = c * z + series[14]
    c = c * z + series[15]
    c = c * z + series[16]
    c = c * z - series[0]
    c = c * z + series[17]
    return (s + s) * c, series[17] - (s + s) * s


@njit(fastmath=FAST)
def points(padded: int, q: Any, body: Any, out: Any) -> None:
    """Elbow, wrist and tool of every column; the formulas are those of robot/kinematics.py.

    Args:
        padded: Number of columns, rounded up.
        q: Angles (7 * ROW,) [rad].
        body: The robot's vector.
        out: Result (9 * ROW,) [m].
    """
    real = out.dtype.type
    series = (
        real(0.5),
        real(1.0 / 355687428096000.0), real(-1.0 / 1307674368000.0), real(1.0 / 6227020800.0),
        real(-1.0 / 39916800.0), real(1.0 / 362880.0), real(-1.0 / 5040.0), real(1.0 / 120.0),
        real(-1.0 / 6.0),
        real(-1.0 / 6402373705728000.0), real(1.0 / 20922789888000.0), real(-1.0 / 87178291200.0),
        real(1.0 / 479001600.0), real(-1.0 / 3628800.0), real(1.0 / 40320.0), real(-1.0 / 720.0),
        real(1.0 / 24.0), real(1.0),
    )  # fmt: skip
    base, upper, lower, hand = (
        body[LENGTHS],
        body[LENGTHS + 1],
        body[LENGTHS + 2],
        body[LENGTHS + 3],
    )
    for i in range(padded):
        s1, c1 = _sine_cosine(q[i], series)
        s2, c2 = _sine_cosine(q[ROW + i], series)
        s3, c3 = _sine_cosine(q[2 * ROW + i], series)
        s4, c4 = _sine_cosine(q[3 * ROW + i], series)
        s5, c5 = _sine_cosine(q[4 * ROW + i], series)
        s6, c6 = _sine_cosine(q[5 * ROW + i], series)
        z0, z1, z2 = -c1 * s2, -s1 * s2, c2
        e0, e1, e2 = upper * z0, upper * z1, base + upper * z2
        m0, m1 = c1 * c2, s1 * c2
        u0, u1, u2 = c3 * m0 - s3 * s1, c3 * m1 + s3 * c1, c3 * s2
        y0, y1, y2 = -c3 * s1 - s3 * m0, c3 * c1 - s3 * m1, -s3 * s2
        x0, x1, x2 = c4 * u0 - s4 * z0, c4 * u1 - s4 * z1, c4 * u2 - s4 * z2
        z0, z1, z2 = s4 * u0 + c4 * z0, s4 * u1 + c4 * z1, s4 * u2 + c4 * z2
        w0, w1, w2 = e0 + lower * z0, e1 + lower * z1, e2 + lower * z2
        u0, u1, u2 = c5 * x0 + s5 * y0, c5 * x1 + s5 * y1, c5 * x2 + s5 * y2
        out[i] = e0
        out[ROW + i] = e1
        out[2 * ROW + i] = e2
        out[3 * ROW + i] = w0
        out[4 * ROW + i] = w1
        out[5 * ROW + i] = w2
        out[6 * ROW + i] = w0 + hand * (c6 * z0 - s6 * u0)
        out[7 * ROW + i] = w1 + hand * (c6 * z1 - s6 * u1)
        out[8 * ROW + i] = w2 + hand * (c6 * z2 - s6 * u2)


@njit(fastmath=FAST)
def _axes_apart(
    r: Any, u: Any, v: Any, a: Any, inverse_a: Any, e: Any, inverse_e: Any, b: Any, f: Any,
    constants: Any,
) -> Any:  # fmt: skip
    """Distance of two segments, and where on the second it is (0 at its start, 1 at its end).

    Ericson, Real-Time Collision Detection (2005), section 5.1.9, with selections for branches.

    Args:
        r: From the start of the second to the start of the first (3 numbers) [m].
        u: Axis of the first.
        v: Axis of the second.
        a: u.u, and its inverse.
        inverse_a: See a.
        e: v.v, and its inverse.
        inverse_e: See e.
        b: u.v
        f: v.r
        constants: 0, 1 and ``_PARALLEL`` of the type to compute in.
    """
    zero, one, tiny = constants
    c = u[0] * r[0] + u[1] * r[1] + u[2] * r[2]
    s = (b * f - c * e) / (a * e - b * b + tiny)
    s = s if s > zero else zero
    s = s if s < one else one
    t = (b * s + f) * inverse_e
    t = t if t > zero else zero
    t = t if t < one else one
    s = (b * t - c) * inverse_a
    s = s if s > zero else zero
    s = s if s < one else one
    g0 = r[0] + s * u[0] - t * v[0]
    g1 = r[1] + s * u[1] - t * v[1]
    g2 = r[2] + s * u[2] - t * v[2]
    return np.sqrt(g0 * g0 + g1 * g1 + g2 * g2), t


@njit(fastmath=FAST)
def _limb(padded: int, limb: Any, reach: Any, body: Any, par: Any, robot: Any, out: Any) -> None:
    """Add the pairs of one limb with the robot's three capsules to the collision rows.

    Inputs and outputs are different flat arrays with constant row lengths: only then can the compiler
    see, with a few checks at run time, that they do not overlap.

    Args:
        padded: Number of columns, rounded up.
        limb: (LIMB_ROWS * ROW,), see the layout.
        reach: The limb's radius [m].
        body: The robot's vector.
        par: Parameter vector.
        robot: Elbow, wrist and tool (9 * ROW,) [m].
        out: Collision, contact and smallest distance (3 * ROW,).
    """
    real = out.dtype.type
    zero, one = real(0.0), real(1.0)
    constants = (zero, one, real(_PARALLEL))
    margin, kappa, contact = par[P_MARGIN], par[P_KAPPA], par[P_CONTACT_MARGIN]
    hinge, contact_hinge = real(_HINGE), real(_CONTACT_HINGE)
    base = body[LENGTHS]
    a1 = body[LENGTHS + 1] * body[LENGTHS + 1]
    a2 = body[LENGTHS + 2] * body[LENGTHS + 2]
    a3 = body[LENGTHS + 3] * body[LENGTHS + 3]
    i1, i2, i3 = one / a1, one / a2, one / a3
    d1, d2, d3 = body[RADII] + reach, body[RADII + 1] + reach, body[RADII + 2] + reach
    for i in range(padded):
        h0, h1, h2 = limb[i], limb[ROW + i], limb[2 * ROW + i]
        v0 = limb[LIMB_AXIS * ROW + i]
        v1 = limb[(LIMB_AXIS + 1) * ROW + i]
        v2 = limb[(LIMB_AXIS + 2) * ROW + i]
        e, inverse_e = limb[LIMB_SQUARE * ROW + i], limb[LIMB_INVERSE * ROW + i]
        sigma, rise = limb[LIMB_SIGMA * ROW + i], limb[LIMB_RISE * ROW + i]
        p0, p1, p2 = robot[i], robot[ROW + i], robot[2 * ROW + i]
        w0, w1, w2 = robot[3 * ROW + i], robot[4 * ROW + i], robot[5 * ROW + i]
        t0, t1, t2 = robot[6 * ROW + i], robot[7 * ROW + i], robot[8 * ROW + i]
        v = (v0, v1, v2)
        # Upper arm, from the shoulder (0, 0, base); v.r of the next part is v.r + u.v of this one.
        u = (p0, p1, p2 - base)
        r = (-h0, -h1, base - h2)
        b = u[0] * v0 + u[1] * v1 + u[2] * v2
        f = v0 * r[0] + v1 * r[1] + v2 * r[2]
        gap1, place1 = _axes_apart(r, u, v, a1, i1, e, inverse_e, b, f, constants)
        f = f + b
        u = (w0 - p0, w1 - p1, w2 - p2)
        r = (p0 - h0, p1 - h1, p2 - h2)
        b = u[0] * v0 + u[1] * v1 + u[2] * v2
        gap2, place2 = _axes_apart(r, u, v, a2, i2, e, inverse_e, b, f, constants)
        f = f + b
        u = (t0 - w0, t1 - w1, t2 - w2)
        r = (w0 - h0, w1 - h1, w2 - h2)
        b = u[0] * v0 + u[1] * v1 + u[2] * v2
        gap3, place3 = _axes_apart(r, u, v, a3, i3, e, inverse_e, b, f, constants)
        gap1, gap2, gap3 = gap1 - d1, gap2 - d2, gap3 - d3
        wide = margin + kappa * sigma
        rise = kappa * rise
        x1 = (wide + rise * place1 - gap1) * hinge
        x2 = (wide + rise * place2 - gap2) * hinge
        x3 = (wide + rise * place3 - gap3) * hinge
        x1 = x1 if x1 > zero else zero
        x2 = x2 if x2 > zero else zero
        x3 = x3 if x3 > zero else zero
        out[i] += x1 * x1 + x2 * x2 + x3 * x3
        x1 = (contact - gap1) * contact_hinge
        x2 = (contact - gap2) * contact_hinge
        x3 = (contact - gap3) * contact_hinge
        x1 = x1 if x1 > zero else zero
        x2 = x2 if x2 > zero else zero
        x3 = x3 if x3 > zero else zero
        out[ROW + i] += x1 * x1 + x2 * x2 + x3 * x3
        near = out[2 * ROW + i]
        gap1 = gap1 if gap1 < gap2 else gap2
        near = near if near < gap3 else gap3
        out[2 * ROW + i] = near if near < gap1 else gap1


@njit
def distances(
    q: Any, columns: int, body: Any, humans: Any, human_radii: Any, par: Any, work: Any
) -> None:
    """Forward kinematics and all capsule pairs of every column into the workspace.

    Args:
        q: Trajectory (7, ROW) [rad], standing still beyond its last column.
        columns: Columns in use.
        body: The robot's vector.
        humans: Limbs over time (limbs, LIMB_ROWS * ROW), see the layout.
        human_radii: (limbs,) [m].
        par: Parameter vector.
        work: Workspace.
    """
    padded = padded_columns(columns)
    # Slices, not offsets: indices must be seen to be positive, or nothing is vectorised.
    robot = work[ELBOW * ROW : (TOOL + 3) * ROW]
    points(padded, q.reshape(7 * ROW), body, robot)
    out = work[COLLISION * ROW : (NEAREST + 1) * ROW]
    real = work.dtype.type
    for i in range(padded):
        out[i] = real(0.0)
        out[ROW + i] = real(0.0)
        out[2 * ROW + i] = real(FAR)
    for limb in range(humans.shape[0]):
        _limb(padded, humans[limb], human_radii[limb], body, par, robot, out)


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
