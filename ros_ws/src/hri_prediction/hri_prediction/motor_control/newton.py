"""Projected Newton's method on banded Hessians, for unknowns between bounds.

After Bertsekas (1982, SIAM J. Control and Optimization 20:221): unknowns at a bound that the gradient
presses against stay; the others take a Newton step, which is cut back along the projection until the cost
falls. Where the Hessian is not positive definite it gets as much of a second, positive definite matrix as
it needs.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from hri_prediction.compiled import njit
from hri_prediction.motor_control.assembly import BAND, cost_integrals, derivatives

CONVERGED, STALLED, EXHAUSTED = 0, 1, 2
"""How a solve ends: at an optimum; where rounding leaves no way down; out of iterations."""
_DECREMENT = 1e-13
"""Predicted decrease by the cost at which a point is an optimum."""
_ROUNDING = 1e-8
"""Predicted decrease by the cost that may be left where no step gets lower any more."""
_NO_LESS = 1e-15
"""Decrease by the cost that is rounding alone: a gradient that is no more than that never gets smaller."""
_NEGLIGIBLE = 1e-3
"""Share of the second matrix in the Hessian that counts as none: where the cost does not say where the
optimum is."""
_SUFFICIENT, _SHORTEST = 1e-4, 1e-10


@njit
def factorise(matrix: Any, band: int, out: Any) -> bool:
    """Lower Cholesky factor of a banded matrix (n, n), of which the lower triangle counts.

    Returns:
        Whether it has one: whether it is positive definite.
    """
    size = matrix.shape[0]
    for i in range(size):
        begin = max(0, i - band)
        for j in range(begin, i + 1):
            total = matrix[i, j]
            for k in range(max(begin, j - band), j):
                total -= out[i, k] * out[j, k]
            if i == j:
                if not total > 0.0:
                    return False
                out[i, i] = math.sqrt(total)
            else:
                out[i, j] = total / out[j, j]
    return True


@njit
def solve_factorised(factor: Any, band: int, right: Any) -> None:
    """Solve L L^T x = right (n,) in place."""
    size = factor.shape[0]
    for i in range(size):
        total = right[i]
        for k in range(max(0, i - band), i):
            total -= factor[i, k] * right[k]
        right[i] = total / factor[i, i]
    for i in range(size - 1, -1, -1):
        total = right[i]
        for k in range(i + 1, min(size, i + band + 1)):
            total -= factor[k, i] * right[k]
        right[i] = total / factor[i, i]


@njit
def pin(matrix: Any, band: int, held: Any) -> None:
    """Take unknowns out of a system: their rows and columns become those of the unit matrix."""
    size = matrix.shape[0]
    for i in range(size):
        if held[i]:
            for j in range(max(0, i - band), i):
                matrix[i, j] = 0.0
            for j in range(i + 1, min(size, i + band + 1)):
                matrix[j, i] = 0.0
            matrix[i, i] = 1.0


@njit
def held_at(unknowns: Any, gradient: Any, lower: Any, upper: Any, out: Any) -> int:
    """Mark unknowns (n, 3) that a bound holds; returns how many."""
    count = 0
    for i in range(unknowns.shape[0]):
        for j in range(3):
            at = 3 * i + j
            out[at] = (unknowns[i, j] <= lower[j] and gradient[at] > 0.0) or (
                unknowns[i, j] >= upper[j] and gradient[at] < 0.0
            )
            count += out[at]
    return count


@njit
def minimise(
    graph: Any, coefficients: Any, basis: Any, first: Any, weights: Any, duration: float, arm: Any,
    cost_weights: Any, power: float, speed: float, low: int, high: int, lower: Any, upper: Any, metric: Any,
    most: int, costs: Any,
) -> tuple[int, int, float]:  # fmt: skip
    """Bring the coefficients (n, 3) of a reach to a minimum of the weighted cost, in place.

    Args:
        graph: Addresses of the compiled functions (3,).
        coefficients: Where it starts; rows ``low`` to ``high`` are changed.
        basis: Of the quadrature points, with ``first`` and ``weights`` (`SplineTable`).
        first: See there.
        weights: See there.
        duration: Of the reach [s].
        arm: Parameters of the arm model (11,).
        cost_weights: Of all seven costs (7,).
        power: Smoothing of the power.
        speed: Smoothing of the root.
        low: First row of the unknowns.
        high: Row behind the last.
        lower: Least joint angles (3,).
        upper: Greatest joint angles (3,).
        metric: Positive definite (u, u): what a Hessian gets that is not.
        most: Iterations at most.
        costs: Takes all seven costs at the end (7,).

    Returns:
        How it ended, iterations, and the decrease that a further step would bring, by the cost.
    """
    unknowns = coefficients[low:high]
    size = 3 * (high - low)
    gradient, step = np.empty(size), np.empty(size)
    hessian, factor, work = np.empty((size, size)), np.zeros((size, size)), np.empty((size, size))
    held = np.empty(size, np.bool_)
    before, found = np.empty_like(unknowns), np.empty(7)
    ridge, decrement = 0.0, math.inf
    for i in range(unknowns.shape[0]):
        for j in range(3):
            unknowns[i, j] = min(max(unknowns[i, j], lower[j]), upper[j])
    for iteration in range(most):
        derivatives(
            graph, coefficients, basis, first, weights, duration, arm, cost_weights, power, speed, low,
            costs, gradient, hessian,
        )  # fmt: skip
        cost = 0.0
        for k in range(7):
            cost += cost_weights[k] * costs[k]
        held_at(unknowns, gradient, lower, upper, held)
        share = 0.0
        for i in range(size):
            share += hessian[i, i] / metric[i, i] / size
        while True:
            for i in range(size):
                for j in range(max(0, i - BAND), i + 1):
                    work[i, j] = hessian[i, j] + ridge * metric[i, j]
            pin(work, BAND, held)
            if factorise(work, BAND, factor):
                break
            ridge = max(10.0 * ridge, 1e-4 * abs(share))
            if not ridge < 1e12 * (abs(share) + 1e-300):  # not a number: nothing helps
                return EXHAUSTED, iteration, decrement
        for i in range(size):
            step[i] = 0.0 if held[i] else -gradient[i]
        solve_factorised(factor, BAND, step)
        slope = 0.0
        for i in range(size):
            slope += gradient[i] * step[i]
        decrement = -0.5 * slope / max(abs(cost), 1e-300)
        if decrement <= _DECREMENT and ridge <= _NEGLIGIBLE * abs(share):
            # One more step costs nothing and squares what is left of the error.
            for i in range(unknowns.shape[0]):
                for j in range(3):
                    unknowns[i, j] = min(max(unknowns[i, j] + step[3 * i + j], lower[j]), upper[j])
            return CONVERGED, iteration + 1, decrement
        before[:] = unknowns
        length, accepted = 1.0, False
        while length > _SHORTEST:
            moved = 0.0
            for i in range(unknowns.shape[0]):
                for j in range(3):
                    at = before[i, j] + length * step[3 * i + j]
                    unknowns[i, j] = min(max(at, lower[j]), upper[j])
                    moved += gradient[3 * i + j] * (unknowns[i, j] - before[i, j])
            cost_integrals(
                graph[0], coefficients, basis, first, weights, duration, arm, power, speed, found
            )
            new = 0.0
            for k in range(7):
                new += cost_weights[k] * found[k]
            if new <= cost + _SUFFICIENT * min(moved, 0.0):
                accepted = True
                break
            length *= 0.5 if length > 0.1 else 0.25
        small = ridge <= _NEGLIGIBLE * abs(share)
        if not accepted:
            unknowns[:] = before
            if decrement <= _ROUNDING:
                return (CONVERGED if small else STALLED), iteration + 1, decrement
            if ridge > 1e6 * abs(share):
                return STALLED, iteration + 1, decrement
            ridge = max(10.0 * ridge, 1e-4 * abs(share))
            continue
        if decrement <= _ROUNDING and small and cost - new <= _NO_LESS * abs(cost):
            return CONVERGED, iteration + 1, decrement
        if length == 1.0:
            ridge = ridge * 0.1 if ridge > 1e-8 * abs(share) else 0.0
    return EXHAUSTED, most, decrement


@njit
def sensitivities(hessian: Any, held: Any, right: Any) -> bool:
    """Solve H x = right for each row of right (m, u), in place, with what bounds hold left where it is.

    Returns:
        Whether H is positive definite.
    """
    size = hessian.shape[0]
    factor = np.zeros((size, size))
    pin(hessian, BAND, held)
    if not factorise(hessian, BAND, factor):
        return False
    for row in range(right.shape[0]):
        for i in range(size):
            if held[i]:
                right[row, i] = 0.0
        solve_factorised(factor, BAND, right[row])
    return True
