"""What the predictor says of a visitor's arms, as the node of that name would: without a library."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from hri_planner.separation.monitor import ArmPrediction
from hri_prediction.arm.geometry import SIDES
from hri_prediction.prediction.output import ReachState
from hri_prediction.prediction.predictor import ReachPredictor
from hri_prediction.tracks.track import ArmSample

FloatArray = NDArray[np.float64]

PERIOD_NS = 20_000_000
"""Between two predictions [ns]."""
_NANO = 1e-9


class Forecasts:
    """Predictions of both arms of one body.

    Args:
        body_id: Of the body.
        most_age: Predictions whose newest sample is older say nothing [s].
    """

    def __init__(self, body_id: str, most_age: float) -> None:
        self._body_id, self._most_age = body_id, most_age
        self._predictors = {side: ReachPredictor() for side in SIDES}
        self._made: dict[str, tuple[int, ArmPrediction]] = {}
        self._next_ns: int | None = None

    def take(self, stamp_ns: int, arms: FloatArray) -> None:
        """Take a sample of left and right arm (2, 4, 3) [m], NaN where not seen, with its stamp [ns]."""
        for side, arm in zip(SIDES, arms, strict=True):
            seen = ArmSample(stamp_ns, arm, ~np.isnan(arm[:, 0]), side)
            self._predictors[side].observe(seen)

    def at(self, now_ns: int) -> Mapping[tuple[str, str], ArmPrediction]:
        """What is predicted, by body id and side; made anew once a period."""
        if self._next_ns is None or now_ns >= self._next_ns:
            self._next_ns = now_ns + PERIOD_NS
            self._made.clear()
            for side, predictor in self._predictors.items():
                found = predictor.predict(now_ns)
                if found is not None and found.state is not ReachState.INVALID:
                    said = ArmPrediction(0.0, found.times_s, found.mean, found.covariance)
                    self._made[side] = (found.stamp_ns, said)
        aged = {}
        for side, (stamp_ns, said) in self._made.items():
            age = (now_ns - stamp_ns) * _NANO
            if age <= self._most_age:
                aged[self._body_id, side] = ArmPrediction(
                    age, said.times_s, said.mean, said.covariance
                )
        return aged
