"""Parameters by expected success: the chance of success as a function of situation and parameters.

Instead of regressing the one cell that a condition happened to ask for, which depends on luck more than
on the condition, all outcomes are regressed, good and bad: the chance of success and the control cost
over (inputs, TS, NT). The cell is chosen whose chance is high for sure, not by luck.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hri_planner.adaptation.bayesian import (
    LogisticModel,
    fit_logistic,
    fit_ridge,
    quadratic,
    sigmoid,
)
from hri_planner.adaptation.features import FEATURES, Scaling, vector
from hri_planner.adaptation.grid import CELLS, ROLLOUTS, TIMESTEPS, Cell
from hri_planner.ptomp.situation import Situation

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

TOLERANCE = 0.01
"""Among cells whose bound is within this of the best, the one of least control cost is chosen."""
DEVIATIONS = 1.0
"""The bound is so many standard deviations below the mean of the log-odds."""

_INPUTS = len(FEATURES) + 2
_FEATURES = 1 + _INPUTS + _INPUTS * (_INPUTS + 1) // 2


def scaled_parameters(cells: FloatArray) -> FloatArray:
    """TS and NT (n, 2) on a logarithmic scale from -1 to 1, since an iteration costs their product."""
    low = np.log([TIMESTEPS[0], ROLLOUTS[0]])
    high = np.log([TIMESTEPS[-1], ROLLOUTS[-1]])
    return np.asarray(2.0 * (np.log(cells) - low) / (high - low) - 1.0)


_GRID = scaled_parameters(np.array([(c.num_timesteps, c.num_rollouts) for c in CELLS], dtype=float))
_GRID.setflags(write=False)


@dataclass(frozen=True)
class SuccessSelection:
    """Chooses by a lower bound of the chance of success, then by cost.

    Attributes:
        scaling: Of the inputs.
        chance: Of success, over quadratic features of scaled inputs and parameters.
        cost: Weights (p,) of the logarithm of the control cost of successes, over the same.
    """

    scaling: Scaling
    chance: LogisticModel
    cost: FloatArray

    def choose(self, situation: Situation) -> Cell:
        """The cell for a situation."""
        features = self._features(situation)
        mean, deviation = self.chance.log_odds(features)
        bound = sigmoid(mean - DEVIATIONS * deviation)
        good = bound >= bound.max() - TOLERANCE
        return CELLS[int(np.argmin(np.where(good, features @ self.cost, np.inf)))]

    def success(self, situation: Situation) -> FloatArray:
        """Mean chance of success of each cell (132,), in the order of the flattened grid."""
        return sigmoid(self.chance.log_odds(self._features(situation))[0])

    def _features(self, situation: Situation) -> FloatArray:
        inputs = np.broadcast_to(self.scaling(vector(situation)), (len(CELLS), len(FEATURES)))
        return quadratic(np.concatenate((inputs, _GRID), axis=1))

    def to_arrays(self) -> dict[str, FloatArray]:
        """What is saved."""
        return {
            "center": self.scaling.center,
            "scale": self.scaling.scale,
            "chance_weights": self.chance.weights,
            "chance_factor": self.chance.factor,
            "cost_weights": self.cost,
        }

    @classmethod
    def shapes(cls, arrays: dict[str, Any]) -> dict[str, tuple[int, ...]]:
        """Of the arrays of a file."""
        size, count = len(FEATURES), _FEATURES
        return {
            "center": (size,),
            "scale": (size,),
            "chance_weights": (count,),
            "chance_factor": (count, count),
            "cost_weights": (count,),
        }

    @classmethod
    def from_arrays(cls, arrays: dict[str, FloatArray]) -> SuccessSelection:
        """What was saved."""
        return cls(
            Scaling(arrays["center"], arrays["scale"]),
            LogisticModel(arrays["chance_weights"], arrays["chance_factor"]),
            arrays["cost_weights"],
        )


def fit_success(
    features: FloatArray, cells: IntArray, success: FloatArray, cost: FloatArray
) -> SuccessSelection:
    """Fit to simulated motions.

    Args:
        features: Inputs at their start (n, 5).
        cells: TS and NT (n, 2).
        success: 0 or 1 (n,).
        cost: Control cost (n,), positive; that of failures is not used.

    Raises:
        DataError: on no or unusable data, or without any success.
    """
    scaling = Scaling.of(features)
    inputs = np.concatenate((scaling(features), scaled_parameters(cells.astype(float))), axis=1)
    terms = quadratic(inputs)
    good = success > 0.0
    return SuccessSelection(
        scaling, fit_logistic(terms, success), fit_ridge(terms[good], np.log(cost[good]))
    )
