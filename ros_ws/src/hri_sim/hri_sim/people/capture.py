"""What is published of simulated people over time: truth ahead, captures, late deliveries."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from hri_prediction.arm.geometry import FloatArray
from hri_prediction.tracks.track import ArmSample
from hri_sim.people.tracking import SAMPLE_PERIOD_NS, TrackingModel

TRUTH_LEAD_NS = 2 * SAMPLE_PERIOD_NS
"""The truth is said this much ahead [ns], so that the simulator has it when its clock gets there."""
MAX_CATCH_UP = 50
"""Captures that a late tick makes up for; older ones are skipped."""


@dataclass(eq=False)
class CapturedArm:
    """One arm of a person under motion capture.

    Attributes:
        truth: Keypoints (4, 3) [m] at a time [s], which is asked for in the order of time.
        side: Which of the person's it is.
        tracking: What motion capture makes of the truth.
        ahead: Truth that was said and is still to be captured, by stamp [ns].
        pending: Samples on their way, with the time of their delivery [ns].
    """

    truth: Callable[[float], FloatArray]
    side: str
    tracking: TrackingModel
    ahead: dict[int, FloatArray] = field(default_factory=dict)
    pending: deque[tuple[int, ArmSample]] = field(default_factory=deque)


class Capture:
    """Captures of some people at 250 Hz, their stamps multiples of 4 ms.

    Args:
        bodies: Their arms by body id.
        now_ns: When it begins.
    """

    def __init__(self, bodies: Mapping[str, Sequence[CapturedArm]], now_ns: int) -> None:
        self._arms = [(body_id, arm) for body_id, arms in bodies.items() for arm in arms]
        # Floats hold times from the first capture, not from 1970: they keep their precision.
        self._origin_ns = now_ns // SAMPLE_PERIOD_NS * SAMPLE_PERIOD_NS
        self._next_truth_ns = self._next_capture_ns = self._origin_ns + SAMPLE_PERIOD_NS

    def seconds(self, stamp_ns: int) -> float:
        """Time of the people at a stamp [s]."""
        return (stamp_ns - self._origin_ns) / 1e9

    def skip(self, now_ns: int) -> int:
        """Leave captures out that are too late to be made up for: how many."""
        behind = (now_ns - self._next_capture_ns) // SAMPLE_PERIOD_NS
        if behind <= MAX_CATCH_UP:
            return 0
        for _, arm in self._arms:
            arm.ahead.clear()
        self._next_capture_ns += behind * SAMPLE_PERIOD_NS
        self._next_truth_ns = max(self._next_truth_ns, self._next_capture_ns)
        return behind

    def truth(self, now_ns: int) -> Iterator[tuple[str, ArmSample]]:
        """The truth that is to be said by now."""
        while self._next_truth_ns <= now_ns + TRUTH_LEAD_NS:
            stamp = self._next_truth_ns
            for body_id, arm in self._arms:
                keypoints = arm.truth(self.seconds(stamp))
                arm.ahead[stamp] = keypoints
                yield body_id, ArmSample(stamp, keypoints, np.ones(4, dtype=bool), arm.side)
            self._next_truth_ns += SAMPLE_PERIOD_NS

    def tracked(self, now_ns: int) -> Iterator[tuple[str, ArmSample]]:
        """Capture what there is to be captured by now, and deliver what latency has let through."""
        while self._next_capture_ns <= now_ns:
            for _, arm in self._arms:
                self._observe(arm, self._next_capture_ns)
            self._next_capture_ns += SAMPLE_PERIOD_NS
        for body_id, arm in self._arms:
            while arm.pending and arm.pending[0][0] <= now_ns:
                yield body_id, arm.pending.popleft()[1]

    def _observe(self, arm: CapturedArm, stamp_ns: int) -> None:
        # Said a moment ago as the truth; computed anew only where captures were skipped.
        keypoints = arm.ahead.pop(stamp_ns, None)
        if keypoints is None:
            keypoints = arm.truth(self.seconds(stamp_ns))
        tracked = arm.tracking.observe(stamp_ns, keypoints)
        arm.pending.append((tracked.delivery_ns, tracked.sample))
