r"""A law of weights by posture, fitted to the paths of all reaches at once.

The weights of one noisy reach are hardly known; a law that all reaches of a person, or of many, have in
common is. Logarithms of ratios of weights are linear in the joint angles at both ends,

.. math:: \log \frac{\alpha_i}{\alpha_{JJ}} = \theta_i^\top \,[1, q_s, q_e],

so that weights stay on the simplex, and the squared distance of all paths to their optima is minimised over
:math:`\theta` by Gauss-Newton steps (Levenberg and Marquardt), with the derivatives that `ioc` has.

Repetitions of a reach share their weights, those of their mean postures, but each has ends and a duration
of its own: the mean of their paths is the optimum of nothing.

When a hand sets out and comes to rest is hidden in the noise, and weights hang on it: 20 ms too early or
too late are enough to lose them. Where it is not known, both times of each reach are found along with the
law (`whole.WholeReach`): they are fitted anew to each path that is tried, and steps of the law are taken
across what they could make up for (variable projection, Golub and Pereyra 1973). The duration and the scale
factors that belong to them are brought up to date between the steps.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hri_prediction.errors import ConfigError, DataError
from hri_prediction.motor_control.costs import CHAPTER_2, JOINT_JERK, indices_of
from hri_prediction.motor_control.observed import ObservedReach
from hri_prediction.motor_control.ocp import NotConverged, ReachSolver
from hri_prediction.motor_control.pooled import PooledReach, normal_equations
from hri_prediction.motor_control.problem import ReachProblem
from hri_prediction.motor_control.scaling import MAXIMUM
from hri_prediction.motor_control.span import Span

Array = NDArray[np.float64]

FEATURES = ("1", "q1_start", "q2_start", "q3_start", "q1_end", "q2_end", "q3_end")
_LEAST = 1e-12
"""Added to what damping scales, for directions that no reach says anything of [m^2]."""
_KNOWN, _PART = 1e-12, 1e-6
"""Share of the largest information below which there is none; part in a direction that counts."""
_UNKNOWN = 1e3**2
"""Variance of theta in a direction that reaches say nothing of: ratios are cut long before."""
_MOST_DAMPING, _PATIENCE = 1e8, 5
"""A step that gains nothing with that damping: there is none. So often is a step made shorter until reaches
without an optimum are left out."""
_LEAST_GAIN = 1e-7
"""Share of the squared distance that a step gains, below which the law is found."""
_LOG_LIMIT = 12.0
"""Ratios of weights beyond e^12 are the same to a reach."""


def features(q_start: ArrayLike, q_end: ArrayLike) -> Array:
    """[1, q_s, q_e] (..., 7), angles in radians."""
    start, end = np.asarray(q_start, dtype=float), np.asarray(q_end, dtype=float)
    one = np.ones((*start.shape[:-1], 1))
    return np.concatenate([one, start, end], axis=-1)


@dataclass(frozen=True, eq=False)
class WeightLaw:
    """Weights as a function of the posture at both ends.

    Attributes:
        names: The costs, joint jerk among them.
        theta: (n - 1, 7), of all costs but joint jerk, in the order of names.
    """

    names: tuple[str, ...]
    theta: Array

    def __post_init__(self) -> None:
        indices_of(self.names)
        if JOINT_JERK not in self.names or len(self.names) < 2:
            raise ConfigError(
                f"costs {', '.join(self.names)}", expected=f"{JOINT_JERK} and one more at least"
            )
        theta = np.array(self.theta, dtype=float)
        shape = (len(self.names) - 1, len(FEATURES))
        if theta.shape != shape or not np.isfinite(theta).all():
            raise DataError(
                f"theta of shape {theta.shape}", expected=f"finite numbers of shape {shape}"
            )
        theta.setflags(write=False)
        object.__setattr__(self, "theta", theta)

    def alpha(self, q_start: ArrayLike, q_end: ArrayLike) -> Array:
        """Weights (..., n) of reaches between postures (..., 3) [rad]."""
        logs = np.clip(features(q_start, q_end) @ self.theta.T, -_LOG_LIMIT, _LOG_LIMIT)
        whole = np.insert(logs, self.names.index(JOINT_JERK), 0.0, axis=-1)
        raised = np.exp(whole - whole.max(axis=-1, keepdims=True))
        found: Array = raised / raised.sum(axis=-1, keepdims=True)
        return found

    def slopes(self, q_start: Array, q_end: Array) -> Array:
        """Derivatives of the weights of one reach by theta (n, n - 1, 7)."""
        alpha = self.alpha(q_start, q_end)
        by_logs = np.diag(alpha) - np.outer(alpha, alpha)
        by_logs = np.delete(by_logs, self.names.index(JOINT_JERK), axis=1)
        cut = np.abs(features(q_start, q_end) @ self.theta.T) > _LOG_LIMIT
        return np.where(cut, 0.0, by_logs)[:, :, None] * features(q_start, q_end)


@dataclass(frozen=True, eq=False)
class FittedLaw:
    """A law and how well it does.

    Attributes:
        law: The law.
        rms_m: Root mean square distance of samples to the optima of the law [m].
        steps: Gauss-Newton steps that were taken.
        theta_sd: Standard deviation of theta from Fisher's information, (n - 1, 7); infinite where reaches
            say nothing of it.
        covariance: Of theta, row by row (7 (n - 1), 7 (n - 1)); directions that reaches say nothing of have
            a large variance.
        left_out: Numbers of reaches of which no optimum was found, so that the law is not fitted to them.
        converged: Whether no step gains anything more; else all steps were taken, and more may be better.
    """

    law: WeightLaw
    rms_m: float
    steps: int
    theta_sd: Array
    covariance: Array
    left_out: tuple[int, ...] = ()
    converged: bool = True

    def log_sd(self, q_start: ArrayLike, q_end: ArrayLike) -> Array:
        """Standard deviations of the logarithms of ratios (..., n - 1) between postures (..., 3) [rad]."""
        at = features(q_start, q_end)
        outputs = len(self.law.theta)
        blocks = self.covariance.reshape(outputs, len(FEATURES), outputs, len(FEATURES))
        own = np.einsum("ijik->ijk", blocks)
        variance = np.einsum("...j,ijk,...k->...i", at, own, at)
        found: Array = np.sqrt(np.maximum(variance, 0.0))  # rounding, beside what is not known
        return found


def fit_law(
    solver_of: Callable[[ObservedReach], ReachSolver],
    reaches: Sequence[ObservedReach],
    names: Sequence[str] = CHAPTER_2,
    *,
    scaling: str = MAXIMUM,
    steps: int = 15,
    correlated: float = 1.0,
    alike: Sequence[Hashable] = (),
    spans: Sequence[Span] = (),
    progress: Callable[[int, int], None] = lambda done, of: None,
) -> FittedLaw:
    """Fit a law to reaches of one person or of many.

    Args:
        solver_of: The solver of the arm that did a reach.
        reaches: At least one; with spans, each has some rest before and after.
        names: Costs, joint jerk among them.
        scaling: How costs are brought to one range, in each reach.
        steps: At most; 1 or more.
        correlated: So many samples in a row share an error; they count for one in theta_sd.
        alike: What reach each one is; repetitions have the same. Empty: each one is a reach of its own.
        spans: At about which phases each one sets out and comes to rest; they are found along with the law.
            Empty: reaches begin at phase 0 and end at phase 1.
        progress: Called with steps done and their number.

    Raises:
        ConfigError: on names that are no costs, without joint jerk, or without a step.
        DataError: without reaches, or when not all or none are said to be alike, or have a span.
        NotConverged: the lower level was not solved for any of them.
    """
    if steps < 1:
        raise ConfigError(f"{steps} steps to fit a law", expected="one or more")
    if not reaches:
        raise DataError("no reaches to fit a law to", expected="one or more")
    if alike and len(alike) != len(reaches):
        raise DataError(f"{len(alike)} names of {len(reaches)} reaches", expected="one for each")
    if spans and len(spans) != len(reaches):
        raise DataError(f"{len(spans)} spans of {len(reaches)} reaches", expected="one for each")
    names = tuple(names)
    law = WeightLaw(names, np.zeros((len(names) - 1, len(FEATURES))))
    postures = mean_postures(reaches, alike or range(len(reaches)))
    free: Sequence[Span | None] = spans or [None] * len(reaches)
    found: dict[int, PooledReach] = {}
    lost: NotConverged | None = None
    for number, (reach, ends, span) in enumerate(zip(reaches, postures, free, strict=True)):
        try:
            found[number] = PooledReach(solver_of(reach), reach, names, scaling, ends, span, law)
        except NotConverged as error:
            lost = error
    if lost is not None and not found:
        raise lost
    fit = _Fit(law, found)
    converged = False
    for done in range(1, steps + 1):
        progress(done - 1, steps)
        converged = fit.step()
        if converged:
            break
    law, pooled = fit.law, list(fit.reaches.values())
    squares = sum(fit.squares.values())
    samples = sum(each.observed.hand.size for each in pooled)
    size = law.theta.size
    progress(steps, steps)
    for each in pooled:
        each.solve(law, fit_span=False)
    information, _ = normal_equations(pooled, law)
    fitted = size + (2 * len(pooled) if spans else 0)
    noise = squares / max(samples - correlated * fitted, 1.0)
    covariance, unknown = _covariance(information, noise * correlated)
    sd = np.where(unknown, math.inf, np.sqrt(np.diag(covariance)))
    return FittedLaw(
        law,
        float(np.sqrt(3.0 * squares / samples)),
        done,
        sd.reshape(law.theta.shape),
        covariance,
        tuple(number for number in range(len(reaches)) if number not in fit.reaches),
        converged,
    )


class _Fit:
    """A law on its way: steps of Levenberg and Marquardt.

    Args:
        law: To begin with.
        reaches: By their numbers; the optimum of each is that of the law.
    """

    def __init__(self, law: WeightLaw, reaches: Mapping[int, PooledReach]) -> None:
        self.law, self.reaches = law, dict(reaches)
        self.squares = {number: each.accept(law) for number, each in reaches.items()}
        self._damping = 1e-3

    def step(self) -> bool:
        """Take a step; whether there is nothing more to be gained.

        A reach of which no optimum is found however short the step is left out, so that it does not hold
        all others where they are.

        Raises:
            NotConverged: when none is left.
        """
        information, right = normal_equations(list(self.reaches.values()), self.law)
        before = sum(self.squares.values())
        shortened = 0
        while self._damping < _MOST_DAMPING:
            damped = information + self._damping * np.diag(np.diag(information) + _LEAST)
            theta = self.law.theta + np.linalg.solve(damped, right).reshape(self.law.theta.shape)
            tried = WeightLaw(self.law.names, theta)
            new = {number: each.solve(tried) for number, each in self.reaches.items()}
            if sum(new.values()) < before:
                self.law = tried
                self.squares = {n: each.accept(tried) for n, each in self.reaches.items()}
                self._damping = max(self._damping * 0.1, 1e-9)
                return before - sum(new.values()) < _LEAST_GAIN * before
            self._damping *= 10.0
            shortened += 1
            lost = [number for number, squares in new.items() if not math.isfinite(squares)]
            if lost and shortened >= _PATIENCE:
                return self._leave_out(lost)
        return True

    def _leave_out(self, lost: Sequence[int]) -> bool:
        if len(lost) == len(self.reaches):
            raise self.reaches[lost[0]].lost or AssertionError
        for number in lost:
            del self.reaches[number]
        self.squares = {n: each.solve(self.law, fit_span=False) for n, each in self.reaches.items()}
        self._damping = 1e-3
        return False


def _covariance(information: Array, noise: float) -> tuple[Array, NDArray[np.bool_]]:
    """Noise by information (p, p), and what a direction without information has a part in (p,)."""
    values, directions = np.linalg.eigh(information)
    known = values > _KNOWN * max(float(values[-1]), 0.0)
    spread = np.full(len(values), _UNKNOWN)
    spread[known] = np.minimum(noise / values[known], _UNKNOWN)
    unknown = (np.square(directions[:, ~known]) > _PART).any(axis=1)
    return (directions * spread) @ directions.T, unknown


def mean_postures(
    reaches: Sequence[ObservedReach], alike: Sequence[Hashable]
) -> list[tuple[Array, Array]]:
    """Joint angles (3,) and (3,) that repetitions of a reach begin and end in on the average, for each.

    Args:
        reaches: All of them.
        alike: What reach each one is.
    """
    groups: dict[Hashable, list[ReachProblem]] = defaultdict(list)
    for reach, which in zip(reaches, alike, strict=True):
        groups[which].append(reach.problem)
    means = {
        which: (
            np.mean([each.q_start for each in own], axis=0),
            np.mean([each.q_end for each in own], axis=0),
        )
        for which, own in groups.items()
    }
    return [means[which] for which in alike]


def explained(truth: ArrayLike, found: ArrayLike) -> float:
    """Share of the variance of true weights (N, n) that found ones explain, pooled over all costs.

    Raises:
        DataError: when the true ones do not vary.
    """
    true, made = np.asarray(truth, dtype=float), np.asarray(found, dtype=float)
    spread = float(np.square(true - true.mean(axis=0)).sum())
    if not spread > 0.0:
        raise DataError(
            "weights that are all the same have no variance", expected="several reaches"
        )
    return 1.0 - float(np.square(true - made).sum()) / spread
