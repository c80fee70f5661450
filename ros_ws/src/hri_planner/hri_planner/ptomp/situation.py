"""How hard the situation is: the five inputs of parameter adaptation (section 6.4.5)."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hri_planner.ptomp.forecast import HumanForecast
from hri_planner.ptomp.result import ReplanResult

FloatArray = NDArray[np.float64]

WRIST = 2
"""Index of the wrist among the keypoints of an arm."""
AHEAD_S = 0.2
"""How long before they come true predictions are held against what was then seen [s]."""
WINDOW_S = 1.0
"""The error of the predictions is that of so much time [s]."""


@dataclass(frozen=True)
class Situation:
    """The five inputs.

    Attributes:
        uncertainty: See :func:`uncertainty`; of the least certain arm, 0 without people [m].
        error: See :class:`PredictionError`; of the worst arm, 0 while nothing can be compared [m].
        distance: Smallest surface distance robot-person now [m].
        time_to_collision: To the first predicted contact of the present plan; without one, the
            duration of the motion [s].
        collision_cost: Weighted collision cost of the present plan; 0 without one.
    """

    uncertainty: float
    error: float
    distance: float
    time_to_collision: float
    collision_cost: float


def situation(
    uncertainties: Sequence[float],
    errors: Sequence[float],
    distance: float,
    duration_s: float,
    result: ReplanResult | None = None,
    start_in_s: float = 0.0,
) -> Situation:
    """The five inputs, now.

    Args:
        uncertainties: Of the prediction of each arm, by :func:`uncertainty` [m].
        errors: Of the predictions of each arm, by :class:`PredictionError` [m].
        distance: Smallest surface distance robot-person now [m].
        duration_s: Duration that the motion was to have [s].
        result: What the present plan is; none without one.
        start_in_s: From now to the first point of that plan [s].
    """
    contact_s = None if result is None else result.predicted_first_contact_s
    left_s = duration_s
    if result is not None and contact_s is not None:
        left_s = max(contact_s - result.plan.start_s + start_in_s, 0.0)
    return Situation(
        uncertainty=max(uncertainties, default=0.0),
        error=max(errors, default=0.0),
        distance=distance,
        time_to_collision=left_s,
        collision_cost=0.0 if result is None else result.cost_terms["collision"],
    )


def uncertainty(forecast: HumanForecast) -> float:
    """Mean, over horizon and keypoints, of the root of the covariance's largest eigenvalue [m]."""
    return float(np.mean(np.asarray(forecast.sigma, dtype=float)))


class PredictionError:
    """Running error of one arm's predictions: what was said of the wrist, and what it then did.

    What a prediction says of its first instant is what was seen. It is compared with what the newest of
    those predictions that are :data:`AHEAD_S` old, or somewhat more, had said of this instant.
    """

    def __init__(self) -> None:
        self._said: deque[tuple[float, FloatArray, FloatArray]] = deque()
        self._squared: deque[tuple[float, float]] = deque()

    def observe(self, time_s: float, offsets_s: FloatArray, wrist: FloatArray) -> None:
        """Take a prediction.

        Args:
            time_s: Capture time of its newest sample [s]; one that is not later than the one before
                begins anew.
            offsets_s: Its instants (K,) after that [s], increasing, from 0.
            wrist: Positions of the wrist at these instants (K, 3) [m].
        """
        if self._said and time_s <= self._said[-1][0]:
            self._said.clear()
            self._squared.clear()
        before_s = time_s - AHEAD_S + 1e-9  # stamps are nanoseconds
        while len(self._said) > 1 and self._said[1][0] <= before_s:
            self._said.popleft()
        if self._said and self._said[0][0] <= before_s:
            said_s, said_offsets, said_wrist = self._said[0]
            after_s = time_s - said_s
            if after_s <= said_offsets[-1]:
                expected = [np.interp(after_s, said_offsets, axis) for axis in said_wrist.T]
                squared = float(((wrist[0] - np.array(expected)) ** 2).sum())
                self._squared.append((time_s, squared))
        while self._squared and self._squared[0][0] < time_s - WINDOW_S:
            self._squared.popleft()
        self._said.append((time_s, offsets_s, wrist))

    @property
    def rms(self) -> float:
        """Root mean square of the last second; 0 while nothing can be compared [m]."""
        if not self._squared:
            return 0.0
        return math.sqrt(sum(squared for _, squared in self._squared) / len(self._squared))
