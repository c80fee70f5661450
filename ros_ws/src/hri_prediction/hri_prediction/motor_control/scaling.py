r"""Factors that bring the costs of a reach to one range (thesis eqs. 2.17 and 2.18).

Eq. 2.18 as printed, :math:`S_i = J_{i,max} / J_{JJ,max}`, would multiply the largest cost by the largest
factor. What balances them is its inverse, :math:`S_i = J_{JJ,max} / J_{i,max}`. The maxima are taken over
the optima of hand jerk, joint jerk and torque change of the same reach: the optima of energy and geodesic
alone are singular (their joint jerk grows without bound as the grid gets finer), and would set every
factor.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hri_prediction.errors import ConfigError
from hri_prediction.motor_control.costs import (
    COSTS,
    HAND_JERK,
    JOINT_JERK,
    TORQUE_CHANGE,
    check_simplex,
    indices_of,
)
from hri_prediction.motor_control.ocp import Motion, ReachSolver
from hri_prediction.motor_control.problem import ReachProblem

Array = NDArray[np.float64]

MAXIMUM, RANGE = "maximum", "range"
SCALINGS = (MAXIMUM, RANGE)
"""By the greatest value of each cost; by its greatest less its least, which conditions alpha better."""
_REFERENCES = (HAND_JERK, JOINT_JERK, TORQUE_CHANGE)


@dataclass(frozen=True, eq=False)
class Scaling:
    """Factors of one reach; alpha means nothing without them.

    Attributes:
        factors: S of all seven costs (7,); that of joint jerk is 1.
        kind: How they were made.
        optima: The motions of least hand jerk, joint jerk and torque change, by name of the cost.
    """

    factors: Array
    kind: str
    optima: dict[str, Motion]

    def weights(self, alpha: ArrayLike, names: Sequence[str]) -> Array:
        """Weights of all seven costs (7,) of alpha (n,) of some: S_i alpha_i.

        Raises:
            ConfigError: on names that are no costs.
            DataError: alpha is not on the simplex.
        """
        found = np.zeros(len(COSTS))
        chosen = indices_of(names)
        found[chosen] = self.factors[chosen] * check_simplex(alpha, names)
        return found


def rescaled(alpha: ArrayLike, factors: ArrayLike, wanted: ArrayLike) -> Array:
    """Weights that mean the same with other factors: S alpha is what says which motion is best.

    Args:
        alpha: Weights (n,), on the simplex.
        factors: S of these costs (n,) that they are true with.
        wanted: S of these costs (n,) that they are to be true with.
    """
    found = np.asarray(alpha, dtype=float) * np.asarray(factors) / np.asarray(wanted)
    return np.asarray(found / found.sum())


def scaling_of(solver: ReachSolver, reach: ReachProblem, kind: str = MAXIMUM) -> Scaling:
    """The factors of a reach; solves it three times.

    Raises:
        ConfigError: there is no such kind.
        NotConverged: a reach of one cost alone was not solved.
    """
    if kind not in SCALINGS:
        raise ConfigError(f"scaling {kind!r}", expected="one of " + ", ".join(SCALINGS))
    optima = {
        name: solver.solve(reach, np.eye(len(COSTS))[COSTS.index(name)]) for name in _REFERENCES
    }
    values = np.array([motion.costs for motion in optima.values()])
    spans = values.max(axis=0) - (values.min(axis=0) if kind == RANGE else 0.0)
    spans = np.maximum(spans, 1e-9 * values.max(axis=0))
    return Scaling(spans[COSTS.index(JOINT_JERK)] / spans, kind, optima)
