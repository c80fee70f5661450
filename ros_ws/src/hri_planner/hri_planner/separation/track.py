"""One arm as motion capture tells of it: where each keypoint was seen last, and how fast it was.

Nothing is guessed: a keypoint that is not seen stays where it was and grows old, and with its age grows
how far it may have gone. A limb that jumps faster than any moves is reckoned with where it is said to be
and, for a while, where it was: either may be true, when markers were swapped or two sources speak of one
person. So is one that a sample which comes late has elsewhere than those about the same time: of two
sources the later one may be right.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from hri_planner.separation.config import ReleaseConfig
from hri_planner.separation.parts import LIMBS, SeenArm
from hri_planner.separation.samples import JUMPS, NANO, RING, judge, store, velocities
from hri_prediction.errors import DataError
from hri_prediction.tracks.plausible import SEGMENT_M

FloatArray = NDArray[np.float64]
WINDOW_NS = 48_000_000
"""Samples of so long give a keypoint's velocity [ns]."""
JUMP_M = 0.03
"""So much the place of a marker may jump without being doubted [m]."""
MOST_DOUBTED = 4
"""Jumps that are remembered; of more, the newest."""
_UNKNOWN = np.full((4, 3), np.nan)


@dataclass(frozen=True, eq=False)
class _Doubted:
    until_ns: int
    since_ns: NDArray[np.int64]
    keypoints: FloatArray
    late: bool = False


