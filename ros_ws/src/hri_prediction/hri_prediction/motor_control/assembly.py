"""A reach as one vector of spline coefficients: its costs, their gradients and Hessian.

Coefficients are (n, 3): row i has those of the three joints. Rows before ``low`` and from ``high`` on are
given by the ends of the reach; those in between are the unknowns x, row by row, so that the Hessian is a
band of `BAND` elements on each side.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hri_prediction.compiled import njit
from hri_prediction.motor_control.compiled_graph import call
from hri_prediction.motor_control.integrand import (
    costs_at,
    gradient_at,
    gradients_at,
    hessian_at,
    multipliers_at,
)

BAND = 17
"""Half bandwidth: six coefficients of three joints meet in a point."""


@njit
def state_at(coefficients: Any, basis: Any, first: int, duration: float, out: Any) -> None:
    """State z (12,) at a point with the basis (4, 6) and the first coefficient that counts there."""
    scale = 1.0
    for k in range(4):
        for j in range(3):
            total = 0.0
            for a in range(6):
                total += basis[k, a] * coefficients[first + a, j]
            out[3 * k + j] = total * scale
        scale /= duration


@njit
def cost_integrals(
    values: int, coefficients: Any, basis: Any, first: Any, weights: Any, duration: float, arm: Any,
    power: float, speed: float, out: Any,
) -> None:  # fmt: skip
    """All seven costs (7,) of a reach."""
    z, y, part = np.empty(12), np.empty(10), np.empty(7)
    for k in range(7):
        out[k] = 0.0
    for point in range(first.shape[0]):
        state_at(coefficients, basis[point], first[point], duration, z)
        call(values, z.ctypes, arm.ctypes, arm.ctypes, y.ctypes)
        costs_at(z, y, power, speed, part)
        for k in range(7):
            out[k] += duration * weights[point] * part[k]


@njit
def scatter_gradient(
    by_state: Any, basis: Any, row: int, scale: Any, factor: float, out: Any
) -> None:
    """Add a gradient by the state (12,) to one by the unknowns.

    ``row`` is that of the point's first coefficient among the unknowns.
    """
    rows = out.shape[0] // 3
    for a in range(6):
        if 0 <= row + a < rows:
            for j in range(3):
                total = 0.0
                for k in range(4):
                    total += basis[k, a] * scale[k] * by_state[3 * k + j]
                out[3 * (row + a) + j] += factor * total


@njit
def scatter_hessian(
    by_state: Any, basis: Any, row: int, scale: Any, factor: float, half: Any, out: Any
) -> None:
    """Add a Hessian by the state (12, 12) to the lower triangle of one by the unknowns.

    Of the first the upper triangle counts; ``half`` (18, 12) is scratch.
    """
    rows = out.shape[0] // 3
    for i in range(12):
        for j in range(i):
            by_state[i, j] = by_state[j, i]
    for a in range(6):
        for j in range(3):
            for b in range(12):
                total = 0.0
                for k in range(4):
                    total += basis[k, a] * scale[k] * by_state[3 * k + j, b]
                half[3 * a + j, b] = total
    for a in range(6):
        if 0 <= row + a < rows:
            for j in range(3):
                for b in range(a + 1):
                    if row + b >= 0:
                        for m in range(3):
                            total = 0.0
                            for k in range(4):
                                total += half[3 * a + j, 3 * k + m] * basis[k, b] * scale[k]
                            out[3 * (row + a) + j, 3 * (row + b) + m] += factor * total


@njit
def derivatives(
    graph: Any, coefficients: Any, basis: Any, first: Any, weights: Any, duration: float, arm: Any,
    cost_weights: Any, power: float, speed: float, low: int, costs: Any, gradient: Any, hessian: Any,
) -> None:  # fmt: skip
    """Costs (7,); gradient (u,) and Hessian (u, u) of the weighted cost by the unknowns.

    Of the Hessian the lower triangle is made. ``graph`` (3,) has the addresses of the compiled functions.
    """
    z, y, multipliers, part = np.empty(12), np.empty(10), np.empty(10), np.empty(7)
    found, by_state, half = np.empty(264), np.empty(12), np.empty((18, 12))
    jacobian, second = found[:120].reshape(12, 10), found[120:].reshape(12, 12)
    scale = np.empty(4)
    for k in range(4):
        scale[k] = duration ** (-k)
    costs[:] = 0.0
    gradient[:] = 0.0
    hessian[:] = 0.0
    for point in range(first.shape[0]):
        state_at(coefficients, basis[point], first[point], duration, z)
        call(graph[0], z.ctypes, arm.ctypes, arm.ctypes, y.ctypes)
        costs_at(z, y, power, speed, part)
        multipliers_at(z, y, cost_weights, power, speed, multipliers)
        call(graph[2], z.ctypes, arm.ctypes, multipliers.ctypes, found.ctypes)
        gradient_at(z, y, jacobian, cost_weights, multipliers, power, by_state)
        hessian_at(z, y, jacobian, cost_weights, power, speed, second)
        factor, row = duration * weights[point], first[point] - low
        for k in range(7):
            costs[k] += factor * part[k]
        scatter_gradient(by_state, basis[point], row, scale, factor, gradient)
        scatter_hessian(second, basis[point], row, scale, factor, half, hessian)


@njit
def cost_gradients(
    graph: Any, coefficients: Any, basis: Any, first: Any, weights: Any, duration: float, arm: Any,
    power: float, speed: float, low: int, out: Any,
) -> None:  # fmt: skip
    """The gradient of each cost by the unknowns (7, u)."""
    z, y, work, chosen = np.empty(12), np.empty(10), np.empty(10), np.empty(7)
    jacobian, by_state = np.empty((12, 10)), np.empty((7, 12))
    scale = np.empty(4)
    for k in range(4):
        scale[k] = duration ** (-k)
    out[:] = 0.0
    for point in range(first.shape[0]):
        state_at(coefficients, basis[point], first[point], duration, z)
        call(graph[0], z.ctypes, arm.ctypes, arm.ctypes, y.ctypes)
        call(graph[1], z.ctypes, arm.ctypes, arm.ctypes, jacobian.ctypes)
        gradients_at(z, y, jacobian, power, speed, chosen, work, by_state)
        for k in range(7):
            scatter_gradient(
                by_state[k],
                basis[point],
                first[point] - low,
                scale,
                duration * weights[point],
                out[k],
            )
