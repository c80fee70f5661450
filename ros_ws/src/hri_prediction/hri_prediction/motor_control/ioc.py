r"""Inverse optimal control: of which mix of costs a reach is the optimum (thesis eqs. 2.14, 2.19, 2.20).

The distance of an observed path to the optimum :math:`x^*(\alpha)` is minimised over the simplex of
weights. The optimum's derivative is known by implicit differentiation,

.. math:: dx^* / d\alpha_i = -H^{-1} S_i \nabla J_i,

so that a step of the upper level costs one solve of the lower level. Steps are those of Gauss and Newton:
first for squared distances at the same times, then for dynamic time warping with its path held, each
sample counted by the inverse of its distance (iteratively reweighted least squares), as warping sums up
distances, not squares.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import nnls

from hri_prediction.geometry.warping import warping_path
from hri_prediction.motor_control.costs import CHAPTER_2, check_simplex, indices_of
from hri_prediction.motor_control.observed import ObservedReach
from hri_prediction.motor_control.ocp import Motion, NotConverged, ReachSolver
from hri_prediction.motor_control.scaling import MAXIMUM, Scaling, scaling_of

Array = NDArray[np.float64]

EUCLIDEAN_STEPS, WARPED_STEPS = 10, 6
"""Steps of the upper level at most."""
_ENOUGH_M = 1e-9
"""A mean distance that no step needs to make less [m]."""
_FLOOR = 0.05
"""Share of the median distance below which a sample counts no more by being nearer."""
_NOTHING = 1e-30
"""A trace of the normal matrix with which weights move nothing [m^2]."""
_SAME = 1e-7
"""Steps of alpha that are none."""


@dataclass(frozen=True, eq=False)
class Explanation:
    """What explains a reach.

    Attributes:
        names: The costs.
        alpha: Their weights, on the simplex (n,).
        scaling: Factors without which alpha means nothing.
        motion: The optimum.
        distance_m: Its distance to what was observed, by dynamic time warping and sample.
        single_m: The same of the optimum of each cost alone (n,); infinite where that was not found, as
            optima of energy or geodesic alone are singular.
        single_motions: These optima; none where there is none.
        path: Of its hand at the phases of the samples (N, 3) [m].
        jacobian: Derivative of the path by alpha (N, 3, n) [m].
        solves: How often the lower level was solved, in all.
    """

    names: tuple[str, ...]
    alpha: Array
    scaling: Scaling
    motion: Motion
    distance_m: float
    single_m: Array
    single_motions: tuple[Motion | None, ...]
    path: Array
    jacobian: Array
    solves: int

    @property
    def factors(self) -> Array:
        """S of these costs (n,)."""
        found: Array = self.scaling.factors[indices_of(self.names)]
        return found


@dataclass(eq=False)
class _Point:
    """An optimum of the lower level with what the upper level asks of it."""

    alpha: Array
    motion: Motion
    path: Array
    distance_m: float


class _Search:
    """One reach's upper level; counts how often it solves the lower."""

    def __init__(
        self, solver: ReachSolver, observed: ObservedReach, names: Sequence[str], scaling: Scaling
    ) -> None:
        self.solver, self.observed, self.names, self.scaling = (
            solver,
            observed,
            tuple(names),
            scaling,
        )
        self.chosen = indices_of(names)
        self.solves = len(scaling.optima)

    def at(self, alpha: Array, start: Array | None = None) -> _Point:
        """Solve the lower level."""
        self.solves += 1
        motion = self.solver.solve(
            self.observed.problem, self.scaling.weights(alpha, self.names), start
        )
        return self.of(alpha, motion)

    def of(self, alpha: Array, motion: Motion) -> _Point:
        path = motion.hand(self.observed.phases, self.solver.arm)
        return _Point(alpha, motion, path, self.observed.distance(path))

    def tried(self, alpha: Array, start: Array | None = None) -> _Point | None:
        """Solve the lower level; nothing where it has no solution."""
        try:
            return self.at(alpha, start)
        except NotConverged:
            return None

    def vertices(self) -> list[_Point | None]:
        """The optimum of each cost alone."""
        found: list[_Point | None] = []
        for index, name in enumerate(self.names):
            alpha = np.eye(len(self.names))[index]
            known = self.scaling.optima.get(name)
            found.append(self.tried(alpha) if known is None else self.of(alpha, known))
        return found

    def derivatives(self, point: _Point) -> tuple[Array, Array]:
        """Of the coefficients (n, K + 5, 3) and of the path (N, 3, n) by alpha."""
        factors = self.scaling.factors[self.chosen]
        moved, path = self.solver.path_derivatives(
            self.observed.problem,
            point.motion,
            self.scaling.weights(point.alpha, self.names),
            self.chosen,
            self.observed.phases,
        )
        return moved * factors[:, None, None], path * factors

    def descend(self, point: _Point, steps: int, warped: bool) -> _Point:
        """Gauss-Newton steps from a point, as long as they get nearer."""
        damping = 0.0
        for _ in range(steps):
            if point.distance_m <= _ENOUGH_M:
                break
            moved, by_alpha = self.derivatives(point)
            if warped:
                path, seen, slopes, weights = self._paired(point, by_alpha)
            else:
                path, seen, slopes = point.path, self.observed.hand, by_alpha
                weights = np.ones(len(path))
            nearer = None
            for _ in range(4):
                alpha = simplex_step(point.alpha, slopes, seen - path, weights, damping)
                step = alpha - point.alpha
                if np.abs(step).max() < _SAME:
                    return point
                start = point.motion.coefficients + np.einsum("i,iaj->aj", step, moved)
                tried = self.tried(alpha, start)
                if tried is not None and self._cost(tried, warped) < self._cost(point, warped):
                    nearer = tried
                    break
                damping = max(10.0 * damping, 1e-3)
            if nearer is None:
                break
            damping *= 0.1
            gained = self._cost(point, warped) - self._cost(nearer, warped)
            small = gained < 1e-4 * self._cost(point, warped)
            point = nearer
            if small and np.abs(step).max() < 1e-3:
                break
        return point

    def _cost(self, point: _Point, warped: bool) -> float:
        if warped:
            return point.distance_m
        return float(np.square(point.path - self.observed.hand).sum())

    def _paired(self, point: _Point, by_alpha: Array) -> tuple[Array, Array, Array, Array]:
        """Samples next to each other by warping, with weights that make squares into distances."""
        _, pairs = warping_path(point.path, self.observed.hand)
        path, seen = point.path[pairs[:, 0]], self.observed.hand[pairs[:, 1]]
        apart = np.linalg.norm(path - seen, axis=1)
        floor = max(_FLOOR * float(np.median(apart)), 1e-12)
        return path, seen, by_alpha[pairs[:, 0]], 1.0 / np.maximum(apart, floor)


