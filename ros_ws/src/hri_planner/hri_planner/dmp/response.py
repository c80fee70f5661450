"""Motions that nothing interferes with: linear in the weights, so a matrix product makes many at once.

y(t) = y_0 + (g - y_0) b(t) + R(t) w on each axis, where b is the motion without weights and R the
response to each basis function. The same matrix fits weights to a demonstration.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hri_planner.dmp.basis import BASIS_COUNT, end_projector, forcing
from hri_planner.dmp.transformation import ALPHA, BETA, Gains, next_rate, step_gains
from hri_prediction.compiled import njit
from hri_prediction.errors import DataError

FloatArray = NDArray[np.float64]

_RIDGE = 1e-9
"""Of the fit, relative to the largest response: weights that do nothing stay small."""


@dataclass(frozen=True, eq=False)
class Response:
    """Of a motion of one duration, at n + 1 times from its begin on.

    Attributes:
        times: Shape (n + 1,) [s].
        base: Share of the way without weights (n + 1,).
        matrix: Response to weights that are projected here (n + 1, k).
    """

    times: FloatArray
    base: FloatArray
    matrix: FloatArray

    def rollouts(self, starts: FloatArray, goals: FloatArray, weights: FloatArray) -> FloatArray:
        """Where the tool is.

        Args:
            starts: Shape (..., 3) [m].
            goals: Shape (..., 3) [m].
            weights: Shape (..., 3, k) [m].

        Returns:
            Shape (..., n + 1, 3) [m].
        """
        lead = weights.shape[:-2]
        flat = weights.reshape(-1, weights.shape[-1])
        moved = (self.matrix @ flat.T).reshape(len(self.times), *lead, 3)
        way = self.base.reshape(-1, *([1] * (len(lead) + 1))) * (goals - starts)
        paths: FloatArray = np.moveaxis(starts + way + moved, 0, -2)
        return paths

    def fit(self, demonstration: FloatArray) -> FloatArray:
        """Weights (3, k) [m] whose motion is next to a demonstration (n + 1, 3) [m] at these times.

        The motion begins and ends where the demonstration does.

        Raises:
            DataError: when the demonstration has another shape, or is not finite.
        """
        path = np.asarray(demonstration, dtype=float)
        if path.shape != (len(self.times), 3) or not np.isfinite(path).all():
            raise DataError(
                f"demonstration of shape {path.shape}",
                expected=f"finite positions ({len(self.times)}, 3) in m",
            )
        rest = path - path[0] - self.base[:, None] * (path[-1] - path[0])
        count = self.matrix.shape[1]
        ridge = _RIDGE * np.abs(self.matrix).max() * len(self.times)
        normal = self.matrix.T @ self.matrix + ridge * np.eye(count)
        found = np.linalg.solve(normal, self.matrix.T @ rest)
        weights: FloatArray = np.ascontiguousarray((end_projector(count) @ found).T)
        return weights


@functools.lru_cache(maxsize=32)
def response(duration: float, dt: float, count: int = BASIS_COUNT) -> Response:
    """The response of a motion.

    Args:
        duration: tau [s].
        dt: Control period [s]; the last time is the first at or beyond the duration.
        count: Basis functions.

    Raises:
        DataError: when duration or period are not positive.
    """
    if not (math.isfinite(duration) and duration > 0.0 and math.isfinite(dt) and dt > 0.0):
        raise DataError(f"duration {duration} s, period {dt} s", expected="positive times")
    steps = math.ceil(duration / dt - 1e-9)
    matrix, _ = _responses(
        np.ascontiguousarray(end_projector(count)), steps, dt / duration, step_gains(dt / duration), 0.0
    )  # fmt: skip
    base, _ = _responses(np.zeros((1, count)), steps, dt / duration, step_gains(dt / duration), 1.0)
    found = Response(np.arange(steps + 1, dtype=np.float64) * dt, base[:, 0], matrix)
    for values in (found.times, found.base, found.matrix):
        values.setflags(write=False)
    return found


def free_response(weights: FloatArray, steps: int) -> tuple[FloatArray, FloatArray]:
    """Place and rate z of motions from 0 to 0 in as many steps, weights (m, k) as they are.

    Returns:
        Both (steps + 1, m) [m].
    """
    found: tuple[FloatArray, FloatArray] = _responses(
        np.ascontiguousarray(weights), steps, 1.0 / steps, step_gains(1.0 / steps), 0.0
    )
    return found


@njit
def _responses(weights: Any, steps: int, phase_step: float, gains: Gains, way: float) -> Any:
    """Motions over a way, each row of weights (m, k) on one axis: places and rates (steps + 1, m)."""
    count = len(weights)
    place, rates = np.zeros((steps + 1, count)), np.zeros((steps + 1, count))
    rate, driven = np.zeros(count), np.zeros(count)
    lag = -way
    for step in range(steps):
        forcing((step + 0.5) * phase_step, weights, driven)
        for index in range(count):
            offset = place[step, index] - way
            later = next_rate(offset, rate[index], lag, ALPHA * BETA * driven[index], gains)
            place[step + 1, index] = place[step, index] + 0.5 * phase_step * (rate[index] + later)
            rate[index] = later
            rates[step + 1, index] = later
        lag *= gains[4]
    return place, rates
