"""What is known of a person at each interval: samples as they are delivered, forecasts as they are made."""

from __future__ import annotations

from collections import deque

import numpy as np

from hri_planner.ptomp import HumanForecast
from hri_sim.benchmark.observers import Observer
from hri_sim.people.person import SimulatedPerson
from hri_sim.people.tracking import (
    SAMPLE_PERIOD_NS,
    SAMPLE_RATE_HZ,
    TrackedSample,
    TrackingModel,
    tracked_samples,
)

WATCHED_S = 0.5
"""How long the person is watched before the robot starts [s]."""


class Watch:
    """A person, the tracking system that sees it, and an observer.

    Args:
        person: Who is watched.
        observer: Is told of the samples, and says what it expects.
        rng: Of the tracking.
    """

    def __init__(
        self, person: SimulatedPerson, observer: Observer, rng: np.random.Generator
    ) -> None:
        self._person = person
        self._tracking = TrackingModel(person.spec, rng)
        self._waiting: deque[TrackedSample] = deque()
        self._next_ns = -round(WATCHED_S * SAMPLE_RATE_HZ) * SAMPLE_PERIOD_NS
        self._observer = observer
        self._forecasts: list[HumanForecast | None] = []

    def advance(self, now_s: float) -> None:
        """Let the observer see what is delivered by now, and say what it expects."""
        now_ns = round(now_s * 1e9)
        count = max((now_ns - self._next_ns) // SAMPLE_PERIOD_NS + 1, 0)
        self._waiting += tracked_samples(self._person, self._tracking, self._next_ns, count)
        self._next_ns += count * SAMPLE_PERIOD_NS
        while self._waiting and self._waiting[0].delivery_ns <= now_ns:
            self._observer.see(self._waiting.popleft().sample)
        self._forecasts.append(self._observer.forecast(now_s))

    def known(self, intervals: int) -> list[HumanForecast]:
        """The newest forecast of so many intervals before the end of the present one."""
        forecast = self._forecasts[max(len(self._forecasts) - intervals, 0)]
        return [] if forecast is None else [forecast]
