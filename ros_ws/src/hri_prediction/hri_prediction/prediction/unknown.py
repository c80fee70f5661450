"""The task "unknown": it stands for every movement that a library does not know."""

from __future__ import annotations

import math

import numpy as np

from hri_prediction.geometry.minimum_jerk import minimum_jerk
from hri_prediction.prediction.config import PredictorConfig
from hri_prediction.prediction.library import DIMS, TaskModel
from hri_prediction.promp.learning import smooth_covariance
from hri_prediction.promp.model import ProMP
from hri_prediction.promp.regression import fit_weights

UNKNOWN = "unknown"


def unknown_task(tasks: tuple[TaskModel, ...], config: PredictorConfig) -> TaskModel:
    """A wide reach along minimum-jerk lines from anywhere to anywhere, with smooth detours.

    It is as long, and lasts as long, as the movements of the library do. The elbow follows the wrist by
    half, give or take; the start is as wide as an arm.
    """
    basis = tasks[0].promp.basis
    share = np.array([max(task.demonstrations, 1) for task in tasks], dtype=float)
    share /= share.sum()
    logs = np.log([task.duration_mean_s for task in tasks])
    log_mean = float(share @ logs)
    log_variance = float(
        share @ ((logs - log_mean) ** 2 + np.array([task.duration_log_sd**2 for task in tasks]))
    )
    ends = np.stack([task.promp.trajectory_mean([0.0, 1.0])[:, 3:] for task in tasks])
    usual = math.sqrt(float(share @ np.mean((ends[:, 1] - ends[:, 0]) ** 2, axis=1)))
    phases = np.linspace(0.0, 1.0, 101)
    rise = fit_weights(basis, phases, minimum_jerk(phases)[:, None], 1e-9)
    level = np.ones(basis.count)
    start = np.kron(np.eye(DIMS), np.outer(level, level)) * 0.3**2
    coupling = np.array([[0.4, 0.5], [0.5, 1.0]])
    displacement = np.kron(coupling, np.eye(3)) * max(config.unknown_sd, usual) ** 2
    reach = np.kron(displacement, np.outer(rise, rise))
    detour = smooth_covariance(basis, DIMS, config.learning) * config.unknown_detour_sd**2
    covariance = start + reach + detour
    promp = ProMP(
        basis, np.zeros(DIMS * basis.count), covariance, np.eye(DIMS) * config.noise_sd**2
    )
    log_sd = math.sqrt(log_variance + config.unknown_duration_sd**2)
    return TaskModel(UNKNOWN, "any", promp, math.exp(log_mean), log_sd, 0, 0.0)
