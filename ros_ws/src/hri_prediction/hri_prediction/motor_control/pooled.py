"""One of many reaches that a law of weights is fitted to: its optimum, and how it follows the law."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hri_prediction.motor_control.costs import JOINT_JERK, indices_of
from hri_prediction.motor_control.observed import ObservedReach
from hri_prediction.motor_control.ocp import NotConverged, ReachSolver
from hri_prediction.motor_control.problem import ReachProblem
from hri_prediction.motor_control.scaling import Scaling, scaling_of
from hri_prediction.motor_control.span import Span, fitted_span, span_derivatives, within

Array = NDArray[np.float64]


class Law(Protocol):
    """What is asked of a law."""

    @property
    def theta(self) -> Array:
        """Its parameters (n - 1, 7)."""

    def alpha(self, q_start: ArrayLike, q_end: ArrayLike) -> Array:
        """Weights (..., n) of reaches between postures (..., 3) [rad]."""

    def slopes(self, q_start: Array, q_end: Array) -> Array:
        """Derivatives of the weights of one reach by theta (n, n - 1, 7)."""


def normal_equations(pooled: Sequence[PooledReach], law: Law) -> tuple[Array, Array]:
    """Normal matrix and right side of a Gauss-Newton step, of all reaches."""
    size = law.theta.size
    information, right = np.zeros((size, size)), np.zeros(size)
    for each in pooled:
        matrix, residual = each.linear(law)
        information += matrix.T @ matrix
        right += matrix.T @ residual
    return information, right


class PooledReach:
    """One of the reaches.

    Attributes:
        lost: Why there is no optimum of the law that was tried last; none: there is one.
    """

    lost: NotConverged | None

    def __init__(
        self,
        solver: ReachSolver,
        observed: ObservedReach,
        names: tuple[str, ...],
        scaling: str,
        ends: tuple[Array, Array],
        span: Span | None,
        law: Law,
    ) -> None:
        """Pose the problem, and solve it for a law to begin with.

        Raises:
            NotConverged: there is no optimum of it.
        """
        self.solver, self.observed, self.names, self.ends = solver, observed, names, ends
        self.chosen = indices_of(names)
        self._scaling_name = scaling
        self._span = self._tried_span = span
        self.problem, self.scaling = self._posed(span)
        self._motion = self._tried = self.scaling.optima[JOINT_JERK]
        self._squares = math.inf
        self.solve(law)
        if self.lost is not None:
            raise self.lost

    def _posed(self, span: Span | None) -> tuple[ReachProblem, Scaling]:
        """The problem, and the scale factors, that belong to a span."""
        problem = self.observed.problem
        if span is not None:
            problem = replace(problem, duration=(span[1] - span[0]) * problem.duration)
        return problem, scaling_of(self.solver, problem, self._scaling_name)

    def solve(self, law: Law, *, fit_span: bool = True) -> float:
        """Squared distance of the path to the optimum of a law; `accept` keeps that."""
        weights = self.scaling.weights(law.alpha(*self.ends), self.names)
        self._squares, self.lost = math.inf, None
        try:
            self._tried = self.solver.solve(self.problem, weights, self._motion.coefficients)
        except NotConverged as error:
            self.lost = error  # of a step that went too far, say
            return math.inf
        self._tried_span = self._span
        if self._span is not None and fit_span:
            self._tried_span = fitted_span(self._tried, self.observed, self.solver.arm, self._span)
        path = self._tried.hand(self._phases(self._tried_span), self.solver.arm)
        self._squares = float(np.square(path - self.observed.hand).sum())
        return self._squares

    def accept(self, law: Law) -> float:
        """The last motion is where the next steps begin; its squared distance, with its own duration."""
        self._motion = self._tried
        if self._tried_span == self._span:
            return self._squares
        before = self._span, self.problem, self.scaling
        self._span = self._tried_span
        with contextlib.suppress(NotConverged):
            self.problem, self.scaling = self._posed(self._span)
            if math.isfinite(self.solve(law, fit_span=False)):
                self._motion = self._tried
                return self._squares
        # Nothing is found of that duration: the one before will do.
        self._span, self.problem, self.scaling = before
        return self.solve(law, fit_span=False)

    def _phases(self, span: Span | None) -> Array:
        return self.observed.phases if span is None else within(self.observed.phases, span)

    def linear(self, law: Law) -> tuple[Array, Array]:
        """Derivative of the path by theta (3 N, p), and what is left to the path seen (3 N,).

        Where the span is fitted, both are square to what another span would make of the path.
        """
        weights = self.scaling.weights(law.alpha(*self.ends), self.names)
        phases = self._phases(self._span)
        _, by_weights = self.solver.path_derivatives(
            self.problem, self._tried, weights, self.chosen, phases
        )
        by_alpha = by_weights * self.scaling.factors[self.chosen]
        by_theta = np.tensordot(by_alpha, law.slopes(*self.ends), axes=1)
        left = self.observed.hand - self._tried.hand(phases, self.solver.arm)
        matrix, residual = by_theta.reshape(left.size, -1), left.ravel()
        if self._span is not None:
            by_span = span_derivatives(self._tried, self.observed, self.solver.arm, self._span)
            basis, _ = np.linalg.qr(by_span)
            matrix = matrix - basis @ (basis.T @ matrix)
            residual = residual - basis @ (basis.T @ residual)
        return matrix, residual
