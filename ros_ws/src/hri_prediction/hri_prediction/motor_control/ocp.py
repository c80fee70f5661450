"""Optimal control of a reach: the motion that is cheapest by a mix of costs (thesis eqs. 2.15 to 2.17).

The arm is fully actuated: whatever its joints do some torques bring about. So the motion itself is what
is sought, a clamped quintic spline for each joint, and torques and their rates follow from inverse
dynamics; there is no differential equation left to be fulfilled. Joint limits bound the coefficients that
are sought, and so, as a spline lies between its coefficients, the angles; those that the ends give are as
they are.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import solve_triangular

from hri_prediction.errors import ConfigError, DataError, HriError
from hri_prediction.motor_control.arm_model import ANATOMICAL, ArmModel, JointLimits
from hri_prediction.motor_control.assembly import cost_gradients, cost_integrals, derivatives
from hri_prediction.motor_control.compiled_graph import compiled_graph
from hri_prediction.motor_control.costs import COSTS, SMOOTHING, Smoothing, check_weights
from hri_prediction.motor_control.kinematics import hand, hand_jacobian
from hri_prediction.motor_control.newton import CONVERGED, held_at, minimise, sensitivities
from hri_prediction.motor_control.problem import ReachProblem
from hri_prediction.motor_control.spline import (
    SUPPORT,
    SplineTable,
    basis_at,
    interval_of,
    spline_table,
)

Array = NDArray[np.float64]

ITERATIONS = 200
_RIDGES = (1e-6, 1e-3)
"""Shares of the metric that a Hessian gets at an optimum that the cost hardly determines."""


class NotConverged(HriError):
    """No optimum was found.

    Attributes:
        reach: What was to be solved.
        weights: Of all seven costs (7,).
        solution: The last that was tried.
    """

    def __init__(
        self, problem: ReachProblem, weights: Array, solution: Motion, decrement: float
    ) -> None:
        self.reach, self.weights, self.solution = problem, weights, solution
        super().__init__(
            f"no optimum after {solution.iterations} iterations: a further step would lower the cost by "
            f"{decrement:.1e} of it",
            expected="less than 1e-8",
            hint="look at the attributes reach and weights",
        )
        self._decrement = decrement

    def __reduce__(self) -> tuple[Any, ...]:
        """As processes hand it to each other."""
        return NotConverged, (self.reach, self.weights, self.solution, self._decrement)


@dataclass(frozen=True, eq=False)
class Motion:
    """A motion of the three joints.

    Attributes:
        coefficients: Of the spline (K + 5, 3) [rad]; read-only.
        duration: [s].
        costs: All seven, each as it is in `COSTS`, unweighted (7,).
        iterations: What it took to find it.
    """

    coefficients: Array
    duration: float
    costs: Array
    iterations: int

    def __post_init__(self) -> None:
        self.coefficients.setflags(write=False)
        self.costs.setflags(write=False)

    def angles(self, phases: ArrayLike, order: int = 0) -> Array:
        """Joint angles, or a derivative by time up to the third, at phases (N,) in [0, 1]: (N, 3)."""
        at = np.asarray(phases, dtype=float)
        intervals = len(self.coefficients) - SUPPORT + 1
        rows = interval_of(at, intervals)[:, None] + np.arange(SUPPORT)
        values = basis_at(at, intervals)[:, order]
        found: Array = np.einsum("na,naj->nj", values, self.coefficients[rows])
        return found / self.duration**order

    def hand(self, phases: ArrayLike, arm: ArmModel) -> Array:
        """Path of the hand, from the shoulder, at phases (N,): (N, 3) [m]."""
        return hand(self.angles(phases), arm)


@dataclass(frozen=True, eq=False)
class ReachSolver:
    """Solves reaches of one arm.

    Attributes:
        arm: The model.
        limits: Of the joints.
        smoothing: Of absolute values and roots.
        intervals: Of the splines; more follow what costs of energy make of a reach (stiff begins and ends).
        points: Gauss points in each.

    Raises:
        ConfigError: fewer than two intervals or points.
        HriError: the model of the arm cannot be compiled.
    """

    arm: ArmModel
    limits: JointLimits = ANATOMICAL
    smoothing: Smoothing = SMOOTHING
    intervals: int = 16
    points: int = 4
    table: SplineTable = field(init=False, repr=False)
    _graph: NDArray[np.int64] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        if self.intervals < 2 or self.points < 2:
            raise ConfigError(
                f"{self.intervals} intervals with {self.points} points each",
                expected="two or more of both",
            )
        graph = compiled_graph(self.arm.convention)
        object.__setattr__(self, "table", spline_table(self.intervals, self.points))
        addresses = np.array([graph.values, graph.jacobian, graph.second], dtype=np.int64)
        object.__setattr__(self, "_graph", addresses)

    def __reduce__(self) -> tuple[Any, ...]:
        """As processes hand it to each other: addresses of code are those of one process."""
        return ReachSolver, (self.arm, self.limits, self.smoothing, self.intervals, self.points)

    def solve(
        self, problem: ReachProblem, weights: ArrayLike, start: Array | None = None
    ) -> Motion:
        """The cheapest motion.

        Args:
            problem: Ends and duration.
            weights: Of all seven costs (7,): S_i alpha_i (eq. 2.17); not negative, not all zero.
            start: Coefficients to begin with, such as those of a neighbouring optimum; none: the motion of
                least joint jerk.

        Raises:
            DataError: weights or ends cannot be right.
            NotConverged: no optimum was found.
        """
        chosen = check_weights(weights)
        problem.check_limits(self.limits)
        low, high = self.unknown_rows(problem)
        coefficients = self.smooth(problem)
        if start is not None:
            given = np.asarray(start, dtype=float)
            if given.shape != coefficients.shape or not np.isfinite(given).all():
                raise DataError(
                    f"a start of shape {given.shape}",
                    expected=f"finite coefficients of shape {coefficients.shape}",
                )
            coefficients[low:high] = given[low:high]
        costs = np.empty(len(COSTS))
        ended, iterations, decrement = minimise(
            self._graph, coefficients, self.table.values, self.table.first, self.table.weights,
            problem.duration, self.arm.parameters, chosen / self._norm(coefficients, chosen, problem),
            self.smoothing.power, self.smoothing.speed, low, high, np.array(self.limits.lower),
            np.array(self.limits.upper), self._metric(low, high), ITERATIONS, costs,
        )  # fmt: skip
        motion = Motion(coefficients, problem.duration, costs, iterations)
        if ended != CONVERGED:
            raise NotConverged(problem, chosen, motion, decrement)
        return motion

    def sensitivity(
        self, problem: ReachProblem, motion: Motion, weights: ArrayLike, chosen: NDArray[np.int64]
    ) -> Array:
        r"""How an optimum moves with its weights, :math:`dx / dw_i = -H^{-1} \nabla J_i`.

        Args:
            problem: What was solved.
            motion: Its optimum.
            weights: At which it is one (7,).
            chosen: Indices i of the costs (m,).

        Returns:
            (m, K + 5, 3); rows that the ends fix, and what a limit holds, do not move.

        Raises:
            NotConverged: when the motion is no minimum.
        """
        scaled = check_weights(weights)
        low, high = self.unknown_rows(problem)
        size = 3 * (high - low)
        gradients, gradient = np.empty((len(COSTS), size)), np.empty(size)
        hessian, costs = np.empty((size, size)), np.empty(len(COSTS))
        coefficients = np.array(motion.coefficients)
        table, arm = self.table, self.arm.parameters
        power, speed = self.smoothing.power, self.smoothing.speed
        derivatives(
            self._graph, coefficients, table.values, table.first, table.weights, problem.duration, arm,
            scaled, power, speed, low, costs, gradient, hessian,
        )  # fmt: skip
        cost_gradients(
            self._graph, coefficients, table.values, table.first, table.weights, problem.duration, arm,
            power, speed, low, gradients,
        )  # fmt: skip
        held = np.empty(size, dtype=np.bool_)
        held_at(
            coefficients[low:high],
            gradient,
            np.array(self.limits.lower),
            np.array(self.limits.upper),
            held,
        )
        share = float(np.mean(np.diag(hessian) / np.diag(self._metric(low, high))))
        for ridge in (0.0, *_RIDGES):
            moved = -gradients[chosen]
            damped = hessian + ridge * abs(share) * self._metric(low, high)
            if sensitivities(damped, held, moved):
                break
        else:
            raise NotConverged(problem, scaled, motion, math.inf)
        found = np.zeros((len(chosen), *coefficients.shape))
        found[:, low:high] = moved.reshape(len(chosen), -1, 3)
        return found

    def path_derivatives(
        self,
        problem: ReachProblem,
        motion: Motion,
        weights: ArrayLike,
        chosen: NDArray[np.int64],
        phases: Array,
    ) -> tuple[Array, Array]:
        """How an optimum and the path of its hand move with weights.

        Args:
            problem: What was solved.
            motion: Its optimum.
            weights: At which it is one (7,).
            chosen: Indices of the costs (m,).
            phases: Of the path (N,).

        Returns:
            Derivatives by the weights: of the coefficients (m, K + 5, 3), of the path (N, 3, m).
        """
        moved = self.sensitivity(problem, motion, weights, chosen)
        rows = interval_of(phases, self.intervals)[:, None] + np.arange(SUPPORT)
        turned = np.einsum("na,inaj->nji", basis_at(phases, self.intervals)[:, 0], moved[:, rows])
        path: Array = hand_jacobian(motion.angles(phases), self.arm) @ turned
        return moved, path

    def unknown_rows(self, problem: ReachProblem) -> tuple[int, int]:
        """First row of the coefficients that the ends leave free, and the one behind the last."""
        low = 2 if problem.a_start is None else 3
        return low, self.table.coefficients - (2 if problem.a_end is None else 3)

    def smooth(self, problem: ReachProblem) -> Array:
        """Coefficients (K + 5, 3) of the motion of least joint jerk between the ends, limits aside.

        It is a polynomial of fifth degree or less, which a quintic spline is exactly.
        """
        fixed = np.zeros((self.table.coefficients, 3))
        low, high = self.unknown_rows(problem)
        ends = [
            (
                self.table.start,
                (problem.q_start, problem.v_start, problem.a_start),
                slice(0, low),
                False,
            ),
            (
                self.table.end,
                (problem.q_end, problem.v_end, problem.a_end),
                slice(high, None),
                True,
            ),
        ]
        for table, given, rows, backwards in ends:
            wanted = np.array(
                [v * problem.duration**k for k, v in enumerate(given) if v is not None]
            )
            count = len(wanted)
            part = table[:count, :count] if not backwards else table[:count, ::-1][:, :count]
            found = solve_triangular(part, wanted, lower=True)
            fixed[rows] = found[::-1] if backwards else found
        gram = self.table.jerk_gram
        free = slice(low, high)
        outside = gram[free] @ fixed
        fixed[free] = np.linalg.solve(gram[free, free], -outside)
        return fixed

    def _metric(self, low: int, high: int) -> Array:
        inner = self.table.jerk_gram[low:high, low:high]
        return np.asarray(np.kron(inner, np.eye(3)), dtype=np.float64)

    def _costs(self, coefficients: Array, duration: float) -> Array:
        found = np.empty(len(COSTS))
        cost_integrals(
            int(self._graph[0]), np.array(coefficients), self.table.values, self.table.first,
            self.table.weights, duration, self.arm.parameters, self.smoothing.power, self.smoothing.speed,
            found,
        )  # fmt: skip
        return found

    def _norm(self, coefficients: Array, weights: Array, problem: ReachProblem) -> float:
        """What the weighted cost is divided by, so that it is about 1."""
        return max(float(weights @ self._costs(coefficients, problem.duration)), 1e-30)
