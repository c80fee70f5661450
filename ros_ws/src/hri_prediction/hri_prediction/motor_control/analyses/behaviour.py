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


@dataclass(frozen=True)
class Correlation:
    """Pearson's.

    Attributes:
        r: The coefficient.
        p: Two-sided.
        low, high: 95 % interval.
        n: Pairs.
    """

    r: float
    p: float
    low: float
    high: float
    n: int


def correlation(first: Array, second: Array) -> Correlation:
    """Correlate two quantities (N,).

    Raises:
        DataError: fewer than four pairs.
    """
    if len(first) < 4:
        raise DataError(f"{len(first)} pairs", expected="four or more")
    found = stats.pearsonr(first, second)
    interval = found.confidence_interval(0.95)
    return Correlation(
        float(found.statistic), float(found.pvalue), float(interval.low), float(interval.high),
        len(first),
    )  # fmt: skip


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
