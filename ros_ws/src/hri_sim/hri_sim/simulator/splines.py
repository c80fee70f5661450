"""Piecewise polynomials in time: what a joint trajectory means between its points.

A path of S segments is a pair of arrays: ``knots`` (S + 1,) [s], increasing, and ``coefficients``
(S, 7, 6): on segment i joint j is at sum_k coefficients[i, j, k] (t - knots[i])^k [rad]. Before the
first knot and after the last one the path rests at its ends.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hri_prediction.compiled import njit

FloatArray = NDArray[np.float64]

DEGREES = 6
"""Coefficients of a segment: quintic polynomials."""


def linear(time_s: FloatArray, position: FloatArray) -> FloatArray:
    """Coefficients (S, 7, 6) of straight lines between positions (S + 1, 7) [rad] at times [s]."""
    result = np.zeros((len(time_s) - 1, position.shape[1], DEGREES))
    result[..., 0] = position[:-1]
    result[..., 1] = np.diff(position, axis=0) / np.diff(time_s)[:, None]
    return result


def cubic(time_s: FloatArray, position: FloatArray, velocity: FloatArray) -> FloatArray:
    """Cubic Hermite coefficients (S, 7, 6) through positions [rad] and velocities [rad/s]."""
    h = np.diff(time_s)[:, None]
    rise = np.diff(position, axis=0) / h
    result = np.zeros((len(time_s) - 1, position.shape[1], DEGREES))
    result[..., 0] = position[:-1]
    result[..., 1] = velocity[:-1]
    result[..., 2] = (3.0 * rise - 2.0 * velocity[:-1] - velocity[1:]) / h
    result[..., 3] = (velocity[:-1] + velocity[1:] - 2.0 * rise) / h**2
    return result


@njit
def quintic(
    time_s: FloatArray, position: FloatArray, velocity: FloatArray, acceleration: FloatArray
) -> FloatArray:
    """Quintic Hermite coefficients (S, 7, 6); also through the accelerations [rad/s^2]."""
    result = np.empty((position.shape[0] - 1, position.shape[1], DEGREES))
    for i in range(result.shape[0]):
        h = time_s[i + 1] - time_s[i]
        for j in range(result.shape[1]):
            v, w = velocity[i, j], velocity[i + 1, j]
            a, b = acceleration[i, j], acceleration[i + 1, j]
            rise = (position[i + 1, j] - position[i, j]) / h
            c = result[i, j]
            c[0], c[1], c[2] = position[i, j], v, 0.5 * a
            c[3] = ((10.0 * rise - 6.0 * v - 4.0 * w) / h + 0.5 * (b - 3.0 * a)) / h
            c[4] = ((8.0 * v + 7.0 * w - 15.0 * rise) / h + 0.5 * (3.0 * a - 2.0 * b)) / h**2
            c[5] = ((6.0 * rise - 3.0 * v - 3.0 * w) / h + 0.5 * (b - a)) / h**3
    return result


@njit
def evaluate(
    knots: FloatArray, coefficients: FloatArray, time: float, segment: int, state: FloatArray
) -> int:
    """Position, velocity and acceleration at one time.

    Args:
        knots: (S + 1,) [s].
        coefficients: (S, 7, 6).
        time: Where to evaluate [s].
        segment: Where to begin looking: the last answer, or 0.
        state: Result (3, 7) [rad, rad/s, rad/s^2].

    Returns:
        The segment that holds ``time``.
    """
    count = coefficients.shape[0]
    segment = min(max(segment, 0), count - 1)
    while segment < count - 1 and time >= knots[segment + 1]:
        segment += 1
    while segment > 0 and time < knots[segment]:
        segment -= 1
    before, after = time < knots[0], time >= knots[count]
    x = min(max(time, knots[segment]), knots[segment + 1]) - knots[segment]
    for j in range(coefficients.shape[1]):
        c = coefficients[segment, j]
        state[0, j] = c[0] + x * (c[1] + x * (c[2] + x * (c[3] + x * (c[4] + x * c[5]))))
        if before or after:
            state[1, j] = 0.0
            state[2, j] = 0.0
        else:
            slope = x * (3.0 * c[3] + x * (4.0 * c[4] + x * 5.0 * c[5]))
            state[1, j] = c[1] + x * (2.0 * c[2] + slope)
            state[2, j] = 2.0 * c[2] + x * (6.0 * c[3] + x * (12.0 * c[4] + x * 20.0 * c[5]))
    return segment


@njit
def reference(
    knots: FloatArray,
    coefficients: FloatArray,
    clock: FloatArray,
    dt: float,
    scale: float,
    limits: FloatArray,
    path: FloatArray,
    out: FloatArray,
) -> bool:
    """Move along a path for one step of the clock, as fast as scale and speed limits allow.

    The rate is min(scale, speed limit / path speed): the path stays, its time slows.

    Args:
        knots: (S + 1,) [s].
        coefficients: (S, 7, 6).
        clock: Path time [s], rate now, segment; updated (3,).
        dt: Clock step [s].
        scale: Rate that is asked for, 0...1.
        limits: Lowest and highest position [rad], largest speed [rad/s] (3, 7).
        path: Work space and result (3, 7): the path's state in its own time.
        out: Result (3, 7): reference position, velocity and acceleration in clock time.

    Returns:
        Whether the end is reached.
    """
    begin, rate = clock[0], clock[1]
    for attempt in range(2):
        clock[0] = begin + dt * rate
        clock[2] = evaluate(knots, coefficients, clock[0], int(clock[2]), path)
        allowed = scale
        for j in range(path.shape[1]):
            speed = abs(path[1, j])
            if speed * allowed > limits[2, j]:
                allowed = limits[2, j] / speed
        # Where the path speeds up steeply, the step itself must be shorter too.
        if attempt == 0 and allowed < rate and allowed < scale:
            rate = allowed
        else:
            break
    rate = allowed
    change = (rate - clock[1]) / dt if dt > 0.0 else 0.0
    clock[1] = rate
    for j in range(path.shape[1]):
        out[0, j] = path[0, j]
        out[1, j] = rate * path[1, j]
        out[2, j] = rate * rate * path[2, j] + change * path[1, j]
        # Splines may overshoot the checked bound by rounding only.
        if out[0, j] < limits[0, j] or out[0, j] > limits[1, j]:
            out[0, j] = min(max(out[0, j], limits[0, j]), limits[1, j])
    return bool(clock[0] >= knots[-1])


@njit
def _control_polygon(
    coefficients: FloatArray, knots: FloatArray, to_bernstein: FloatArray, bounds: FloatArray
) -> None:
    for i in range(coefficients.shape[0]):
        h = knots[i + 1] - knots[i]
        for j in range(coefficients.shape[1]):
            for row in range(DEGREES):
                point, power = 0.0, 1.0
                for k in range(row + 1):
                    point += to_bernstein[row, k] * power * coefficients[i, j, k]
                    power *= h
                bounds[0, j] = min(bounds[0, j], point)
                bounds[1, j] = max(bounds[1, j], point)


def extremes(coefficients: FloatArray, knots: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Lowest and highest position of every joint, each (7,) [rad].

    The bounds are those of the control polygon (monomials as Bernstein polynomials of degree 5,
    b_i = sum_k C(i, k) / C(5, k) a_k): never too narrow, exact where the path is monotone.
    """
    joints = coefficients.shape[1]
    bounds = np.stack((np.full(joints, np.inf), np.full(joints, -np.inf)))
    _control_polygon(coefficients, knots, _TO_BERNSTEIN, bounds)
    return bounds[0], bounds[1]


def sampled_extremes(
    coefficients: FloatArray, knots: FloatArray, count: int = 65
) -> tuple[FloatArray, FloatArray]:
    """As :func:`extremes`, from ``count`` samples a segment: accurate to 1e-3 of a segment."""
    x = np.linspace(0.0, 1.0, count)
    h = np.diff(knots)[:, None, None]
    values = (coefficients * h ** np.arange(DEGREES)) @ (x ** np.arange(DEGREES)[:, None])
    return values.min(axis=(0, 2)), values.max(axis=(0, 2))


def _bernstein() -> FloatArray:
    choose = np.zeros((DEGREES, DEGREES))
    for n in range(DEGREES):
        for k in range(n + 1):
            choose[n, k] = 1.0 if k in (0, n) else choose[n - 1, k - 1] + choose[n - 1, k]
    return choose / choose[-1]


_TO_BERNSTEIN = _bernstein()
