"""The thesis' selection: two Gaussian processes that learn Algorithm 1's labels (section 6.4.7)."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hri_planner.adaptation.features import FEATURES, Scaling, vector
from hri_planner.adaptation.grid import Cell, clipped
from hri_planner.ptomp.situation import Situation
from hri_prediction.errors import DataError
from hri_prediction.extras import check_scikit_learn

FloatArray = NDArray[np.float64]

_OUTPUTS = 2  # TS and NT


@dataclass(frozen=True)
class GprSelection:
    """Means of two Gaussian processes with squared exponential kernels, rounded down.

    Training needs scikit-learn; predicting is one product of a kernel row with stored weights.

    Attributes:
        scaling: Of the inputs.
        inputs: Those of training, scaled (n, 5).
        lengths: Length scales of each output (2, 5).
        amplitudes: Variances of the kernels (2,), as shares of the outputs' variance.
        weights: (K + noise)^-1 y of the scaled outputs (2, n).
        offset: Mean of the outputs in training (2,).
        spread: Their standard deviation (2,).
        less: Subtracted from the predictions (2,): zeros, or one standard deviation of their error, which
            made the thesis' success rate 98 instead of 89 %.
    """

    scaling: Scaling
    inputs: FloatArray
    lengths: FloatArray
    amplitudes: FloatArray
    weights: FloatArray
    offset: FloatArray
    spread: FloatArray
    less: FloatArray

    def predict(self, features: FloatArray) -> FloatArray:
        """TS and NT (2,) for inputs (5,), not rounded, nothing subtracted."""
        apart = (self.scaling(features) - self.inputs) / self.lengths[:, None]
        kernel = self.amplitudes[:, None] * np.exp(-0.5 * (apart**2).sum(axis=2))
        return self.offset + self.spread * (kernel * self.weights).sum(axis=1)

    def choose(self, situation: Situation) -> Cell:
        """The parameters for a situation; within the grid's range, but not on its nodes."""
        return clipped(self.predict(vector(situation)) - self.less)

    def to_arrays(self) -> dict[str, FloatArray]:
        """What is saved."""
        return {
            "center": self.scaling.center,
            "scale": self.scaling.scale,
            "inputs": self.inputs,
            "lengths": self.lengths,
            "amplitudes": self.amplitudes,
            "weights": self.weights,
            "offset": self.offset,
            "spread": self.spread,
            "less": self.less,
        }

    @classmethod
    def shapes(cls, arrays: dict[str, Any]) -> dict[str, tuple[int, ...]]:
        """Of the arrays of a file; the number of training inputs is as it is there."""
        size, count = len(FEATURES), len(np.atleast_1d(arrays.get("inputs", ())))
        return {
            "center": (size,),
            "scale": (size,),
            "inputs": (count, size),
            "lengths": (_OUTPUTS, size),
            "amplitudes": (_OUTPUTS,),
            "weights": (_OUTPUTS, count),
            "offset": (_OUTPUTS,),
            "spread": (_OUTPUTS,),
            "less": (_OUTPUTS,),
        }

    @classmethod
    def from_arrays(cls, arrays: dict[str, FloatArray]) -> GprSelection:
        """What was saved."""
        rest = {name: arrays[name] for name in arrays if name not in ("center", "scale")}
        return cls(Scaling(arrays["center"], arrays["scale"]), **rest)


def fit_gpr(features: FloatArray, labels: FloatArray) -> GprSelection:
    """Fit to labels of conditions.

    Args:
        features: Inputs (n, 5).
        labels: TS and NT (n, 2).

    Raises:
        DataError: on fewer than two conditions, or unusable data.
        ConfigError: without scikit-learn.
    """
    if len(features) < 2 or features.shape != (len(labels), len(FEATURES)):
        raise DataError(
            f"features of shape {features.shape}, {len(labels)} labels",
            expected=f"(n, {len(FEATURES)}), n labels, two at least",
        )
    if not (np.all(np.isfinite(features)) and np.all(np.isfinite(labels))):
        raise DataError("training data hold NaN or infinity")
    check_scikit_learn()
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel

    scaling = Scaling.of(features)
    inputs = scaling(features)
    offset, spread = labels.mean(axis=0), labels.std(axis=0)
    spread = np.where(spread > 0.0, spread, 1.0)
    lengths, amplitudes, weights = [], [], []
    for output in ((labels - offset) / spread).T:
        process = GaussianProcessRegressor(
            ConstantKernel(1.0, (1e-3, 1e2)) * RBF(np.ones(len(FEATURES)), (0.1, 1e2))
            + WhiteKernel(0.5, (1e-3, 1e1)),
            n_restarts_optimizer=2,
            random_state=0,
        )
        with warnings.catch_warnings():
            # A length scale at its bound means that an input says nothing; that is no fault.
            warnings.simplefilter("ignore")
            process.fit(inputs, output)
        smooth = process.kernel_.k1
        lengths.append(smooth.k2.length_scale)
        amplitudes.append(smooth.k1.constant_value)
        weights.append(process.alpha_)
    return GprSelection(
        scaling, inputs, np.array(lengths), np.array(amplitudes), np.array(weights), offset, spread,
        np.zeros(_OUTPUTS),
    )  # fmt: skip
