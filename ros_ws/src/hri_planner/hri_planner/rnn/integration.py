"""Accelerations of recorded hands, and the integrator that gives back exactly those hands.

A policy is taught accelerations and judged by where they lead. Label and integrator are exact
inverses of each other:

    a_t = (s_{t+1} - 2 s_t + s_{t-1}) / dt²,  a_0 = 0,  v_0 = (s_1 - s_0) / dt,
    v_{t+1} = v_t + a_t dt,  s_{t+1} = s_t + v_{t+1} dt,

so v_t is the mean velocity over the step *to* t, but for v_0, which is that over the step from 0.
(Central differences integrated by the trapezoid rule, as in the thesis' eq. 5.15, end centimetres
off.)
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hri_prediction.errors import DataError

FloatArray = NDArray[np.float64]


def accelerations(positions: ArrayLike, dt: float) -> FloatArray:
    """Accelerations that lead from each position to the next but one.

    Args:
        positions: Of a hand, shape (n, 3), n >= 2, evenly spaced in time [m].
        dt: Time step [s].

    Returns:
        Shape (n - 1, 3) [m/s²]; the first is zero. The last position has none.

    Raises:
        DataError: when the shape is wrong or a value is not finite.
    """
    path = _checked(positions)
    found = np.zeros((len(path) - 1, 3))
    found[1:] = np.diff(path, n=2, axis=0) / dt**2
    return found


def initial_velocity(positions: ArrayLike, dt: float) -> FloatArray:
    """v_0 (3,) [m/s] of positions (n, 3) [m].

    Raises:
        DataError: when the shape is wrong or a value is not finite.
    """
    path = _checked(positions)
    first: FloatArray = (path[1] - path[0]) / dt
    return first


def integrate(
    start: ArrayLike, velocity: ArrayLike, acceleration: ArrayLike, dt: float
) -> FloatArray:
    """Positions that accelerations lead to.

    Args:
        start: First position (..., 3) [m].
        velocity: v_0 (..., 3) [m/s].
        acceleration: Shape (..., n, 3) [m/s²].
        dt: Time step [s].

    Returns:
        Shape (..., n + 1, 3) [m].
    """
    begin = np.asarray(start, dtype=float)[..., None, :]
    speed = np.asarray(velocity, dtype=float)[..., None, :]
    steps = np.cumsum(np.asarray(acceleration, dtype=float), axis=-2) * dt + speed
    return np.concatenate((begin, begin + np.cumsum(steps, axis=-2) * dt), axis=-2)


def _checked(positions: ArrayLike) -> FloatArray:
    path = np.asarray(positions, dtype=float)
    if path.ndim != 2 or path.shape[1] != 3 or len(path) < 2:
        raise DataError(f"positions have shape {path.shape}", expected="(n, 3) with n >= 2")
    if not np.isfinite(path).all():
        row = int(np.flatnonzero(~np.isfinite(path).all(axis=1))[0])
        raise DataError(f"position {row} is {path[row]}", expected="finite coordinates in m")
    return path
