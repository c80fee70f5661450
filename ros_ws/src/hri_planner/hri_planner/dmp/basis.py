"""Shapes of the forcing term over the phase u = t / tau of a motion, 0 to 1.

Normalised Gaussians with equally spaced centres, times a gate that is zero at both ends: the motion
begins without acceleration. Forcing moves the tool with a lag, so a gate alone leaves some of it beyond
the end; what weights would do to place and speed at u = 1 is taken out of them instead, by a projection.
So each motion ends at its goal, whatever its weights are.
"""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hri_prediction.compiled import njit

FloatArray = NDArray[np.float64]

BASIS_COUNT = 20
"""Basis functions on each axis."""
WIDTH = 0.7
"""Standard deviation of a basis function, as a share of the distance of two centres."""
RISE, FALL = 0.05, 0.30
"""Shares of the motion in which the gate opens and closes."""


@njit
def gate(phase: float) -> float:
    """How much of the forcing is let through, 0 to 1; without a step at either end."""
    if phase <= 0.0 or phase >= 1.0:
        return 0.0
    closed = max(1.0 - phase / RISE, 0.0) + max(1.0 - (1.0 - phase) / FALL, 0.0)
    return 1.0 - closed * closed * closed


@njit
def forcing(phase: float, weights: Any, out: Any) -> None:
    """s(u) Psi(u) w of weights that are projected.

    Args:
        phase: u.
        weights: Shape (d, n) [m]; see :func:`projected`.
        out: Result (d,) [m].
    """
    opened = gate(phase)
    out[:] = 0.0
    if opened == 0.0:
        return
    count = weights.shape[1]
    total = 0.0
    for index in range(count):
        off = (phase * (count - 1) - index) / WIDTH
        activation = np.exp(-0.5 * off * off)
        total += activation
        for axis in range(len(out)):
            out[axis] += activation * weights[axis, index]
    for axis in range(len(out)):
        out[axis] *= opened / total


@functools.cache
def end_projector(count: int = BASIS_COUNT) -> FloatArray:
    """Takes out of weights what they would do to place and speed at the end of a motion.

    Args:
        count: Basis functions.

    Returns:
        Symmetric projector (count, count), of rank count - 2.
    """
    from hri_planner.dmp.response import free_response

    position, speed = free_response(np.eye(count), _STEPS)
    ends = np.stack((position[-1], speed[-1] / np.abs(speed).max()))
    solved = np.linalg.solve(ends @ ends.T, ends)
    projector: FloatArray = np.eye(count) - ends.T @ solved
    projector = 0.5 * (projector + projector.T)
    projector.setflags(write=False)
    return projector


def projected(weights: FloatArray) -> FloatArray:
    """Weights (..., n) [m] as they take effect."""
    return np.ascontiguousarray(weights @ end_projector(weights.shape[-1]))


_STEPS = 1000
