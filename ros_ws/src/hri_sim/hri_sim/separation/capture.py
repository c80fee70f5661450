"""Motion capture of who meets the robot: noise, delays, wrong stamps, gaps, markers that are hidden."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

LONGEST_GAP_S = 0.06
"""Nothing, or a keypoint, is not seen for at most so long [s]."""


@dataclass(frozen=True)
class Capture:
    """What motion capture makes of a person.

    Attributes:
        noise: Standard deviation of each coordinate [m].
        most: Longest error of a place; longer ones are cut [m].
        delay: From capture to the monitor, shortest and longest [s].
        stamps: Stamps, those of joints too, may be late by so much, the same in all of an encounter [s].
        gaps: Mean time between gaps, in which nothing is seen for up to 60 ms [s].
        hidden: Mean time until a keypoint of either arm is hidden, for up to 60 ms [s].
    """

    noise: float = 0.003
    most: float = 0.01
    delay: tuple[float, float] = (0.004, 0.020)
    stamps: float = 0.005
    gaps: float = 1.0
    hidden: float = 0.5


class MotionCapture:
    """Samples of both arms on their way to the monitor.

    Args:
        capture: What it is like.
        period_s: Of capture [s].
        rng: Of everything random.

    Attributes:
        stamps_ns: How late stamps are [ns].
    """

    def __init__(self, capture: Capture, period_s: float, rng: np.random.Generator) -> None:
        self._capture, self._period_s, self._rng = capture, period_s, rng
        self.stamps_ns = round(rng.uniform(0.0, capture.stamps) * 1e9)
        self._gap_until_ns = 0
        self._hidden_until_ns = np.zeros((2, 4), dtype=np.int64)
        self._samples: deque[tuple[int, int, FloatArray]] = deque()

    def see(self, now_ns: int, arms: FloatArray) -> None:
        """Send a sample, unless there is a gap.

        Args:
            now_ns: The time [ns].
            arms: Shoulder, elbow, wrist, hand tip of left and right arm (2, 4, 3) [m].
        """
        capture, rng = self._capture, self._rng
        if rng.random() < self._period_s / capture.gaps:
            self._gap_until_ns = now_ns + round(rng.uniform(0.0, LONGEST_GAP_S) * 1e9)
        if rng.random() < self._period_s / capture.hidden:
            which = int(rng.integers(2)), int(rng.integers(4))
            self._hidden_until_ns[which] = now_ns + round(rng.uniform(0.0, LONGEST_GAP_S) * 1e9)
        if now_ns < self._gap_until_ns:
            return
        error = rng.normal(0.0, capture.noise, (2, 4, 3))
        length = np.linalg.norm(error, axis=-1, keepdims=True)
        error *= np.minimum(1.0, capture.most / np.maximum(length, 1e-12))
        seen = arms + error
        seen[now_ns < self._hidden_until_ns] = np.nan
        arrives = now_ns + round(rng.uniform(*capture.delay) * 1e9)
        self._samples.append((arrives, now_ns + self.stamps_ns, seen))

    def arrived(self, now_ns: int) -> Iterator[tuple[int, FloatArray]]:
        """Samples that have come: their stamps [ns], and both arms (2, 4, 3) [m], NaN where not seen."""
        while self._samples and self._samples[0][0] <= now_ns:
            _, stamp_ns, arms = self._samples.popleft()
            yield stamp_ns, arms
