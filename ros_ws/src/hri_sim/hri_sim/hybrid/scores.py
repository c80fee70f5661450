"""How far predictions of the rest of a reach are off, when its first part has been seen."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

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
    """

    warped_m: float
    end_m: float


def told(model: TaskModel, reach: SeenReach) -> Score:
    """With target and duration told, as the thesis has it."""
    seen = reach.phases <= SEEN
    known = model.promp.condition(reach.phases[seen], reach.values[seen])
    rest = reach.phases[~seen]
    return _score(known.trajectory_mean(rest)[:, 3:], reach.values[~seen, 3:])


def untold(models: tuple[TaskModel, ...], reach: SeenReach, config: PredictorConfig) -> Score:
    """With neither told: as the predictor does it online, from the models of all targets."""
    bank = HypothesisBank(bank_prior(models, config), config)
    end_s = SEEN * reach.duration_s
    for time_s in np.arange(0.0, end_s + 1e-9, _STEP_S):
        value = _at(reach, time_s / reach.duration_s)
        bank.observe(float(time_s), value, np.isfinite(value))
    count = max(int((reach.duration_s - end_s) / _STEP_S) + 1, 2)
    times = end_s + _STEP_S * np.arange(count)
    mean, _ = bank.moments(end_s, _STEP_S, count)
    truth = np.array([_at(reach, time / reach.duration_s) for time in times])
    return _score(mean[:, 1], truth[:, 3:])


def _at(reach: SeenReach, phase: float) -> Array:
    return np.array([np.interp(phase, reach.phases, column) for column in reach.values.T])


def _score(predicted: Array, truth: Array) -> Score:
    whole = np.isfinite(truth).all(axis=1)
    seen = truth[whole]
    warped = warped_distance(predicted, seen) / len(seen)
    return Score(warped, float(np.linalg.norm(predicted[whole][-1] - seen[-1])))
