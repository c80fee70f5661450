"""Quintic pieces, compiled: a replan samples them by the hundred, beside a busy executor."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hri_prediction.compiled import njit

FloatArray = NDArray[np.float64]


@njit
def coefficients(
    gap: float, v0: float, a0: float, v1: float, a1: float, h: float
) -> tuple[float, float, float, float, float]:
    """Coefficients 1 to 5 of a quintic over the share x of a piece.

    Args:
        gap: Rise over the piece.
        v0: Slope at its start.
        a0: Second derivative there.
        v1: Slope at its end.
        a1: Second derivative there.
        h: Its length [s].
    """
    v, a = v0 * h, 0.5 * a0 * h * h
    left = gap - v - a
    rise = v1 * h - v - 2.0 * a
    bend = a1 * h * h - 2.0 * a
    return (
        v,
        a,
        10.0 * left - 4.0 * rise + 0.5 * bend,
        -15.0 * left + 7.0 * rise - bend,
        6.0 * left - 3.0 * rise + 0.5 * bend,
    )


@njit
def sample(
    knots: FloatArray,
    q: FloatArray,
    qd: FloatArray,
    qdd: FloatArray,
    times: FloatArray,
    out: FloatArray,
) -> None:
    """States of a chain of quintics at times (n,) into out (3, n, 7).

    Before the first and after the last knot the motion stands still there.
    """
    last = len(knots) - 1
    for i in range(len(times)):
        t = times[i]
        standing = last == 0 or t < knots[0] or t > knots[last]
        if standing:
            place = 0 if t < knots[0] else last
            for joint in range(q.shape[1]):
                out[0, i, joint] = q[place, joint]
                out[1, i, joint] = 0.0
                out[2, i, joint] = 0.0
            continue
        # Of two knots at the same distance the later piece, as everywhere in the project.
        k = min(max(np.searchsorted(knots, t, side="right") - 1, 0), last - 1)
        h = knots[k + 1] - knots[k]
        x = (t - knots[k]) / h
        for joint in range(q.shape[1]):
            c1, c2, c3, c4, c5 = coefficients(
                q[k + 1, joint] - q[k, joint], qd[k, joint], qdd[k, joint],
                qd[k + 1, joint], qdd[k + 1, joint], h,
            )  # fmt: skip
            out[0, i, joint] = q[k, joint] + x * (c1 + x * (c2 + x * (c3 + x * (c4 + x * c5))))
            slope = c1 + x * (2.0 * c2 + x * (3.0 * c3 + x * (4.0 * c4 + x * 5.0 * c5)))
            bend = 2.0 * c2 + x * (6.0 * c3 + x * (12.0 * c4 + x * 20.0 * c5))
            out[1, i, joint] = slope / h
            out[2, i, joint] = bend / (h * h)


@njit
def first_within(
    durations: FloatArray,
    state: FloatArray,
    ends: FloatArray,
    samples: int,
    lower: FloatArray,
    upper: FloatArray,
    fastest: FloatArray,
    hardest: FloatArray,
) -> int:
    """Index of the first duration whose quintic to rest keeps all limits; the last if none does.

    Args:
        durations: (D,) [s], increasing.
        state: Position, velocity, acceleration at the start (3, 7).
        ends: Posture at the end for each duration (D, 7) [rad].
        samples: Points at which each quintic is looked at.
        lower: Joint limits (7,) [rad].
        upper: Joint limits (7,) [rad].
        fastest: Largest speeds (7,) [rad/s].
        hardest: Largest accelerations (7,) [rad/s^2].
    """
    for index in range(len(durations)):
        h = durations[index]
        good = True
        for joint in range(state.shape[1]):
            q0 = state[0, joint]
            c1, c2, c3, c4, c5 = coefficients(
                ends[index, joint] - q0, state[1, joint], state[2, joint], 0.0, 0.0, h
            )
            for i in range(samples):
                x = i / (samples - 1.0)
                q = q0 + x * (c1 + x * (c2 + x * (c3 + x * (c4 + x * c5))))
                qd = c1 + x * (2.0 * c2 + x * (3.0 * c3 + x * (4.0 * c4 + x * 5.0 * c5)))
                qdd = 2.0 * c2 + x * (6.0 * c3 + x * (12.0 * c4 + x * 20.0 * c5))
                if (
                    q < lower[joint]
                    or q > upper[joint]
                    or abs(qd) > fastest[joint] * h
                    or abs(qdd) > hardest[joint] * h * h
                ):
                    good = False
                    break
            if not good:
                break
        if good:
            return index
    return len(durations) - 1