def simplex_step(
    alpha: Array, slopes: Array, wanted: Array, weights: Array, damping: float
) -> Array:
    r"""The weights on the simplex that a linear model says are best.

    .. math:: \min_a \sum_k w_k |P_k (a - \alpha) - r_k|^2 + \mu |a - \alpha|^2, \quad a \ge 0, \ \sum a = 1

    Args:
        alpha: Where the model holds (n,).
        slopes: P (N, 3, n).
        wanted: r (N, 3).
        weights: w (N,).
        damping: mu, by the trace of the normal matrix.

    Returns:
        a (n,).
    """
    roots = np.sqrt(weights)[:, None]
    matrix = (slopes * roots[..., None]).reshape(-1, len(alpha))
    right = (wanted * roots).ravel()
    normal = matrix.T @ matrix
    scale = float(np.trace(normal))
    if scale < _NOTHING or len(alpha) == 1:  # one cost alone has all of the weight
        return alpha
    # As least squares in n unknowns: a root of the normal matrix instead of all samples, and a heavy row
    # for the sum.
    values, vectors = np.linalg.eigh(normal + damping * scale * np.eye(len(alpha)))
    values = np.maximum(values, 1e-14 * scale)
    root = np.sqrt(values)[:, None] * vectors.T
    goal = root @ alpha + (vectors.T @ (matrix.T @ right)) / np.sqrt(values)
    heavy = 1e4 * np.sqrt(scale)
    try:
        found, _ = nnls(
            np.vstack([root, np.full((1, len(alpha)), heavy)]),
            np.append(goal, heavy),
            maxiter=30 * len(alpha),
        )
    except RuntimeError:  # it goes round in circles: where the samples say nothing
        return alpha
    result: Array = found / found.sum()
    return result


def explain(
    solver: ReachSolver,
    observed: ObservedReach,
    names: Sequence[str] = CHAPTER_2,
    *,
    scaling: str = MAXIMUM,
    start: ArrayLike | None = None,
) -> Explanation:
    """Find the weights of which a reach is the optimum.

    Args:
        solver: Of reaches of this arm.
        observed: What was seen.
        names: Costs that may have a part in it.
        scaling: How costs are brought to one range.
        start: Alpha to begin with, such as that of the person's last reach of this kind; none: all
            the same. Where that has no optimum, it begins with the best cost alone; where the best cost
            alone is nearer than what is found, it begins anew with that.

    Raises:
        ConfigError: names or scaling are none.
        DataError: the reach begins or ends where no joint can be.
        NotConverged: the lower level was not solved.
    """
    names = tuple(names)
    factors = scaling_of(solver, observed.problem, scaling)
    search = _Search(solver, observed, names, factors)
    vertices = search.vertices()
    centre = np.full(len(names), 1.0 / len(names)) if start is None else check_simplex(start, names)
    nearest = min((v for v in vertices if v is not None), key=lambda v: v.distance_m, default=None)
    # Weights that were expected may have no optimum.
    first = search.at(centre) if nearest is None else search.tried(centre) or nearest
    best = search.descend(first, EUCLIDEAN_STEPS, warped=False)
    best = search.descend(best, WARPED_STEPS, warped=True)
    if nearest is not None and nearest.distance_m < best.distance_m:
        best = search.descend(nearest, WARPED_STEPS, warped=True)
    _, jacobian = search.derivatives(best)
    return Explanation(
        names=names,
        alpha=best.alpha,
        scaling=factors,
        motion=best.motion,
        distance_m=best.distance_m,
        single_m=np.array([math.inf if v is None else v.distance_m for v in vertices]),
        single_motions=tuple(None if v is None else v.motion for v in vertices),
        path=best.path,
        jacobian=jacobian,
        solves=search.solves,
    )
