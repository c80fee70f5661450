"""How often samples come, as their stamps tell, and what is too seldom to find reaches in."""

from __future__ import annotations

from collections import deque

from hri_prediction.errors import DataError
from hri_prediction.tracks.track import ArmTrack

MIN_RATE_HZ = 20.0
"""Lowest rate at which reaches are found: below, a window of :data:`WINDOW_PERIODS` is as long as a short
reach, and one missing sample is a gap [Hz]."""
WINDOW_PERIODS = 5
"""Sample periods that a regression of the speed spans at least: six samples, or five with one missing."""
_SLACK = 1.02
"""A rate that is this much too low is put down to rounded stamps."""
_KEPT = 15
_NEEDED = 5


class SamplePeriod:
    """Time between samples, from the past ones alone: the median of the last steps.

    A gap, or a few missing samples, do not move it.
    """

    def __init__(self) -> None:
        self._steps: deque[float] = deque(maxlen=_KEPT)

    def reset(self) -> None:
        """Forget all steps."""
        self._steps.clear()

    def add(self, step_s: float) -> None:
        """Take the time since the sample before [s]."""
        self._steps.append(step_s)

    @property
    def period_s(self) -> float:
        """The median [s]; 0 until there are enough steps."""
        count = len(self._steps)
        return sorted(self._steps)[count // 2] if count >= _NEEDED else 0.0


def window_s(shortest_s: float, period_s: float) -> float:
    """Length of the regression for samples that come at a period [s]."""
    return max(shortest_s, WINDOW_PERIODS * period_s)


def too_slow(period_s: float) -> str:
    """Why no reach can be found in samples that come at a period; empty where one can."""
    if period_s * MIN_RATE_HZ <= _SLACK:
        return ""
    return f"samples come at {1.0 / period_s:.3g} Hz, too seldom to find reaches"


def check_rate(track: ArmTrack, where: str = "") -> None:
    """Refuse a track whose samples are too few a second to find reaches in.

    Args:
        track: The track.
        where: What the error names it, such as its number in a file.

    Raises:
        DataError: naming the rate.
    """
    reason = too_slow(1.0 / track.rate_hz)
    if reason:
        raise DataError(
            f"{where + ': ' if where else ''}{reason}", expected=f"{MIN_RATE_HZ:g} Hz or more"
        )
