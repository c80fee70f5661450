"""What is known of a reach before it begins: the ProMP prior, for planners that plan once."""

from __future__ import annotations

import numpy as np

from hri_planner.ptomp.forecast import HumanForecast, forecast_of
from hri_prediction.arm.geometry import ArmRadii, FloatArray
from hri_prediction.prediction import PredictorConfig, TaskLibrary
from hri_prediction.prediction.library import TaskModel
from hri_prediction.prediction.output import whole_arm
from hri_prediction.tracks.track import ArmSample
from hri_sim.scenario.conditions import DELAY_S

ONSET_S = 0.5 * (DELAY_S[0] + DELAY_S[1])
"""Mean time from the robot's start to the person's onset [s]."""
ONSET_SD_S = (DELAY_S[1] - DELAY_S[0]) / np.sqrt(12.0)
"""Its standard deviation, as it is drawn evenly [s]."""
_STEP_S = 0.02
_HORIZON_S = 3.0


class PriorObserver:
    """Every reach that the library knows, from the pose that is seen, at the onset to be expected.

    With several tasks there are as many arms in the forecast, since any of them may come. The time of onset
    is uncertain by what the conditions draw it from: that widens the forecast along the path.

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
        phases = (now_s + times - ONSET_S) / task.duration_mean_s
        moving = (phases > 0.0) & (phases < 1.0)
        phases = np.clip(phases, 0.0, 1.0)
        mean = promp.trajectory_mean(phases).reshape(-1, 2, 3)
        rate = promp.trajectory_mean(phases, order=1).reshape(-1, 2, 3) / task.duration_mean_s
        rate[~moving] = 0.0
        both = promp.trajectory_covariance(phases)
        covariance = np.stack((both[:, :3, :3], both[:, 3:, 3:]), axis=1)
        covariance += ONSET_SD_S**2 * rate[..., :, None] * rate[..., None, :]
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
