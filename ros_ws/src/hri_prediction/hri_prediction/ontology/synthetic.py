"""Movements that are optimal for known weights: what learning must find again.

A movement is bent, its ends held, until w·Φ is least (L-BFGS). Bends are reckoned in those of least jerk,
so that a step changes all of a movement smoothly.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from hri_prediction.compiled import njit
from hri_prediction.errors import DataError
from hri_prediction.ontology.costs import COUNT, LENGTH_M, NUMBER
from hri_prediction.ontology.features import fill_features
from hri_prediction.ontology.movements import Movement
from hri_prediction.ontology.sampling import bends, third_differences
from hri_prediction.ontology.upper_body import Geometry, points_of

FloatArray = NDArray[np.float64]

_STEP = 1e-5
"""Of central differences [m, rad]: what they are off by decides how optimal a movement can become."""


@njit
def _nearness(
    q: FloatArray,
    partner: FloatArray,
    body: Geometry,
    length: float,
    weights: FloatArray,
    room: tuple[FloatArray, FloatArray, FloatArray],
) -> float:
    """Weighted nearness of a posture; ``room`` (3, 3), (4, 3), (25,) is for intermediate results."""
    frame, points, distances = room
    points_of(q, body, frame, points)
    fill_features(points, partner, distances)
    total = 0.0
    for k in range(25):
        total += weights[k] * math.exp(-distances[k] / length)
    return total


@njit
def _nearness_gradient(
    path: FloatArray,
    partner: FloatArray,
    body: Geometry,
    length: float,
    weights: FloatArray,
    out: FloatArray,
) -> float:
    """Weighted nearness of a movement (n, 14), summed over its points, and what each joint does to it."""
    room = (np.empty((3, 3)), np.empty((4, 3)), np.empty(25))
    total = 0.0
    for row in range(path.shape[0]):
        q = path[row].copy()
        total += _nearness(q, partner[row], body, length, weights, room)
        for joint in range(q.shape[0]):
            kept = q[joint]
            q[joint] = kept + _STEP
            ahead = _nearness(q, partner[row], body, length, weights, room)
            q[joint] = kept - _STEP
            behind = _nearness(q, partner[row], body, length, weights, room)
            q[joint] = kept
            out[row, joint] = (ahead - behind) / (2.0 * _STEP)
    return total


def total_cost(
    movement: Movement, path: FloatArray, weights: FloatArray, length: float = LENGTH_M
) -> tuple[float, FloatArray]:
    """The cost w·Φ of a path beside a movement's partner, and its gradient (n, 14)."""
    gradient = np.empty_like(path)
    nearness = _nearness_gradient(
        path, movement.partner, movement.body.geometry, length, weights[:COUNT], gradient
    )
    rough = third_differences(path)
    # Ends are repeated beyond themselves, so that what is beyond counts for the ends.
    back = -np.diff(rough, 3, axis=0)
    value = movement.step_s * nearness + weights[COUNT] * float((rough**2).sum())
    return value, movement.step_s * gradient + 2.0 * weights[COUNT] * _inner(back, len(path))


def _inner(back: FloatArray, count: int) -> FloatArray:
    """Of a gradient of all points that of the inner ones; ends are held, so theirs is nothing."""
    found = np.zeros((count, back.shape[1]))
    found[1:-1] = back[1:-1]
    return found


def optimal_movement(
    movement: Movement,
    weights: FloatArray,
    length: float = LENGTH_M,
    free: NDArray[np.bool_] | None = None,
) -> Movement:
    """The movement bent until it costs least, its ends held.

    Args:
        movement: Where to begin.
        weights: Of the costs (26,), none negative, that of smoothness positive.
        length: Distance over which nearness falls to 1/e [m].
        free: Joints that may move otherwise (14,); none: all of them.

    Raises:
        DataError: when weights are others than these.
    """
    if weights.shape != (NUMBER,) or (weights < 0.0).any() or not weights[COUNT] > 0.0:
        raise DataError(
            f"weights {weights.tolist()}",
            expected=f"({NUMBER},), none negative, the last one positive",
        )
    basis = bends(len(movement.joints) - 2)
    moving = np.flatnonzero(np.ones(movement.joints.shape[1], bool) if free is None else free)
    shape = (len(basis), len(moving))

    def bent(z: FloatArray) -> FloatArray:
        path = movement.joints.copy()
        path[1:-1, moving] += basis @ z.reshape(shape)
        return path

    def objective(z: FloatArray) -> tuple[float, FloatArray]:
        value, gradient = total_cost(movement, bent(z), weights, length)
        return value, (basis.T @ gradient[1:-1, moving]).ravel()

    found = minimize(
        objective,
        np.zeros(shape[0] * shape[1]),
        jac=True,
        method="L-BFGS-B",
        # To where rounding ends the line search: what is learnt from is how the cost rises about it.
        options={"maxiter": 1000, "maxfun": 3000, "maxcor": 30, "ftol": 0.0, "gtol": 1e-12},
    )
    return replace(movement, joints=bent(found.x), beyond=None)
