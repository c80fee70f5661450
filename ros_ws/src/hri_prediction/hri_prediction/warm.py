"""Compile every kernel once, before anything is timed."""

from __future__ import annotations

import numpy as np

from hri_prediction.prediction.bank import HypothesisBank, bank_prior
from hri_prediction.prediction.config import PredictorConfig
from hri_prediction.prediction.library import DIMS, TaskModel
from hri_prediction.prediction.reaim import ReaimBank
from hri_prediction.promp.basis import PhaseBasis
from hri_prediction.promp.filtering import WeightFilter
from hri_prediction.promp.model import ProMP
from hri_prediction.tracks.crossing import rise_crossing
from hri_prediction.tracks.speed import regression_speed


def warm_kernels() -> None:
    """Call each compiled function once with arrays of the types used in earnest.

    Takes some ten seconds when nothing is cached, and milliseconds afterwards. Nodes call it before
    they take part in anything, so that no first sample waits for a compiler.
    """
    regression_speed(np.arange(5.0), np.zeros((5, 3)))
    rise_crossing(np.arange(9.0), np.zeros((9, 3)), 0.04, 4.0, 0.06)
    basis = PhaseBasis(3)
    size = DIMS * basis.count
    promp = ProMP(basis, np.zeros(size), np.eye(size), np.eye(DIMS))
    WeightFilter(promp).observe(0.1, np.zeros(DIMS))
    state = np.zeros(2 * DIMS)
    WeightFilter(promp).observe(0.1, state, np.eye(2 * DIMS), duration=1.0)
    config = PredictorConfig(durations=1, weights_per_dim=3)
    bank = HypothesisBank(
        bank_prior((TaskModel("warm", "any", promp, 1.0, 0.1, 1, 0.0),), config), config
    )
    bank.observe(0.1, np.zeros(DIMS), np.ones(DIMS, dtype=bool))
    bank.moments(0.1, 0.1, 2)
    reaim = ReaimBank(bank.prior.aims, 0.1, 0.01, 0.01)
    for time in (0.0, 0.1, 0.2):
        reaim.observe(time, np.zeros(DIMS), np.ones(DIMS, dtype=bool), 0.0)
    reaim.moments(reaim.shares()[1], 0.2, 0.1, 2)
