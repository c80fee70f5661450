"""Forward kinematics of many columns at once, compiled.

The loop over columns is free of branches and calls, so that the compiler turns it into vector
instructions: sine and cosine are polynomials.
"""

from __future__ import annotations

from typing import Any

from hri_planner.ptomp.layout import FAST, LENGTHS, ROW
from hri_prediction.compiled import njit

# Polynomials in q^2, highest power first: 2 sin(q / 2) / q and cos(q / 2), interpolated at the Chebyshev
# nodes of |q| <= 3.2 rad. There sine and cosine of q are right to 1e-14, at 3.6 rad to 1e-11.
_TWICE_SINE = (
    -4.489327306432928e-17, 3.9176148414145907e-14, -2.44646761380694e-11,
    1.076457646207855e-08, -3.1001984090569118e-06, 0.0005208333333287287,
    -0.0416666666666648, 1.0,
)  # fmt: skip
_COSINE = (
    -6.707439595915494e-16, 5.091990828775124e-13, -2.691102183925224e-10,
    9.688118005290571e-08, -2.1701388835752558e-05, 0.0026041666665989442,
    -0.124999999999968, 0.999999999999998,
)  # fmt: skip


@njit(fastmath=FAST)
def _sine_cosine(angle: Any, twice_sine: Any, cosine: Any, one: Any, half: Any) -> Any:
    """Both of one angle, by polynomials of the half angle; see ``_TWICE_SINE``."""
    z = angle * angle
    s = twice_sine[0] * z + twice_sine[1]
    s = s * z + twice_sine[2]
    s = s * z + twice_sine[3]
    s = s * z + twice_sine[4]
    s = s * z + twice_sine[5]
    s = s * z + twice_sine[6]
    s = (s * z + twice_sine[7]) * angle
    c = cosine[0] * z + cosine[1]
    c = c * z + cosine[2]
    c = c * z + cosine[3]
    c = c * z + cosine[4]
    c = c * z + cosine[5]
    c = c * z + cosine[6]
    c = c * z + cosine[7]
    return s * c, one - half * s * s


@njit
def _typed(values: Any, real: Any) -> Any:
    """Eight numbers of the type to compute in."""
    return (
        real(values[0]), real(values[1]), real(values[2]), real(values[3]),
        real(values[4]), real(values[5]), real(values[6]), real(values[7]),
    )  # fmt: skip


@njit(fastmath=FAST)
def points(padded: int, q: Any, body: Any, out: Any) -> None:
    """Elbow, wrist, tool and axes of every column; the formulas are those of robot/kinematics.py.

    Args:
        padded: Number of columns, rounded up.
        q: Angles (7 * ROW,) [rad].
        body: The robot's vector.
        out: Result (18 * ROW,): the points [m], then unit vectors along the three parts.
    """
    real = out.dtype.type
    one, half = real(1.0), real(0.5)
    sine, cosine = _typed(_TWICE_SINE, real), _typed(_COSINE, real)
    base, upper, lower, hand = (
        body[LENGTHS],
        body[LENGTHS + 1],
        body[LENGTHS + 2],
        body[LENGTHS + 3],
    )
    for i in range(padded):
        s1, c1 = _sine_cosine(q[i], sine, cosine, one, half)
        s2, c2 = _sine_cosine(q[ROW + i], sine, cosine, one, half)
        s3, c3 = _sine_cosine(q[2 * ROW + i], sine, cosine, one, half)
        s4, c4 = _sine_cosine(q[3 * ROW + i], sine, cosine, one, half)
        s5, c5 = _sine_cosine(q[4 * ROW + i], sine, cosine, one, half)
        s6, c6 = _sine_cosine(q[5 * ROW + i], sine, cosine, one, half)
        z0, z1, z2 = -c1 * s2, -s1 * s2, c2
        e0, e1, e2 = upper * z0, upper * z1, base + upper * z2
        out[9 * ROW + i] = z0
        out[10 * ROW + i] = z1
        out[11 * ROW + i] = z2
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
        out[12 * ROW + i] = z0
        out[13 * ROW + i] = z1
        out[14 * ROW + i] = z2
        z0, z1, z2 = c6 * z0 - s6 * u0, c6 * z1 - s6 * u1, c6 * z2 - s6 * u2
        out[6 * ROW + i] = w0 + hand * z0
        out[7 * ROW + i] = w1 + hand * z1
        out[8 * ROW + i] = w2 + hand * z2
        out[15 * ROW + i] = z0
        out[16 * ROW + i] = z1
        out[17 * ROW + i] = z2
