"""Inverse optimal control without derivatives, as the thesis did it: the independent check of `ioc`.

The weight of joint jerk is 1 and those of the other costs lie in [0, 1] (2.2.4.3); a trust-region method
that knows distances alone starts in the middle, three times with other initial radii, and the best of
what it finds counts. Where another weight comes out as 1, that one is 1 instead, and the search begins
anew. The thesis used CONDOR; COBYQA (Ragonneau and Zhang), in SciPy, is of the same family.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from hri_prediction.errors import ConfigError
from hri_prediction.motor_control.costs import CHAPTER_2, JOINT_JERK
from hri_prediction.motor_control.observed import ObservedReach
from hri_prediction.motor_control.ocp import ReachSolver
from hri_prediction.motor_control.scaling import MAXIMUM, scaling_of

Array = NDArray[np.float64]

RADII = (0.15, 0.3, 0.45)
"""Initial trust-region radii."""
EVALUATIONS = 100
"""Of each start, at most."""


@dataclass(frozen=True, eq=False)
class Found:
    """What the search found.

    Attributes:
        alpha: Weights on the simplex (n,).
        distance_m: Distance of its optimum to what was observed, as in `ioc.Explanation`.
        solves: How often the lower level was solved.
    """

    alpha: Array
    distance_m: float
    solves: int


def search(
    solver: ReachSolver,
    observed: ObservedReach,
    names: Sequence[str] = CHAPTER_2,
    *,
    scaling: str = MAXIMUM,
    radii: Sequence[float] = RADII,
    evaluations: int = EVALUATIONS,
) -> Found:
    """Find the weights of which a reach is the optimum, by distances alone.

    Args:
        solver: Of reaches of this arm.
        observed: What was seen.
        names: Costs that may have a part in it; joint jerk must be one of them.
        scaling: How costs are brought to one range.
        radii: Initial radii, one for each start.
        evaluations: Solves from each start at most.

    Raises:
        ConfigError: joint jerk is missing, or there is nothing to search for.
        NotConverged: the lower level was not solved.
    """
    names = tuple(names)
    if JOINT_JERK not in names or len(names) < 2:
        raise ConfigError(
            f"costs {', '.join(names)}", expected=f"{JOINT_JERK} and one more at least"
        )
    factors = scaling_of(solver, observed.problem, scaling)
    solves = len(factors.optima)

    def alpha_of(free: Array, fixed: int) -> Array:
        whole = np.insert(np.clip(free, 0.0, 1.0), fixed, 1.0)
        found: Array = whole / whole.sum()
        return found

    def distance(free: Array, fixed: int) -> float:
        nonlocal solves
        solves += 1
        motion = solver.solve(observed.problem, factors.weights(alpha_of(free, fixed), names))
        # In centimetres: the method stops by absolute values.
        return 100.0 * observed.distance(motion.hand(observed.phases, solver.arm))

    size = len(names) - 1
    best: tuple[float, Array] | None = None
    fixed, tried = names.index(JOINT_JERK), set[int]()
    while fixed not in tried:
        tried.add(fixed)
        for radius in radii:
            result = minimize(
                distance,
                np.full(size, 0.5),
                args=(fixed,),
                method="COBYQA",
                bounds=[(0.0, 1.0)] * size,
                options={
                    "initial_tr_radius": radius,
                    "final_tr_radius": 1e-6,
                    "maxfev": evaluations,
                    "scale": False,
                },
            )
            if best is None or result.fun < best[0]:
                best = float(result.fun), alpha_of(np.asarray(result.x), fixed)
        assert best is not None
        fixed = int(best[1].argmax())
    assert best is not None
    return Found(best[1], best[0] / 100.0, solves)