@dataclass(eq=False)
class ArmWatch:
    """One arm of one person.

    Args:
        side: ``"left"`` or ``"right"``.
        config: When a jump is one, and for how long it is doubted.
        measures: Whether speeds are told; else they are not known.

    Attributes:
        jumps: Jumps so far, and late samples that are elsewhere.
    """

    side: str
    config: ReleaseConfig
    measures: bool = True
    jumps: int = 0
    _newest_ns: int | None = None
    _places: FloatArray = field(default_factory=lambda: np.full((4, 3), np.nan))
    _seen_ns: NDArray[np.int64] = field(default_factory=lambda: np.zeros(4, dtype=np.int64))
    _ring_ns: NDArray[np.int64] = field(default_factory=lambda: np.zeros(RING, dtype=np.int64))
    _ring: FloatArray = field(default_factory=lambda: np.full((RING, 4, 3), np.nan))
    _span: NDArray[np.int64] = field(default_factory=lambda: np.zeros(2, dtype=np.int64))
    _doubted: deque[_Doubted] = field(default_factory=lambda: deque(maxlen=MOST_DOUBTED))
    _heard: deque[tuple[int, FloatArray]] = field(default_factory=lambda: deque(maxlen=RING))

    @property
    def newest_ns(self) -> int | None:
        """Capture time of the newest sample in which anything was seen [ns]."""
        return self._newest_ns

    @property
    def missing(self) -> tuple[int, ...]:
        """Keypoints that have never been seen."""
        return tuple(int(k) for k in np.flatnonzero(np.isnan(self._places[:, 0])))

    @property
    def places(self) -> FloatArray:
        """Where each keypoint was seen last (4, 3) [m]; NaN where it never was."""
        return self._places

    def add(self, stamp_ns: int, keypoints: FloatArray) -> None:
        """Take a sample; one that is no newer than the newest says nothing new, or is a jump.

        Args:
            stamp_ns: Capture time [ns].
            keypoints: Shoulder, elbow, wrist, hand tip (4, 3) [m]; NaN where not seen.

        Raises:
            DataError: when upper arm or forearm is as long as none is; the sample is not taken.
        """
        if np.isnan(keypoints[:, 0]).all():
            return
        low, high = SEGMENT_M
        # Markers move on the skin, and noise comes on top: only a length that is far off is refused.
        verdict = judge(
            stamp_ns,
            keypoints,
            self._places,
            self._seen_ns,
            self.config.plausible_speed,
            JUMP_M,
            0.5 * low,
            1.5 * high,
        )
        if verdict < 0:
            limb = -1 - verdict
            raise DataError(
                f"the {LIMBS[limb].replace('_', ' ')} is "
                f"{math.dist(keypoints[limb + 1], keypoints[limb]):.3g} m long",
                expected=f"{low:g} to {high:g} m",
                hint="check the unit: positions are in metres",
            )
        if self._newest_ns is not None and stamp_ns <= self._newest_ns:
            if self._elsewhere(stamp_ns, keypoints):
                self.jumps += 1
                self._doubt_late(stamp_ns, keypoints)
            return
        if verdict == JUMPS:
            self.jumps += 1
            if not self.missing:
                until = stamp_ns + round(self.config.doubt_time * NANO)
                self._doubted.append(_Doubted(until, self._seen_ns.copy(), self._places.copy()))
            self._span[:] = 0
        self._newest_ns = stamp_ns
        self._heard.append((stamp_ns, keypoints.copy()))
        store(
            stamp_ns,
            keypoints,
            self._places,
            self._seen_ns,
            self._ring_ns,
            self._ring,
            self._span,
            WINDOW_NS,
        )

    def _elsewhere(self, stamp_ns: int, keypoints: FloatArray) -> bool:
        """Whether a late sample has a keypoint where it cannot have been, by those about that time.

        Args:
            stamp_ns: Its capture time [ns].
            keypoints: (4, 3) [m].
        """
        before = [one for one in self._heard if one[0] <= stamp_ns][-1:]
        after = [one for one in self._heard if one[0] > stamp_ns][:1]
        apart = [self._is_apart(stamp_ns, keypoints, *one) for one in (*before, *after)]
        return bool(apart) and all(apart)

    def _is_apart(
        self, stamp_ns: int, keypoints: FloatArray, other_ns: int, other: FloatArray
    ) -> bool:
        """Whether no arm is so fast as to be in both of two places [m] at their times [ns]."""
        reach = self.config.plausible_speed * abs(stamp_ns - other_ns) / NANO + JUMP_M
        return bool((np.linalg.norm(keypoints - other, axis=1) > reach).any())  # NaN is not

    def _doubt_late(self, stamp_ns: int, keypoints: FloatArray) -> None:
        """Reckon with where a late sample has the arm, in place of where its source had it before."""
        if self.missing or self._newest_ns is None:
            return
        seen = ~np.isnan(keypoints[:, 0])
        places = np.where(seen[:, None], keypoints, self._places)
        since = np.where(seen, stamp_ns, self._seen_ns)
        for doubted in self._doubted:
            then_ns = int(doubted.since_ns.max())
            if doubted.late and not self._is_apart(stamp_ns, places, then_ns, doubted.keypoints):
                self._doubted.remove(doubted)
                break
        until = self._newest_ns + round(self.config.doubt_time * NANO)
        self._doubted.append(_Doubted(until, since, places, late=True))

    def at(self, now_ns: int) -> list[SeenArm]:
        """The arm, and where it was before it jumped, if that is doubted; none before all was seen."""
        if self.missing:
            return []
        speeds, spreads, half = self._speeds()
        age = np.maximum((now_ns - self._seen_ns) / NANO, 0.0)
        arms = [SeenArm(self.side, self._places.copy(), age, speeds, spreads, half)]
        for doubted in [each for each in self._doubted if each.until_ns < now_ns]:
            self._doubted.remove(doubted)
        for doubted in self._doubted:
            age = np.maximum((now_ns - doubted.since_ns) / NANO, 0.0)
            arms.append(replace(arms[0], keypoints=doubted.keypoints, age_s=age).doubted())
        return arms

    def _speeds(self) -> tuple[FloatArray, FloatArray, float]:
        """Velocities through the newest samples, their spreads, and half of how long these take.

        A keypoint that was seen less than three times in that while has none: NaN, so that the assumed
        speed counts.

        Returns:
            (4, 3) [m/s], (4,) [1/s] and [s], see :func:`velocities`.
        """
        if not self.measures:
            return _UNKNOWN, _UNKNOWN[:, 0], 0.0
        speeds, spreads = np.empty((4, 3)), np.empty(4)
        half = velocities(self._ring_ns, self._ring, self._span, speeds, spreads)
        return speeds, spreads, half
