"""Onset and end of reaches from the speed of the wrist; streaming, also used offline.

The speed is the slope of a regression line over a short window (:mod:`.speed`), which belongs to the
*middle* of that window. Where samples come so seldom that few fit into it, it is as long as five of
their periods (:mod:`.rate`). A reach begins when the speed passes ``on_speed`` and is back-dated to
where it left ``onset_speed``; it ends when the speed stays below ``onset_speed`` for ``rest_time``,
back-dated to where that began; both times are refined by a fit to the positions (:mod:`.crossing`). A
reach that follows without such a rest (there and back again) begins at the dip of the speed between the
two. :func:`find_reaches` feeds a whole recording through the same code, so that training and prediction
cut alike.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hri_prediction.config import parameter, validate
from hri_prediction.errors import ConfigError, DataError
from hri_prediction.tracks.crossing import rise_crossing
from hri_prediction.tracks.rate import SamplePeriod, window_s
from hri_prediction.tracks.speed import regression_speed

Array = NDArray[np.float64]
_REST_S = 0.2
"""Rest before a crossing that an onset is fitted to, and after one for an end [s]."""
_FIT_REACH_S = 0.06
"""Farthest that the fit may move a crossing [s]."""

ROUNDING_S = 1e-6
"""To spare where times are compared [s]: samples often lie on a threshold, and on which side of it must not
hang on rounding, and so on when the first sample was."""


@dataclass(frozen=True)
class SegmentationConfig:
    """Thresholds of the segmentation."""

    window: float = parameter(
        0.1,
        "least length of the regression; longer = calmer, but seen half of it later",
        unit="s",
        low=0.02,
        high=1.0,
    )
    on_speed: float = parameter(0.08, "speed above which a reach has begun", unit="m/s", low=0.001)
    onset_speed: float = parameter(
        0.04, "speed at which onset and end are placed; below on_speed", unit="m/s", low=0.0005
    )
    confirm_time: float = parameter(
        0.02, "time above on_speed before it counts", unit="s", low=0.0, high=1.0
    )
    rest_time: float = parameter(
        0.12, "time below onset_speed before a reach has ended", unit="s", low=0.0, high=5.0
    )
    dip: float = parameter(
        0.25, "a dip of the speed below this share of the peak parts two reaches", low=0.0, high=0.9
    )
    min_duration: float = parameter(
        0.25, "shorter movements are no reaches (offline)", unit="s", low=0.0
    )
    max_back_date: float = parameter(
        0.4, "longest time from onset to its detection", unit="s", low=0.0
    )
    max_gap: float = parameter(
        0.1, "longest time without a sample inside a reach", unit="s", low=0.001
    )

    def __post_init__(self) -> None:
        validate(self)
        if self.onset_speed >= self.on_speed:
            raise ConfigError(
                f"onset_speed = {self.onset_speed}", expected=f"below on_speed = {self.on_speed}"
            )


@dataclass(frozen=True)
class Event:
    """What one sample changed.

    Args:
        kind: "onset" (which also ends a reach that was under way), "end", or "lost" (a gap inside
            a reach).
        time_s: When it happened, back-dated, on the clock of the samples.
    """

    kind: str
    time_s: float


@dataclass(frozen=True)
class Reach:
    """One reach, seconds on the clock of the track."""

    onset_s: float
    end_s: float

    @property
    def duration_s(self) -> float:
        """From onset to end."""
        return self.end_s - self.onset_s


class ReachSegmenter:
    """Finds onsets and ends in a stream of wrist positions, causally.

    Args:
        config: Thresholds.
    """

    def __init__(self, config: SegmentationConfig | None = None) -> None:
        self.config = config or SegmentationConfig()
        self._times = np.zeros(64)
        self._points = np.zeros((64, 3))
        self._period = SamplePeriod()
        self.reset()

    @property
    def period_s(self) -> float:
        """Time between the samples of late [s]; 0 until there were enough."""
        return self._period.period_s

    @property
    def rest_s(self) -> float:
        """Since when a reach that is under way may be over, as it is slow [s]; infinite: it is not."""
        return math.inf if self._below is None or not self.moving else self._below

    @property
    def slowing(self) -> bool:
        """Whether a reach is under way that is slower by half than it has been, or slow anyway.

        Its speed is seen half a window late: waiting until it is that of an end would be too late.
        """
        return self.moving and self.speed < max(0.5 * self._peak, 2.0 * self.config.on_speed)

    def reset(self) -> None:
        """Forget everything; the next sample is the first."""
        self._period.reset()
        self._forget()

    def _forget(self) -> None:
        """Begin anew; how often samples come is still known."""
        self.window_s = self.config.window
        self._count = 0
        self._speeds: deque[tuple[float, float]] = deque()
        self._above: float | None = None
        self._below: float | None = None
        self._last: float | None = None
        self._peak = self._low = self._low_time = 0.0
        self.moving = False
        self.onset_s = math.nan
        self.speed = math.nan

    def push(self, time_s: float, wrist: Array) -> Event | None:
        """Take one sample.

        Args:
            time_s: Capture time, strictly increasing; leave samples that were not seen out.
            wrist: (3,) position in metres, finite.

        Returns:
            What changed, if anything.

        Raises:
            DataError: if time does not increase.
        """
        if self._last is not None and time_s <= self._last:
            raise DataError(f"time {time_s}", expected=f"later than {self._last}")
        if self._last is not None:
            self._period.add(time_s - self._last)
        if self._last is not None and time_s - self._last > self.config.max_gap + ROUNDING_S:
            was_moving, last = self.moving, self._last
            self._forget()
            self._append(time_s, wrist)
            return Event("lost", last) if was_moving else None
        self.window_s = window_s(self.config.window, self.period_s)
        self._append(time_s, wrist)
        first = self._first_since(time_s - self.window_s)
        times = self._times[first : self._count]
        # A window that is not nearly full would place its speed at the wrong time.
        if times[-1] - times[0] < 0.7 * self.window_s - ROUNDING_S:
            return None
        self.speed = float(regression_speed(times, self._points[first : self._count]))
        if math.isnan(self.speed):
            return None
        middle = 0.5 * float(times[0] + times[-1])
        return self._end(middle) if self.moving else self._start(middle)

    def _first_since(self, time_s: float) -> int:
        """Row of the first sample that is kept and not older than ``time_s``."""
        return int(np.searchsorted(self._times[: self._count], time_s - ROUNDING_S, side="left"))

    def _append(self, time_s: float, wrist: Array) -> None:
        self._last = time_s
        first = self._first_since(time_s - self.window_s - self.config.max_back_date)
        if first:
            keep = self._count - first
            self._times[:keep] = self._times[first : self._count].copy()
            self._points[:keep] = self._points[first : self._count].copy()
            self._count = keep
        if self._count == self._times.size:
            self._times = np.concatenate([self._times, np.zeros_like(self._times)])
            self._points = np.concatenate([self._points, np.zeros_like(self._points)])
        self._times[self._count] = time_s
        self._points[self._count] = wrist
        self._count += 1

    def _start(self, middle: float) -> Event | None:
        self._speeds.append((middle, self.speed))
        while middle - self._speeds[0][0] > self.config.max_back_date + ROUNDING_S:
            self._speeds.popleft()
        if self.speed < self.config.on_speed:
            self._above = None
            return None
        if self._above is None:
            self._above = middle
        if middle - self._above < self.config.confirm_time - ROUNDING_S:
            return None
        self.moving = True
        self.onset_s = self._back_dated_onset()
        self._above = None
        self._below = None
        self._begin(middle)
        return Event("onset", self.onset_s)

    def _begin(self, middle: float) -> None:
        self._speeds.clear()
        self._peak = self.speed
        self._low, self._low_time = self.speed, middle

    def _back_dated_onset(self) -> float:
        """Where the speed last left ``onset_speed``, by a fit to the positions around."""
        crossing = self._last_crossing()
        # From rest on: what came before may be another movement.
        first = self._first_since(crossing - _REST_S)
        return float(
            rise_crossing(
                self._times[first : self._count],
                self._points[first : self._count],
                self.config.onset_speed,
                crossing,
                _FIT_REACH_S,
            )
        )

    def _back_dated_end(self, below: float) -> float:
        """Where the speed fell below ``onset_speed``: the same fit, backwards in time."""
        first = self._first_since(below - 2.0 * _FIT_REACH_S)
        return -float(
            rise_crossing(
                -self._times[first : self._count][::-1],
                self._points[first : self._count][::-1].copy(),
                self.config.onset_speed,
                -below,
                _FIT_REACH_S,
            )
        )

    def _last_crossing(self) -> float:
        """Where the speed last left ``onset_speed``, interpolated between samples."""
        level = self.config.onset_speed
        later = self._speeds[-1]
        for earlier in reversed(self._speeds):
            if earlier[1] < level:
                rise = later[1] - earlier[1]
                share = (level - earlier[1]) / rise if rise > 0.0 else 1.0
                return earlier[0] + share * (later[0] - earlier[0])
            later = earlier
        return later[0]

    def _end(self, middle: float) -> Event | None:
        if self.speed > self._peak:
            self._peak = self._low = self.speed
        if self.speed <= self._low:
            self._low, self._low_time = self.speed, middle
        deep = self._low < self.config.dip * self._peak
        if deep and self.speed > max(self.config.on_speed, 2.0 * self._low):
            self.onset_s = self._low_time
            self._below = None
            self._begin(middle)
            return Event("onset", self.onset_s)
        if self.speed >= self.config.onset_speed:
            self._below = None
            return None
        if self._below is None:
            self._below = middle
        if middle - self._below < self.config.rest_time - ROUNDING_S:
            return None
        self.moving = False
        self._above = None
        self._speeds.clear()
        return Event("end", self._back_dated_end(self._below))


def find_reaches(
    time_s: Array, wrist: Array, config: SegmentationConfig | None = None
) -> list[Reach]:
    """All complete reaches of a recording.

    Args:
        time_s: (N,) strictly increasing; reaches are found from 20 Hz on (:mod:`.rate`).
        wrist: (N, 3) metres; rows with NaN are left out.
        config: Thresholds.

    Raises:
        DataError: on wrong shapes.
    """
    if wrist.shape != (time_s.size, 3):
        raise DataError(f"wrist {wrist.shape}", expected=f"shape ({time_s.size}, 3)")
    segmenter = ReachSegmenter(config)
    settings = segmenter.config
    reaches: list[Reach] = []
    seen = np.isfinite(wrist).all(axis=1)
    events: list[Event] = []
    for t, point in zip(time_s[seen], wrist[seen], strict=True):
        event = segmenter.push(float(t), point)
        if event is not None:
            events.append(event)
    if segmenter.moving and seen.any():
        # A recording may stop the moment the hand does.
        last = float(time_s[seen][-1])
        if segmenter.speed < settings.onset_speed:
            events.append(Event("end", last - 0.5 * segmenter.window_s))
    onset: float | None = None
    for event in events:
        if (
            onset is not None
            and event.kind != "lost"
            and event.time_s - onset >= settings.min_duration
        ):
            reaches.append(Reach(onset, event.time_s))
        onset = event.time_s if event.kind == "onset" else None
    return reaches
