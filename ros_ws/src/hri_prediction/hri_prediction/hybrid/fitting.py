"""Fitting a process of weights to what inverse optimal control found."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from typing import Any

import numpy as np

from hri_prediction.errors import DataError
from hri_prediction.extras import check_scikit_learn
from hri_prediction.hybrid.weight_process import WeightData, WeightProcess, of_whole
from hri_prediction.motor_control.costs import COSTS, JOINT_JERK, check_simplex

LEAST_REACHES = 10
_LENGTHS_RAD = (1.0, 10.0)
"""Designs have their nearest other posture some 0.5 rad away: what would change faster cannot be seen in
them, and is noise of the weights that is learnt by heart."""
_AMPLITUDES = (0.05, 20.0)
_RESTARTS = 3
_ROUNDING = 1e-9
"""An eigenvalue of a covariance of weights may be below 0 by so much."""


def fit_process(data: WeightData, seed: int = 0) -> WeightProcess:
    """Length scales and amplitudes of greatest likelihood, of each logarithm by itself.

    What observations scatter more than their variances say is added to these.

    Args:
        data: Of many reaches.
        seed: Of the starts of the search.

    Raises:
        ConfigError: without scikit-learn.
        DataError: on fewer than ten reaches.
    """
    if len(data) < LEAST_REACHES:
        raise DataError(f"weights of {len(data)} reaches", expected=f"{LEAST_REACHES} or more")
    check_scikit_learn()
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel

    means, amplitudes, lengths, variances = [], [], [], []
    for logs, variance in zip(data.logs.T, data.variance.T, strict=True):
        mean = float(np.average(logs, weights=1.0 / (variance + np.var(logs))))
        process = GaussianProcessRegressor(
            ConstantKernel(1.0, _AMPLITUDES) * RBF(np.ones(6), _LENGTHS_RAD)
            + WhiteKernel(0.1, (1e-4, 10.0)),
            alpha=variance,
            n_restarts_optimizer=_RESTARTS,
            random_state=seed,
        )
        with warnings.catch_warnings():
            # A length scale at its bound means that an angle says nothing; that is no fault.
            warnings.simplefilter("ignore")
            process.fit(data.inputs, logs - mean)
        smooth, white = process.kernel_.k1, process.kernel_.k2
        means.append(mean)
        amplitudes.append(smooth.k1.constant_value)
        lengths.append(smooth.k2.length_scale)
        variances.append(variance + white.noise_level)
    own = WeightData(data.names, data.inputs, data.logs, np.array(variances).T)
    return WeightProcess(own, np.array(means), np.array(amplitudes), np.array(lengths))


def check_costs(names: tuple[str, ...]) -> None:
    """Whether ratios of weights of these costs can be learnt.

    Raises:
        DataError: some are no costs, or joint jerk is not among them.
    """
    if len(set(names)) < max(len(names), 2) or not {JOINT_JERK} <= set(names) <= set(COSTS):
        raise DataError(
            f"costs {', '.join(names):.200}",
            expected=f"{JOINT_JERK} and others of {', '.join(COSTS)}",
        )


def says_something(row: Mapping[str, Any]) -> bool:
    """Whether a reach was explained, with the factors of the whole of it.

    Without these nobody knows what its weights mean elsewhere.
    """
    return not row["error"] and len(row["rest_factors"]) > 0


def data_of_reaches(names: tuple[str, ...], rows: list[dict[str, Any]]) -> WeightData:
    """Observations of the reaches that ``scripts/fit_ioc.py`` writes into its results.

    Raises:
        DataError: when a row lacks something, costs are others than these, or none was explained.
    """
    check_costs(names)
    try:
        done = [row for row in rows if says_something(row)]
        columns = {
            key: np.array([row[key] for row in done], dtype=float)
            for key in (
                "q_start_deg",
                "q_end_deg",
                "alpha",
                "covariance",
                "factors",
                "rest_factors",
            )
        }
        called = [str(row["name"]) for row in done]
    except (ArithmeticError, LookupError, TypeError, ValueError) as error:
        raise DataError(
            f"a reach of the results lacks or garbles {error}", expected="results of fit_ioc.py"
        ) from error
    if not done:
        raise DataError("no reach was explained", expected=f"{LEAST_REACHES} or more")
    whole = []
    for index, name in enumerate(called):
        row = {key: column[index] for key, column in columns.items()}
        _check(name, row, names)
        errors = row["covariance"].reshape(len(names), len(names))
        whole.append(of_whole(row["alpha"], errors, row["factors"], row["rest_factors"]))
    alpha, covariance = (np.array(part) for part in zip(*whole, strict=True))
    return WeightData.of(
        names,
        np.radians(columns["q_start_deg"]),
        np.radians(columns["q_end_deg"]),
        alpha,
        covariance,
    )


def _check(name: str, row: dict[str, np.ndarray], names: tuple[str, ...]) -> None:
    """Refuse a reach whose weights are none.

    Raises:
        DataError: naming the reach, and what it has.
    """
    try:
        check_simplex(row["alpha"], names)
    except DataError as error:
        raise DataError(f"reach {name!r:.80}: {error.problem}", expected=error.expected) from error
    for key in ("q_start_deg", "q_end_deg"):
        if row[key].shape != (3,) or not np.isfinite(row[key]).all():
            raise DataError(
                f"reach {name!r:.80}: {key} {np.array2string(row[key], precision=3):.120}",
                expected="3 finite angles [deg]",
            )
    size = len(names)
    for key in ("factors", "rest_factors"):
        values = row[key]
        if values.shape != (size,) or not (np.isfinite(values) & (values > 0.0)).all():
            raise DataError(
                f"reach {name!r:.80}: {key} {np.array2string(values, precision=3):.120}",
                expected=f"{size} finite numbers, all positive",
            )
    values = row["covariance"]
    usable = values.shape == (size**2,) and bool(np.isfinite(values).all())
    matrix = values.reshape(size, size) if usable else np.zeros((size, size))
    if usable:
        usable = np.allclose(matrix, matrix.T) and np.linalg.eigvalsh(matrix)[0] > -_ROUNDING
    if not usable:
        raise DataError(
            f"reach {name!r:.80}: covariance {np.array2string(values, precision=3):.120}",
            expected=f"{size**2} finite numbers, rows of a symmetric matrix that is no less than 0",
        )
