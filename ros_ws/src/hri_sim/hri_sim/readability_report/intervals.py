"""95 % intervals over people: each person is one draw, however many trials there were."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import stats

FloatArray = NDArray[np.float64]

FEWEST = 5
"""Of fewer people a bootstrap only says the range."""
_RESAMPLES = 4000
_SEED = 0


def estimate(values: ArrayLike) -> dict[str, Any]:
    """Mean and median over people, and the mean's interval by a bootstrap; all None of nobody.

    Where there are too few people, or all are alike, there is no interval: nothing says how wide it is.
    """
    found = np.asarray(values, dtype=float).ravel()
    if not len(found):
        return {"mean": None, "median": None, "ci95": None}
    return {
        "mean": float(found.mean()),
        "median": float(np.median(found)),
        "ci95": mean_interval(found),
    }


def mean_interval(values: FloatArray) -> list[float] | None:
    """Of a mean, bias-corrected and accelerated."""
    if len(values) < FEWEST or np.ptp(values) < 1e-12 * max(1.0, float(np.abs(values).max())):
        return None
    found = stats.bootstrap(
        (values,), np.mean, n_resamples=_RESAMPLES, method="BCa", rng=np.random.default_rng(_SEED)
    ).confidence_interval
    if not np.isfinite((found.low, found.high)).all():
        return None
    return [float(found.low), float(found.high)]


def share(hits: Sequence[bool]) -> dict[str, Any]:
    """Share of people and its interval (Wilson)."""
    if not hits:
        return {"share": None, "ci95": None}
    found = stats.binomtest(int(sum(hits)), len(hits)).proportion_ci(method="wilson")
    return {"share": sum(hits) / len(hits), "ci95": [float(found.low), float(found.high)]}


def is_below_zero(found: dict[str, Any]) -> bool | None:
    """Whether a mean is below zero (above: False) as far as its interval tells; none: it does not."""
    interval = found["ci95"]
    if interval is None or interval[0] <= 0.0 <= interval[1]:
        return None
    return bool(interval[1] < 0.0)


def text(found: dict[str, Any], digits: int = 2, *, scale: float = 1.0, sign: bool = False) -> str:
    """``1.23 (1.10 to 1.35)``; a dash if there is nothing."""
    value = found.get("mean", found.get("share"))
    if value is None:
        return "–"
    form = f"{'+' if sign else ''}.{digits}f"
    said = _form(scale * value, form)
    if found["ci95"] is None:
        return said
    low, high = (_form(scale * end, form) for end in found["ci95"])
    return f"{said} ({low} to {high})"


def _form(value: float, form: str) -> str:
    said = format(value, form)
    # Nothing rounds to a zero below or above zero.
    return said.lstrip("+-") if float(said) == 0.0 else said
