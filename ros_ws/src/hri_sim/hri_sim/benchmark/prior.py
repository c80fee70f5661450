"""What is known of a reach before it begins: the ProMP prior, for planners that plan once."""

from __future__ import annotations

import numpy as np

from hri_planner.ptomp.forecast import HumanForecast, forecast_of
from hri_prediction.arm.geometry import ArmRadii, FloatArray
from hri_prediction.prediction import PredictorConfig, TaskLibrary
from hri_prediction.prediction.library import TaskModel
from hri_prediction.prediction.output import whole_arm
from hri_prediction.promp.model import ProMP
from hri_prediction.tracks.track import ArmSample
from hri_sim.scenario.conditions import DELAY_S

ONSETS = 7
DURATIONS = 5
"""Nodes of the quadrature over the time of onset (evenly drawn) and the duration (log-normal)."""
_STEP_S = 0.02
_HORIZON_S = 3.0


class PriorObserver:
    """Every reach that the library knows, from the pose that is seen, at the onset to be expected.

    With several tasks there are as many arms in the forecast, since any of them may come. Neither the
    time of onset (drawn as in the conditions) nor the duration (log-normal, of the task) is known: the
    forecast has mean and covariance of the mixture over both. What the library calls a reach begins and
    ends where the wrist is fast enough to be seen to move: that is reckoned with.

    Args:
        library: Of the person's tasks.
    """

    def __init__(self, library: TaskLibrary) -> None:
        self._library = library
        self._points: FloatArray = np.full((4, 3), np.nan)
        self._config = PredictorConfig()

    def see(self, sample: ArmSample) -> None:
        """Take a tracked sample."""
        self._points[sample.valid] = sample.keypoints[sample.valid]

    def forecast(self, now_s: float) -> HumanForecast | None:
        """What is expected of a reach that has not begun; none while no arm is known."""
        if np.isnan(self._points).any():
            return None
        known = [self._of_task(task, now_s) for task in self._library.tasks]
        mean = np.stack([np.asarray(forecast.mean) for forecast in known])
        sigma = np.stack([np.asarray(forecast.sigma) for forecast in known])
        return HumanForecast(now_s, _STEP_S, mean, sigma, ArmRadii().array)

    def _of_task(self, task: TaskModel, now_s: float) -> HumanForecast:
        shoulder, seen = self._points[0], (self._points[1:3] - self._points[0]).reshape(1, 6)
        promp = task.promp.condition([0.0], seen)
        times: FloatArray = np.asarray(
            _STEP_S * np.arange(round(_HORIZON_S / _STEP_S) + 1), dtype=float
        )
        mean, covariance = unknown_timing(promp, task, now_s + times, self._config.onset_speed)
        arm = whole_arm(
            shoulder,
            shoulder + mean,
            covariance,
            self._points[3] - self._points[2],
            self._points[2] - self._points[1],
            self._config.shoulder_sd,
            self._config.hand_sd,
        )
        return forecast_of(now_s, times, *arm, ArmRadii().array)


def slow_s(length_m: float, seen_s: FloatArray, speed: float) -> FloatArray:
    """How long minimum-jerk motions are slower than a speed, at their beginning and again at their end.

    Args:
        length_m: Of the motions.
        seen_s: How long each of them is faster (n,) [s].
        speed: The speed [m/s].

    Returns:
        Duration of each of the two slow parts (n,) [s].
    """
    share: FloatArray = np.zeros(len(seen_s))
    for _ in range(20):
        whole_s = seen_s / (1.0 - 2.0 * share)
        # Speed at share s of the time: 30 length / duration s^2 (1 - s)^2. Slow motions: at most a fifth.
        product = np.sqrt(speed * whole_s / (30.0 * max(length_m, 1e-6)))
        share = 0.5 * (1.0 - np.sqrt(1.0 - 4.0 * np.minimum(product, 0.16)))
    return np.asarray(share * seen_s / (1.0 - 2.0 * share), dtype=float)


def unknown_timing(
    promp: ProMP, task: TaskModel, times_s: FloatArray, onset_speed: float
) -> tuple[FloatArray, FloatArray]:
    """Moments of a reach whose onset and duration are known as distributions only.

    Law of total variance over a product of Gauss-Legendre nodes (onset, even) and Gauss-Hermite nodes
    (logarithm of the duration, normal). Before its onset the arm rests at the beginning of the path,
    afterwards at its end.

    Args:
        promp: Path of elbow and wrist over the phase.
        task: Says how long a reach takes.
        times_s: From the robot's start (K,) [s].
        onset_speed: Of the wrist, where reaches of the library begin and end; 0: at rest [m/s].

    Returns:
        Mean (K, 2, 3) [m] and covariance of each point (K, 2, 3, 3) [m^2].
    """
    even, even_weights = np.polynomial.legendre.leggauss(ONSETS)
    normal, normal_weights = np.polynomial.hermite_e.hermegauss(DURATIONS)
    onsets = DELAY_S[0] + 0.5 * (even + 1.0) * (DELAY_S[1] - DELAY_S[0])
    durations = task.duration_mean_s * np.exp(task.duration_log_sd * normal)
    weights = np.outer(even_weights, normal_weights).ravel()
    weights /= weights.sum()
    first, last = promp.trajectory_mean([0.0, 1.0])[:, 3:]
    hidden = slow_s(float(np.linalg.norm(last - first)), durations, onset_speed)
    passed = times_s - onsets[:, None, None] - hidden[:, None]
    phases = np.clip(passed / durations[:, None], 0.0, 1.0)
    shape = (len(weights), len(times_s), 2, 3)
    means = promp.trajectory_mean(phases.ravel()).reshape(shape)
    both = promp.trajectory_covariance(phases.ravel())
    within = np.stack((both[:, :3, :3], both[:, 3:, 3:]), axis=1).reshape(*shape, 3)
    mean = np.einsum("n,nkij->kij", weights, means)
    off = means - mean
    covariance = np.einsum("n,nkijl->kijl", weights, within)
    covariance += np.einsum("n,nkij,nkil->kijl", weights, off, off)
    return mean, covariance
