"""How far predictions of the rest of a reach are off, when its first part has been seen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hri_prediction.evaluation.scores import coverage, densities
from hri_prediction.geometry.warping import warped_distance
from hri_prediction.hybrid.person import SeenReach
from hri_prediction.prediction.bank import HypothesisBank, bank_prior
from hri_prediction.prediction.config import PredictorConfig
from hri_prediction.prediction.library import TaskModel

Array = NDArray[np.float64]

SEEN = 0.3
"""Share of a reach that is seen before the rest is predicted (thesis section 3.4.2.2)."""
_STEP_S = 0.02


@dataclass(frozen=True)
class Score:
    """How a prediction of the wrist did.

    Attributes:
        warped_m: Distance to the rest of the path by dynamic time warping, by its samples.
        end_m: Distance of the end points.
        nll: Mean negative log density of its samples [nats, of metres].
        squared: Squared Mahalanobis distance of each (n,).
    """

    warped_m: float
    end_m: float
    nll: float
    squared: Array


@dataclass(frozen=True)
class Calibration:
    """How sure predictions were, and how sure they should have been.

    Attributes:
        nll: Mean negative log density of the samples [nats, of metres].
        inside50: Share of them within the central half of what was predicted.
        inside95: Likewise of 95 %.
    """

    nll: float
    inside50: float
    inside95: float


def calibration(scores: Sequence[Score]) -> Calibration:
    """Of the predictions of several reaches."""
    squared = np.concatenate([score.squared for score in scores])
    inside = [coverage(squared, level) for level in (0.50, 0.95)]
    return Calibration(
        float(np.mean([score.nll for score in scores])),
        *(float("nan") if share is None else share for share in inside),
    )


def told(model: TaskModel, reach: SeenReach) -> Score:
    """With target and duration told, as the thesis has it."""
    seen = reach.phases <= SEEN
    known = model.promp.condition(reach.phases[seen], reach.values[seen])
    rest = reach.phases[~seen]
    # Samples scatter about a path by the model's noise.
    covariance = known.trajectory_covariance(rest)[:, 3:, 3:] + known.noise[3:, 3:]
    return _score(known.trajectory_mean(rest)[:, 3:], covariance, reach.values[~seen, 3:])


def untold(models: tuple[TaskModel, ...], reach: SeenReach, config: PredictorConfig) -> Score:
    """With neither told: as the predictor does it online, from the models of all targets."""
    bank = HypothesisBank(bank_prior(models, config), config)
    end_s = SEEN * reach.duration_s
    for time_s in np.arange(0.0, end_s + 1e-9, _STEP_S):
        value = _at(reach, time_s / reach.duration_s)
        bank.observe(float(time_s), value, np.isfinite(value))
    count = max(int((reach.duration_s - end_s) / _STEP_S) + 1, 2)
    times = end_s + _STEP_S * np.arange(count)
    mean, covariance = bank.moments(end_s, _STEP_S, count)
    truth = np.array([_at(reach, time / reach.duration_s) for time in times])
    return _score(mean[:, 1], covariance[:, 1], truth[:, 3:])


def _at(reach: SeenReach, phase: float) -> Array:
    return np.array([np.interp(phase, reach.phases, column) for column in reach.values.T])


def _score(predicted: Array, covariance: Array, truth: Array) -> Score:
    whole = np.isfinite(truth).all(axis=1)
    seen, expected = truth[whole], predicted[whole]
    warped = warped_distance(predicted, seen) / len(seen)
    squared, nll = densities(seen - expected, covariance[whole])
    end_m = float(np.linalg.norm(expected[-1] - seen[-1]))
    return Score(warped, end_m, float(nll.mean()), squared)
