"""What a solver makes its steps of: costs, gradients and Hessian of a motion."""

import numpy as np

from hri_prediction.motor_control.assembly import cost_gradients, cost_integrals, derivatives


def pieces(solver, task, coefficients, weights):
    """Costs, gradient and Hessian by the unknowns, and the gradients of all costs."""
    low, high = solver.unknown_rows(task)
    size = 3 * (high - low)
    costs, gradient, hessian = np.empty(7), np.empty(size), np.empty((size, size))
    every = np.empty((7, size))
    table = solver.table
    fixed = (table.values, table.first, table.weights, task.duration, solver.arm.parameters)
    smoothing = (solver.smoothing.power, solver.smoothing.speed)
    derivatives(
        solver._graph, coefficients, *fixed, weights, *smoothing, low, costs, gradient, hessian
    )
    cost_gradients(solver._graph, coefficients, *fixed, *smoothing, low, every)
    return costs, gradient, np.tril(hessian) + np.tril(hessian, -1).T, every


def costs_of(solver, task, coefficients):
    table, found = solver.table, np.empty(7)
    cost_integrals(
        int(solver._graph[0]), coefficients, table.values, table.first, table.weights, task.duration,
        solver.arm.parameters, solver.smoothing.power, solver.smoothing.speed, found,
    )  # fmt: skip
    return found
