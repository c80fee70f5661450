"""Samples through the predictor, one by one, as its node passes them on."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hri_prediction.prediction.output import Prediction, ReachState
from hri_prediction.prediction.predictor import ReachPredictor
from hri_prediction.tracks.track import ArmTrack

Array = NDArray[np.float64]
PERIOD_S = 0.02
"""Time between predictions, as in the node [s]."""
WRIST = 2


@dataclass(frozen=True, eq=False)
class Forecast:
    """Where the wrist will be.

    Args:
        mean: (K, 3) metres.
        covariance: (K, 3, 3) square metres, of what a sensor will see.
    """

    mean: Array
    covariance: Array


@dataclass(frozen=True, eq=False)
class Cut:
    """A prediction at one time of a replay.

    Args:
        now_s: Time of the newest sample, on the clock of the track.
        prediction: What the predictor said then; none before it saw the arm.
        onset_s: Begin of the reach as the segmentation finds it, on the clock of the track; none unless
            the predictor has noticed a reach.
    """

    now_s: float
    prediction: Prediction | None
    onset_s: float | None = None

    @staticmethod
    def of(predictor: ReachPredictor, now_s: float) -> Cut:
        """What a predictor says after the sample at ``now_s`` on the clock of the track."""
        prediction, crossing = predictor.predict(), predictor.crossing_ns
        reaching = prediction is not None and prediction.state == ReachState.REACHING
        if prediction is None or not reaching or crossing is None:
            return Cut(now_s, prediction)
        return Cut(now_s, prediction, now_s - (prediction.stamp_ns - crossing) * 1e-9)

    def belief(self, duration_s: float, task: str) -> Array:
        """Expected duration less the true one, both from rest to rest [s]; whether the task is right.

        Right (1, else 0) is the likeliest of the tasks, "unknown" among them, when it is the true one.
        NaN while the reach has not been noticed, and for a task that is not in the library.
        """
        if self.prediction is None or self.onset_s is None or not self.prediction.task_names:
            return np.full(2, np.nan)
        names = self.prediction.task_names
        likeliest = names[int(np.argmax(self.prediction.task_probabilities))]
        right = float(likeliest == task) if task in names else np.nan
        return np.array([self.prediction.duration_mean_s - duration_s, right])

    def forecast(self, times: Array) -> Forecast:
        """The prediction between its points, and held beyond its last, at ``times`` (K,)."""
        if self.prediction is None:
            return Forecast(np.full((times.size, 3), np.nan), np.full((times.size, 3, 3), np.nan))
        grid = self.prediction.times_s
        place = np.clip((times - self.now_s) / (grid[1] - grid[0]), 0.0, grid.size - 1.0)
        lower = np.minimum(place.astype(int), grid.size - 2)
        share = place - lower
        mean = self.prediction.mean[:, WRIST]
        spread = self.prediction.covariance[:, WRIST]
        return Forecast(
            mean[lower] + share[:, None] * (mean[lower + 1] - mean[lower]),
            spread[lower] + share[:, None, None] * (spread[lower + 1] - spread[lower]),
        )


def replay(
    predictor: ReachPredictor, track: ArmTrack, cuts: Sequence[float]
) -> tuple[list[Cut], Array]:
    """Feed a track and note the predictions at some times.

    Args:
        predictor: Is reset first.
        track: The recording.
        cuts: Increasing times on the clock of the track; each prediction is made from the samples up
            to then.

    Returns:
        One cut each, and how long a sample and the prediction after it took while a reach was under
        way (k,) [s].
    """
    predictor.reset()
    found: list[Cut] = []
    spans: list[float] = []
    now = due = float(track.time_s[0])
    clock = time.perf_counter
    # The cut is compared with half a microsecond to spare: times are sums of rounded steps.
    for row, sample in enumerate(track.samples()):
        following = float(track.time_s[row])
        while len(found) < len(cuts) and following > cuts[len(found)] + 5e-7:
            found.append(Cut.of(predictor, now) if row else Cut(now, None))
        if len(found) == len(cuts):
            break
        now = following
        begin = clock()
        predictor.observe(sample)
        if now >= due - 1e-6:
            due = now + PERIOD_S
            prediction = predictor.predict()
            if prediction is not None and prediction.state == ReachState.REACHING:
                spans.append(clock() - begin)
    while len(found) < len(cuts):
        found.append(Cut.of(predictor, now))
    return found, np.array(spans)
