"""What a planner is told of the person: from our prediction to the truth."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np

from hri_planner.ptomp.forecast import HumanForecast, forecast_of
from hri_prediction.arm.geometry import ArmRadii, FloatArray
from hri_prediction.prediction import ReachPredictor, ReachState, TaskLibrary
from hri_prediction.tracks.track import ArmSample
from hri_sim.benchmark.prior import PriorObserver
from hri_sim.people.person import SimulatedPerson

_STEP_S = 0.02
_HORIZON_S = 3.0  # of the oracle: longer than any planner looks


class Observer(Protocol):
    """Watches a person and says what is to come."""

    def see(self, sample: ArmSample) -> None:
        """Take a tracked sample, which has just been delivered."""

    def forecast(self, now_s: float) -> HumanForecast | None:
        """What is expected from now on, on the samples' clock; none while nothing is known."""


class _Predicting:
    """The forecast of a predictor, the last valid one while it has none."""

    def __init__(self, library: TaskLibrary | None) -> None:
        self._predictor = ReachPredictor(library)
        self._last: HumanForecast | None = None

    def see(self, sample: ArmSample) -> None:
        self._predictor.observe(sample)

    def forecast(self, now_s: float) -> HumanForecast | None:
        said = self._predictor.predict(round(now_s * 1e9))
        if said is not None and said.state != ReachState.INVALID:
            begin_s, radii = said.stamp_ns * 1e-9, ArmRadii().array
            self._last = forecast_of(begin_s, said.times_s, said.mean, said.covariance, radii)
        return self._last


class _Staying:
    """No prediction: every keypoint stays where it was last seen."""

    def __init__(self) -> None:
        self._points: FloatArray = np.full((4, 3), np.nan)

    def see(self, sample: ArmSample) -> None:
        self._points[sample.valid] = sample.keypoints[sample.valid]

    def forecast(self, now_s: float) -> HumanForecast | None:
        if np.isnan(self._points).any():
            return None
        points = self._points[None].copy()
        return HumanForecast(now_s, _STEP_S, points, np.zeros((1, 4)), ArmRadii().array)


class _Unseen:
    """Nobody is seen."""

    def see(self, sample: ArmSample) -> None:
        pass

    def forecast(self, now_s: float) -> HumanForecast | None:
        return None


class _Oracle:
    """The true motion to come."""

    def __init__(self, person: SimulatedPerson) -> None:
        self._person = person

    def see(self, sample: ArmSample) -> None:
        pass

    def forecast(self, now_s: float) -> HumanForecast | None:
        times = now_s + np.arange(round(_HORIZON_S / _STEP_S) + 1) * _STEP_S
        arm = self._person.truth(times)
        return HumanForecast(now_s, _STEP_S, arm, np.zeros(arm.shape[:2]), ArmRadii().array)


OBSERVERS: dict[str, Callable[[SimulatedPerson, TaskLibrary], Observer]] = {
    "promp": lambda person, library: _Predicting(library),
    "prior": lambda person, library: PriorObserver(library),
    "constant_velocity": lambda person, library: _Predicting(None),
    "staying": lambda person, library: _Staying(),
    "unseen": lambda person, library: _Unseen(),
    "oracle": lambda person, library: _Oracle(person),
}
"""By the quality of the prediction: learnt from the task's recorded reaches and updated by what is seen;
the same before anything is seen of the reach; at constant velocity; none (the arm stays where it is seen);
not even a person; and perfect. All but the last two see tracked samples only."""
