"""How people reach, before anything is explained: durations, speeds, end points (thesis 2.3.1)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats
from statsmodels.multivariate.pca import PCA

from hri_prediction.errors import DataError
from hri_prediction.motor_control.analyses.table import ReachTable

Array = NDArray[np.float64]
_RESAMPLES = 2000


@dataclass(frozen=True)
class Correlation:
    """Pearson's, of reaches of several people.

    Attributes:
        r: The coefficient of all reaches together.
        low, high: 95 % interval over people; NaN of fewer than three.
        n: Reaches.
        people: Whose they are.
    """

    r: float
    low: float
    high: float
    n: int
    people: int


def correlation(first: Array, second: Array) -> float:
    """Pearson's coefficient of two quantities (N,).

    Raises:
        DataError: fewer than four pairs.
    """
    if len(first) < 4:
        raise DataError(f"{len(first)} pairs", expected="four or more")
    return float(stats.pearsonr(first, second).statistic)


def among_people(
    first: Array, second: Array, person: NDArray[np.str_], rng: np.random.Generator
) -> Correlation:
    """Correlate two quantities of reaches, and resample people to see how sure that is.

    Reaches of one person are no independent witnesses: an interval that took them for that would be
    several times too narrow.

    Args:
        first: (N,).
        second: (N,).
        person: Whose each is (N,).
        rng: For resampling.

    Raises:
        DataError: fewer than four reaches.
    """
    who = np.unique(person, return_inverse=True)[1].reshape(-1)
    people = int(who.max(initial=-1)) + 1
    r = correlation(first, second)
    if people < 3:
        return Correlation(r, np.nan, np.nan, len(first), people)
    # Sums of each person, of which those of any set of people are made.
    x, y = first - first.mean(), second - second.mean()
    each = np.stack(
        [np.bincount(who, of, people) for of in (np.ones(len(x)), x, y, x * x, y * y, x * y)],
        axis=1,
    )
    drawn = rng.multinomial(people, np.full(people, 1.0 / people), _RESAMPLES)
    n, sx, sy, sxx, syy, sxy = (drawn @ each).T
    spread = (sxx - sx**2 / n) * (syy - sy**2 / n)
    found = (sxy - sx * sy / n)[spread > 0.0] / np.sqrt(spread[spread > 0.0])
    low, high = np.quantile(found, [0.025, 0.975])
    return Correlation(r, float(low), float(high), len(first), people)


@dataclass(frozen=True, eq=False)
class PostureSpace:
    """Principal components of postures at both ends.

    Attributes:
        ratios: Share of the variance of each (6,).
        components: Of the angles (6, 6), a row each.
        scores: Of the reaches (N, 6).
    """

    ratios: Array
    components: Array
    scores: Array


def posture_space(table: ReachTable) -> PostureSpace:
    """Principal components of the six joint angles at both ends [deg].

    Raises:
        DataError: fewer than seven reaches.
    """
    if len(table) < 7:
        raise DataError(f"{len(table)} reaches", expected="seven or more, for six angles")
    angles = np.degrees(np.concatenate([table.q_start, table.q_end], axis=1))
    model = PCA(angles, standardize=False, normalize=False, method="svd")
    return PostureSpace(model.eigenvals / model.eigenvals.sum(), model.loadings.T, model.scores)
