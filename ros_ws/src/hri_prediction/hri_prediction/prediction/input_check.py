"""What may enter the predictor: faults of motion capture are named and kept out.

Lost markers, jumps, exchanged markers and clocks that go back each have a name in
:attr:`InputCheck.counters`, so that a diagnostic can say why a prediction is invalid.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hri_prediction.prediction.config import PredictorConfig
from hri_prediction.tracks.track import ArmSample

Array = NDArray[np.float64]
_NAMES = ("shoulder", "elbow", "wrist", "hand tip")
_SWAPS = [p for p in itertools.permutations(range(3)) if p != (0, 1, 2)]
_LENGTH_SAMPLES = 50
_SWAPPED = "markers swapped"
LATE = "late or repeated sample"
TOLD = {
    LATE: LATE,
    "clock went back": "stamps went back",
    "side changed": "side changed",
    _SWAPPED: _SWAPPED,
    "jump": "jump of a marker",
    "implausible length": "implausible length",
}
"""What is told of a sample that could not be used as it came, by the name of its counter; markers that are
hidden for a moment are everyday, and are told when the arm has not been seen for long."""
_SWAP_MEMORY_NS = 1_000_000_000
"""Markers that stay exchanged for longer than this are believed, if their lengths fit."""


@dataclass(frozen=True)
class Verdict:
    """What of a sample may be used.

    Args:
        usable: (4,) bool, keypoints that may be used.
        restart: Everything before this sample must be forgotten.
        reason: What is wrong, empty if nothing is.
    """

    usable: NDArray[np.bool_]
    restart: bool = False
    reason: str = ""


class InputCheck:
    """Checks each sample against the ones before it.

    Args:
        config: Limits.
        upper_arm_m: Expected shoulder-elbow length until this person's is known; 0 = no idea.
        forearm_m: Expected elbow-wrist length.
        counters: Where faults are counted by their names; none: in a dictionary of its own.
    """

    def __init__(
        self,
        config: PredictorConfig,
        upper_arm_m: float = 0.0,
        forearm_m: float = 0.0,
        counters: dict[str, int] | None = None,
    ) -> None:
        self._config = config
        self._expected = (upper_arm_m, forearm_m)
        self.counters = {} if counters is None else counters
        self.reset()

    def reset(self) -> None:
        """Forget the person; counters stay."""
        self._stamp: int | None = None
        self._side = ""
        self._last: list[tuple[float, ...] | None] = [None] * 4
        self._last_ns = [0] * 4
        self._lengths: list[tuple[float, float]] = []
        self._own: tuple[float, float] | None = None
        self._swapped_ns = self._swap_began_ns = -_SWAP_MEMORY_NS
        self._exchanged = False

    def check(self, sample: ArmSample) -> Verdict:
        """Judge one sample and remember what may be used of it."""
        restart, reason = False, ""
        if self._stamp is not None:
            step = (sample.stamp_ns - self._stamp) * 1e-9
            if sample.side != self._side:
                restart, reason = True, f"side changed to {sample.side}"
                self._count("side changed")
            elif step <= 0.0:
                if step > -self._config.stale_time:
                    self._count(LATE)
                    return Verdict(np.zeros(4, dtype=bool), reason=LATE)
                restart, reason = True, f"the clock went back by {-step:.3f} s"
                self._count("clock went back")
        if restart:
            self.reset()
        self._stamp, self._side = sample.stamp_ns, sample.side
        points: list[tuple[float, ...]] = [tuple(p) for p in sample.keypoints.tolist()]
        usable = [
            bool(v) and all(map(math.isfinite, p))
            for v, p in zip(sample.valid.tolist(), points, strict=True)
        ]
        held = self._exchanged and sample.stamp_ns - self._swap_began_ns >= _SWAP_MEMORY_NS
        if held:
            # Nobody can tell an arm that turned round unseen from labels that stay exchanged.
            self._last = [None] * 4
        fault = self._fault(sample.stamp_ns, points, usable)
        self._exchanged = fault == _SWAPPED
        if held and not fault:
            restart, reason = True, "markers seemed swapped for 1 s and are believed now"
            self._count("swapped markers believed")
        if fault:
            self._count(fault.split(":")[0])
        for i in range(4):
            if usable[i]:
                self._last[i], self._last_ns[i] = points[i], sample.stamp_ns
        if not fault and all(usable[:3]):
            self._learn_lengths(points)
        return Verdict(np.array(usable), restart, reason or fault)

    def _fault(self, stamp_ns: int, points: list[tuple[float, ...]], usable: list[bool]) -> str:
        """Name of the fault, with ``usable`` reduced to what can be trusted."""
        missing = [name for name, ok in zip(_NAMES, usable, strict=True) if not ok]
        if len(missing) == 4:
            return "not seen"
        swapped = self._swapped(points, usable)
        if swapped:
            usable[:] = [False] * 4
            return _SWAPPED
        jumped = [i for i in range(4) if usable[i] and self._jumped(stamp_ns, i, points[i])]
        for i in jumped:
            usable[i] = False
        if jumped:
            return "jump: " + ", ".join(_NAMES[i] for i in jumped)
        wrong = self._implausible(points, usable)
        if wrong:
            usable[:] = [False] * 4
            return wrong
        if missing and missing != [_NAMES[3]]:
            return "not seen: " + ", ".join(missing)
        return ""

    def _limit(self, elapsed: float) -> float:
        return self._config.max_speed * elapsed + self._config.jump_allowance

    def _jumped(self, stamp_ns: int, keypoint: int, point: tuple[float, ...]) -> bool:
        last = self._last[keypoint]
        elapsed = (stamp_ns - self._last_ns[keypoint]) * 1e-9
        # After a pause nobody knows where the marker went; it is believed again.
        if last is None or elapsed > self._config.stale_time:
            return False
        return math.dist(point, last) > self._limit(elapsed)

    def _swapped(self, points: list[tuple[float, ...]], usable: list[bool]) -> bool:
        """Whether shoulder, elbow, wrist continue where *others* of them were last seen.

        To tell that they were exchanged all three must be seen; that they still are, any of them tells.
        """
        known = [p for p in self._last[:3] if p is not None]
        seen = [i for i in range(3) if usable[i]]
        if self._stamp is None or not seen or len(known) < 3:
            return False
        # Exchanged markers stay exchanged: compare for longer than a jump is remembered.
        if self._stamp - max(self._last_ns[:3]) > _SWAP_MEMORY_NS:
            return False
        lasting = self._stamp - self._swapped_ns <= _SWAP_MEMORY_NS
        if len(seen) < 3 and not lasting:
            return False
        stay = sum(math.dist(points[i], known[i]) for i in seen)
        if stay < len(seen) * self._config.jump_allowance:
            return False
        # While it lasts, how far a marker can have come since it was seen does not speak against it.
        free = [
            self._limit((self._stamp - since_ns) * 1e-9) if lasting else 0.0
            for since_ns in self._last_ns[:3]
        ]

        def left(places: tuple[int, ...]) -> float:
            far = (math.dist(points[i], known[places[i]]) - free[places[i]] for i in seen)
            return sum(max(distance, 0.0) for distance in far)

        best, swap = min((left(places), places) for places in _SWAPS)
        if best >= 0.3 * stay:
            return False
        if not lasting:
            self._swap_began_ns = self._stamp
        self._swapped_ns = self._stamp
        for i in seen:
            # Where each marker really is: a moving arm would else drift away from what is compared.
            self._last[swap[i]], self._last_ns[swap[i]] = points[i], self._stamp
        return True

    def _implausible(self, points: list[tuple[float, ...]], usable: list[bool]) -> str:
        expected = self._own or self._expected
        tolerance = self._config.length_tolerance
        for (a, b), length in zip(((0, 1), (1, 2)), expected, strict=True):
            if length > 0.0 and usable[a] and usable[b]:
                found = math.dist(points[a], points[b])
                if abs(found - length) > tolerance * length:
                    return (
                        f"implausible length: {_NAMES[a]}-{_NAMES[b]} {found:.3f} m, "
                        f"expected {length:.3f} m"
                    )
        if usable[0] and usable[2] and math.dist(points[0], points[2]) > self._config.max_reach:
            return "implausible length: shoulder-wrist"
        return ""

    def _learn_lengths(self, points: list[tuple[float, ...]]) -> None:
        if self._own is not None:
            return
        self._lengths.append((math.dist(points[0], points[1]), math.dist(points[1], points[2])))
        if len(self._lengths) >= _LENGTH_SAMPLES:
            upper, fore = np.median(np.array(self._lengths), axis=0)
            self._own = (float(upper), float(fore))

    def _count(self, name: str) -> None:
        self.counters[name] = self.counters.get(name, 0) + 1
