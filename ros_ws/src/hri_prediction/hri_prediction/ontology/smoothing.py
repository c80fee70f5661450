"""Keypoints of an arm at any instant, from samples that come when they come, smoothed by a parabola.

Where samples are regular, this is the filter of Savitzky and Golay (1964) of second order: the value at the
middle of a parabola that is fitted to the samples around. (The thesis says first order, which would be a
moving average.) Where few samples are near, it is a straight line between the neighbours: those of a source
that is slower than usual are sought farther away.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from hri_prediction.compiled import njit
from hri_prediction.tracks.rate import SamplePeriod
from hri_prediction.tracks.segmentation import ROUNDING_S

FloatArray = NDArray[np.float64]

_KEPT_S = 1.0
_LEAST_FITTED = 5
"""Samples that a parabola is fitted to at least; fewer leave nothing to smooth."""
_LEAST_PERIODS = 2.6
"""So many periods away samples are fitted at least: five of them, wherever the instant lies between two."""


@njit
def smoothed_at(
    times: FloatArray, points: FloatArray, at: float, half: float, max_gap: float, out: FloatArray
) -> None:
    """Keypoints at an instant.

    Args:
        times: Of the samples, increasing (n,) [s].
        points: Their keypoints (n, 4, 3) [m]; NaN where not seen.
        at: The instant [s].
        half: Samples no farther away than that are fitted [s].
        max_gap: Longest time between the seen neighbours [s].
        out: Gets the keypoints (4, 3) [m]; NaN where the gap is longer.
    """
    for key in range(4):
        for axis in range(3):
            out[key, axis] = math.nan
        before, after, count = -1, -1, 0
        s1 = s2 = s3 = s4 = 0.0
        low = high = False
        for row in range(times.shape[0]):
            if math.isnan(points[row, key, 0]):
                continue
            apart = times[row] - at
            if apart <= ROUNDING_S:
                before = row
            if apart >= -ROUNDING_S and after < 0:
                after = row
            if abs(apart) <= half + ROUNDING_S:
                u = apart / half if half > 0.0 else 0.0
                count += 1
                s1 += u
                s2 += u * u
                s3 += u * u * u
                s4 += u * u * u * u
                low = low or u < -0.5
                high = high or u > 0.5
        if before < 0 or after < 0 or times[after] - times[before] > max_gap + ROUNDING_S:
            continue
        determinant = 0.0
        # On one side alone a parabola would be an extrapolation.
        if count >= _LEAST_FITTED and low and high:
            determinant = (
                count * (s2 * s4 - s3 * s3) - s1 * (s1 * s4 - s2 * s3) + s2 * (s1 * s3 - s2 * s2)
            )
        for axis in range(3):
            if determinant > 1e-9:
                b0 = b1 = b2 = 0.0
                for row in range(times.shape[0]):
                    apart = times[row] - at
                    value = points[row, key, axis]
                    if abs(apart) <= half + ROUNDING_S and not math.isnan(value):
                        u = apart / half
                        b0 += value
                        b1 += value * u
                        b2 += value * u * u
                out[key, axis] = (
                    b0 * (s2 * s4 - s3 * s3) - s1 * (b1 * s4 - s3 * b2) + s2 * (b1 * s3 - s2 * b2)
                ) / determinant
                continue
            one, other = points[before, key, axis], points[after, key, axis]
            span = times[after] - times[before]
            share = (at - times[before]) / span if span > ROUNDING_S else 0.0
            out[key, axis] = one + share * (other - one)


def wide_enough(time_s: FloatArray, half: float) -> float:
    """Half a window for the samples of a recording [s]: of slow ones, as wide as five of them take.

    Args:
        time_s: Of the samples, increasing (n,) [s].
        half: Half the window that is wanted [s].
    """
    if len(time_s) < 2:
        return half
    return max(half, _LEAST_PERIODS * float(np.median(np.diff(time_s))))


def smoothed_track(
    time_s: FloatArray, keypoints: FloatArray, times: FloatArray, half: float, max_gap: float
) -> FloatArray:
    """Keypoints of a whole recording at some instants.

    Args:
        time_s: Of the samples, increasing (n,) [s].
        keypoints: Shoulder, elbow, wrist, hand tip (n, 4, 3) [m]; NaN where not seen.
        times: The instants (m,) [s].
        half: Samples no farther away than that are fitted [s].
        max_gap: Longest gap that is filled [s].

    Returns:
        (m, 4, 3) [m], NaN where the gap is longer.
    """
    out = np.empty((len(times), 4, 3))
    reach = max(half, max_gap) + 2.0 * ROUNDING_S
    first = np.searchsorted(time_s, times - reach)
    last = np.searchsorted(time_s, times + reach, side="right")
    for row, at in enumerate(times):
        rows = slice(first[row], last[row])
        smoothed_at(time_s[rows], keypoints[rows], float(at), half, max_gap, out[row])
    return out


class SmoothedArm:
    """The newest samples of an arm, and what is made of them.

    Args:
        half: Samples no farther away than that are fitted [s], or as far as five of them need; 0: none.
        max_gap: Longest gap that is filled [s].

    Attributes:
        half_s: How far samples are fitted now [s]: so late is what is made of them.
    """

    def __init__(self, half: float, max_gap: float) -> None:
        self._half, self._max_gap = half, max_gap
        self.half_s = half
        self._times = np.zeros(512)
        self._points = np.zeros((512, 4, 3))
        self._count = 0
        self._period = SamplePeriod()
        self._row = np.empty((4, 3))

    @property
    def newest_s(self) -> float:
        """When the newest sample was taken [s]; minus infinity before the first."""
        return float(self._times[self._count - 1]) if self._count else -math.inf

    def forget(self) -> None:
        """Begin anew; how often samples come is still known."""
        self._count = 0

    def push(self, time_s: float, keypoints: FloatArray) -> None:
        """Take a sample: later than the one before, (4, 3) [m], NaN where not seen."""
        if self._count:
            self._period.add(time_s - self.newest_s)
            if self._half > 0.0:
                self.half_s = max(self._half, _LEAST_PERIODS * self._period.period_s)
        if self._count == len(self._times):
            first = int(np.searchsorted(self._times, time_s - _KEPT_S))
            if first < self._count // 2:
                self._times = np.concatenate((self._times, np.zeros_like(self._times)))
                self._points = np.concatenate((self._points, np.zeros_like(self._points)))
            keep = self._count - first
            self._times[:keep] = self._times[first : self._count].copy()
            self._points[:keep] = self._points[first : self._count].copy()
            self._count = keep
        self._times[self._count] = time_s
        self._points[self._count] = keypoints
        self._count += 1

    def at(self, time_s: float) -> FloatArray:
        """Keypoints at an instant (4, 3) [m], NaN where they were not seen; valid until the next call."""
        reach = max(self.half_s, self._max_gap) + 2.0 * ROUNDING_S
        times = self._times[: self._count]
        first = int(np.searchsorted(times, time_s - reach))
        last = int(np.searchsorted(times, time_s + reach, side="right"))
        smoothed_at(
            times[first:last],
            self._points[first:last],
            time_s,
            self.half_s,
            self._max_gap,
            self._row,
        )
        return self._row
