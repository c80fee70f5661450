r"""Which number of costs explains reaches best, for what they cost in parameters (thesis 2.2.6).

The thesis takes the distance by dynamic time warping of each reach for a residual, one a reach, and counts
the costs of a model: :math:`n \ln(RSS/n) + 2k`. Such a distance is no residual of a likelihood (it is no
less than 0, and warping takes out what goes along the path), so the same stands beside it with what a
likelihood has: all coordinates of all samples at their own times, as many of them as are independent, and
every weight of every reach.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from hri_prediction.errors import DataError
from hri_prediction.motor_control.ioc import Explanation
from hri_prediction.motor_control.observed import ObservedReach

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Model:
    """How well a choice of costs does for some reaches.

    Attributes:
        names: The costs.
        hand_cm: Mean distance by dynamic time warping.
        aic, bic: As the thesis counts.
        likelihood_aic, likelihood_bic: With a likelihood of paths.
        shapiro_p: Of normal distances (Shapiro and Wilk).
        distances_cm: Of each reach.
    """

    names: tuple[str, ...]
    hand_cm: float
    aic: float
    bic: float
    likelihood_aic: float
    likelihood_bic: float
    shapiro_p: float
    distances_cm: tuple[float, ...]


def model_of(
    reaches: Sequence[ObservedReach], found: Sequence[Explanation], correlated: Sequence[float]
) -> Model:
    """Judge a choice of costs.

    Args:
        reaches: What was seen, three at least.
        found: What explains each, all of the same costs.
        correlated: So many samples in a row of each share an error.

    Raises:
        DataError: fewer than three reaches.
    """
    if len(reaches) < 3:
        raise DataError(f"{len(reaches)} reaches", expected="three or more")
    names = found[0].names
    distances = np.array([100.0 * each.distance_m for each in found])
    count, size = len(distances), len(names)
    seen, squares = 0.0, 0.0
    for reach, one, shared in zip(reaches, found, correlated, strict=True):
        residual = one.path - reach.hand
        seen += residual.size / shared
        squares += float(np.square(residual).sum()) / shared
    weights = count * (size - 1)
    return Model(
        names=names,
        hand_cm=float(distances.mean()),
        aic=_criterion(float(np.square(distances).sum()), count, 2.0 * size),
        bic=_criterion(float(np.square(distances).sum()), count, math.log(count) * size),
        likelihood_aic=_criterion(squares, seen, 2.0 * weights),
        likelihood_bic=_criterion(squares, seen, math.log(seen) * weights),
        shapiro_p=float(stats.shapiro(distances).pvalue),
        distances_cm=tuple(distances.tolist()),
    )


def _criterion(squares: float, count: float, penalty: float) -> float:
    return count * math.log(max(squares, 1e-300) / count) + penalty
