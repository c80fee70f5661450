"""True arms over time, as the simulator hears them."""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


class ArmTimeline:
    """The latest poses of one arm; interpolates between them, holds the last one.

    Args:
        length: How many poses to keep.
    """

    def __init__(self, length: int = 64) -> None:
        self._poses: deque[tuple[int, FloatArray]] = deque(maxlen=length)

    def add(self, stamp_ns: int, keypoints: FloatArray) -> None:
        """Append a pose (4, 3) [m]; a stamp that goes back starts the timeline anew."""
        if self._poses and stamp_ns < self._poses[-1][0]:
            self._poses.clear()
        self._poses.append((stamp_ns, keypoints))

    def clear(self) -> None:
        """Forget everything."""
        self._poses.clear()

    def at(self, stamp_ns: int) -> FloatArray | None:
        """The pose (4, 3) [m] at a time; none before anything was heard."""
        if not self._poses:
            return None
        later = self._poses[-1]
        if stamp_ns >= later[0]:
            return later[1]
        for earlier in reversed(self._poses):
            if earlier[0] <= stamp_ns:
                share = (stamp_ns - earlier[0]) / max(later[0] - earlier[0], 1)
                return earlier[1] + share * (later[1] - earlier[1])
            later = earlier
        return later[1]
