"""Analyses of variance: of people who all do all tasks, and of independent tasks; by statsmodels."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy import stats
from statsmodels.formula.api import ols
from statsmodels.stats.anova import AnovaRM, anova_lm
from statsmodels.tools.sm_exceptions import SingularMatrixWarning

from hri_prediction.errors import DataError

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Effect:
    """Whether something depends on a factor, or on factors together.

    Attributes:
        source: The factor; ``a:b`` for what two do together.
        df1, df2: Degrees of freedom.
        f: The statistic.
        p: With sphericity, as the thesis has it.
        p_least: With the smallest degrees of freedom that any lack of sphericity leaves (lower bound of
            Geisser and Greenhouse); NaN where nothing is repeated.
    """

    source: str
    df1: int
    df2: int
    f: float
    p: float
    p_least: float


def repeated_measures(
    values: Array, person: NDArray[Any], factors: Mapping[str, NDArray[Any]]
) -> list[Effect]:
    """Analysis of variance with repeated measures.

    Args:
        values: (N,), one for each person and combination of factors.
        person: (N,).
        factors: One or two, by name (N,).

    Raises:
        DataError: somebody lacks a value, or has two.
    """
    frame = pd.DataFrame({"value": values, "person": person, **factors})
    names = list(factors)
    counts = frame.groupby(["person", *names])["value"].count()
    whole = frame["person"].nunique() * int(np.prod([frame[name].nunique() for name in names]))
    if len(counts) != whole or (counts != 1).any() or not np.isfinite(values).all():
        raise DataError(
            f"{int(counts.sum())} values of {frame['person'].nunique()} people",
            expected="one finite value of each person for each combination of "
            + " and ".join(names),
        )
    table = AnovaRM(frame, "value", "person", within=names).fit().anova_table
    found = []
    for source, row in table.iterrows():
        df1, df2, f = int(row["Num DF"]), int(row["Den DF"]), float(row["F Value"])
        least = float(stats.f.sf(f, 1.0, df2 / df1))
        found.append(Effect(str(source), df1, df2, f, float(row["Pr > F"]), least))
    return found


def independent(values: Array, factors: Mapping[str, NDArray[Any]]) -> list[Effect]:
    """Analysis of variance of independent values with any number of factors, main effects alone (type II).

    Args:
        values: (N,).
        factors: By name (N,); each value is a level.

    Raises:
        DataError: fewer values than levels, or factors that always change together.
    """
    frame = pd.DataFrame({"value": values, **factors})
    levels = sum(frame[name].nunique() - 1 for name in factors)
    if len(frame) < levels + 2 or not np.isfinite(values).all():
        raise DataError(f"{len(frame)} values", expected=f"{levels + 2} finite ones or more")
    with warnings.catch_warnings():
        warnings.simplefilter("error", SingularMatrixWarning)
        try:
            model = ols("value ~ " + " + ".join(f"C({name})" for name in factors), frame).fit()
        except SingularMatrixWarning as error:
            raise DataError(
                f"{', '.join(factors)} cannot be told apart",
                expected="factors whose levels come in different combinations",
            ) from error
    table = anova_lm(model, typ=2)
    left = int(table.loc["Residual", "df"])
    return [
        Effect(
            name,
            int(table.loc[f"C({name})", "df"]),
            left,
            float(table.loc[f"C({name})", "F"]),
            float(table.loc[f"C({name})", "PR(>F)"]),
            float("nan"),
        )
        for name in factors
    ]


def complete(
    person: NDArray[Any], factors: Sequence[NDArray[Any]], values: Array
) -> NDArray[np.bool_]:
    """The rows of people who have one finite value for each combination of factors (N,)."""
    cells = list(zip(*factors, strict=True))
    wanted = set(cells)
    good = np.isfinite(values)
    keep = np.zeros(len(person), dtype=bool)
    for name in dict.fromkeys(person.tolist()):
        rows = np.flatnonzero((person == name) & good)
        own = [cells[row] for row in rows]
        if len(own) == len(wanted) and set(own) == wanted:
            keep[rows] = True
    return keep
