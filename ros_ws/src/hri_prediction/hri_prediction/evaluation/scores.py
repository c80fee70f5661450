"""From forecasts and what came instead to the figures of a table."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from hri_prediction.evaluation.replay import Forecast

Array = NDArray[np.float64]
HORIZONS_S = (0.1, 0.2, 0.5)
"""Times ahead at which errors are listed [s]."""
LOG_2PI = float(np.log(2.0 * np.pi))
FIELDS = ("endpoint", "horizon", "squared", "nll", "latency")
"""What is kept of each predictor and observed share, see :func:`score`; latencies in seconds."""


def score(
    at_end: Forecast, end: Array, ahead: Forecast, truth: Array, at_horizons: Forecast, later: Array
) -> dict[str, Array]:
    """Judge one forecast.

    Args:
        at_end: Forecast for the end of the reach, K = 1.
        end: (1, 3) where the wrist was then [m].
        ahead: Forecast over the rest of the reach (P points).
        truth: (P, 3) what came [m]; NaN where the reach is over or nothing is known.
        at_horizons: Forecast at `HORIZONS_S`.
        later: (H, 3) what came, likewise.

    Returns:
        ``endpoint`` () and ``horizon`` (H,): distances [m]; ``squared`` (P,): squared Mahalanobis
        distances; ``nll`` (P,): negative log densities [nats, of metres]. NaN where the truth is.
    """
    gap = truth - ahead.mean
    known = np.isfinite(gap).all(axis=1)
    squared, nll = np.full((2, known.size), np.nan)
    squared[known], nll[known] = densities(gap[known], ahead.covariance[known])
    return {
        "endpoint": np.linalg.norm(end[0] - at_end.mean[0]),
        "horizon": np.linalg.norm(later - at_horizons.mean, axis=1),
        "squared": squared,
        "nll": nll,
    }


def densities(gap: Array, covariance: Array) -> tuple[Array, Array]:
    """How likely points are under normal distributions.

    Args:
        gap: Of each point from its mean (n, 3) [m].
        covariance: Of each (n, 3, 3) [m²].

    Returns:
        Squared Mahalanobis distances (n,), negative log densities (n,) [nats, of metres].
    """
    factor = np.linalg.cholesky(covariance)
    # Triangular solves in one go; these are 3 x 3.
    white = np.linalg.solve(factor, gap[..., None])[..., 0]
    squared = np.sum(white**2, axis=1)
    log_det = 2.0 * np.log(np.diagonal(factor, axis1=1, axis2=2)).sum(axis=1)
    return squared, 0.5 * (squared + log_det + 3.0 * LOG_2PI)


def spread_of(values: Array) -> dict[str, float | None]:
    """Median, mean and 95th percentile of what is known; null without a value."""
    known = values[np.isfinite(values)]
    if not known.size:
        return {"median": None, "mean": None, "p95": None}
    return {
        "median": float(np.median(known)),
        "mean": float(np.mean(known)),
        "p95": float(np.percentile(known, 95.0)),
    }


def share_of(hits: NDArray[np.bool_], values: Array) -> float | None:
    """Share of hits among the values that are known; null without one."""
    known = np.isfinite(values)
    return float(np.mean(hits[known])) if known.any() else None


def _mean(values: Array) -> float | None:
    known = values[np.isfinite(values)]
    return float(np.mean(known)) if known.size else None


def coverage(squared: Array, level: float) -> float | None:
    """Share of points within the central region of a level; null without a point."""
    known = squared[np.isfinite(squared)]
    return float(np.mean(known <= chi2.ppf(level, 3))) if known.size else None


def summarise(cell: Mapping[str, Array]) -> dict[str, Any]:
    """The figures of one predictor over all reaches.

    Args:
        cell: The `FIELDS`, over the reaches (n, ...); latencies (k,).
    """
    latency = 1e6 * cell["latency"]
    return {
        "n": int(np.isfinite(cell["endpoint"]).sum()),
        "endpoint_error_m": spread_of(cell["endpoint"]),
        "error_at_horizon_m": {
            f"{horizon:g}": {
                **spread_of(cell["horizon"][:, i]),
                "n": int(np.isfinite(cell["horizon"][:, i]).sum()),
            }
            for i, horizon in enumerate(HORIZONS_S)
        },
        "nll": _mean(cell["nll"]),
        "coverage50": coverage(cell["squared"], 0.50),
        "coverage95": coverage(cell["squared"], 0.95),
        "points": int(np.isfinite(cell["squared"]).sum()),
        "latency_us": float(np.median(latency)) if latency.size else None,
        "latency_us_p95": float(np.percentile(latency, 95.0)) if latency.size else None,
    }
