"""The arms of the bodies that are tracked, as motion capture says: where hands are, and how they move."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from hri_planner.policy.partner import Partner
from hri_planner.ros.bodies import BodyTopics
from hri_planner.ros.inputs import RobotInputs
from hri_planner.supervision.freshness import HeardPerson, worst_of
from hri_prediction.arm.geometry import KEYPOINTS
from hri_prediction.prediction.input_check import LATE
from hri_prediction.ros.conversions import check_finite, current_sample
from hri_prediction.ros.messages import HumanArm
from hri_prediction.ros.node import HriNode
from hri_prediction.ros.qos import SENSOR
from hri_prediction.ros.time import NANO
from hri_prediction.tracks.plausible import check_sample
from hri_prediction.tracks.track import ArmSample

FloatArray = NDArray[np.float64]

HAND_TIP = 3
VELOCITY_S = 0.048
"""Samples of so long give a hand's velocity [s]."""
REST_S = 0.192
"""An arm that has been at rest for so long is taken to rest [s]: samples of so long give its velocity."""
NOISE_M = 0.010
"""At rest a joint seems no farther than that from a line through its samples [m]: 5 sd of 2 mm."""
RESTING_M_S = 0.025
"""Nor is it faster [m/s]: more would hide one that sets out, less is noise of so many samples."""
FASTEST_HAND = 6.0
"""No hand is taken to be faster [m/s]."""
MARKER_M = 0.02
"""So much the place of a marker may jump [m]."""
BELIEVED_S = 0.06
"""A hand that has seemed to jump for so long is where it seems to be [s]."""
_LEAST_SAMPLES = 3
_NEVER_NS = -(1 << 62)


@dataclass(eq=False)
class TrackedArm:
    """One arm's newest samples.

    A joint that is not seen, or seems to jump, goes along with the hand as it was last seen beside it;
    when it is seen again, its speed is taken to be the hand's until samples say otherwise.
    """

    times_ns: deque[int] = field(default_factory=lambda: deque(maxlen=256))
    keypoints: deque[FloatArray] = field(default_factory=lambda: deque(maxlen=256))
    _seen_ns: list[int] = field(default_factory=lambda: [_NEVER_NS] * 4)

    def add(self, stamp_ns: int, keypoints: FloatArray) -> str:
        """Take a sample whose hand was seen; wild ones and those out of order say nothing.

        Args:
            stamp_ns: Capture time [ns].
            keypoints: Shoulder, elbow, wrist, hand tip (4, 3) [m]; NaN where not seen.

        Returns:
            What is wrong with it, and what becomes of that; empty: nothing.
        """
        said = ""
        if self.times_ns and stamp_ns <= self.times_ns[-1]:
            if stamp_ns > self.times_ns[-1] - NANO:
                return LATE  # an older sample says nothing new
            said = "the clock went back: it is looked at anew"
            self._clear()
        seen = [not np.isnan(place).any() for place in keypoints]
        wild = [seen[k] and self._is_wild(k, stamp_ns, keypoints[k]) for k in range(4)]
        if any(wild):
            names = [KEYPOINTS[k].replace("_", " ") for k in range(4) if wild[k]]
            said = f"jump: {', '.join(names)}; "
        if wild[HAND_TIP]:
            if stamp_ns - self.times_ns[-1] <= BELIEVED_S * NANO:
                return f"{said}not believed yet"
            said += f"believed now, after {BELIEVED_S:g} s"
            self._clear()
            wild = [False] * 4
        elif said.startswith("jump"):
            said += "the hand, which does not, tells where the arm is"
        hand = keypoints[HAND_TIP]
        # Never seen, so nobody knows: the hand, which is always seen here, stands in.
        beside = self.keypoints[-1] - self.keypoints[-1][HAND_TIP] if self.keypoints else 0.0
        known = np.tile(hand, (4, 1)) + beside
        for k in range(4):
            if not seen[k]:
                continue
            if wild[k] and stamp_ns - self._seen_ns[k] <= BELIEVED_S * NANO:
                continue
            if wild[k]:
                self._set_track(k, keypoints[k] - np.array(self.keypoints)[:, k])
            elif self.times_ns and self._seen_ns[k] != self.times_ns[-1]:
                # It was not there where it was thought to be, and has not moved from there to here.
                self._set_track(k, np.tile(keypoints[k] - known[k], (len(self.times_ns), 1)))
            known[k] = keypoints[k]
            self._seen_ns[k] = stamp_ns
        self.times_ns.append(stamp_ns)
        self.keypoints.append(known)
        while self.times_ns[0] < stamp_ns - round(REST_S * NANO):
            self.times_ns.popleft()
            self.keypoints.popleft()
        return said

    def _is_wild(self, k: int, stamp_ns: int, place: FloatArray) -> bool:
        """Whether no hand moves like that."""
        if not self.times_ns:
            return False
        # One that was never seen, or not for long, may be anywhere.
        seconds = (stamp_ns - self._seen_ns[k]) / NANO
        way = float(np.linalg.norm(place - self.keypoints[-1][k]))
        return way > FASTEST_HAND * seconds + MARKER_M

    def _set_track(self, k: int, by: FloatArray) -> None:
        """Put a joint elsewhere in all samples, by (n, 3) [m]: there it was, as is known now."""
        for index, earlier in enumerate(self.keypoints):
            changed = earlier.copy()  # the one before may be in use
            changed[k] += by[index]
            self.keypoints[index] = changed

    def _clear(self) -> None:
        self.times_ns.clear()
        self.keypoints.clear()
        self._seen_ns = [_NEVER_NS] * 4

    def partner(self, time_ns: int) -> Partner:
        """The arm at a time, extrapolated along lines fitted to the newest samples.

        It counts as old as the middle of these: the speed that they give is that of then. When too few are
        that new, older ones count too; of a single one, half of the longest time is its age.

        Of an arm at rest more samples give the speed: noise of a tenth of a metre a second would have the
        robot step back again and again. One that sets out at 4 m/s² is known as well as any other 80 ms
        later; till then it may be 0.15 m/s faster than age and bounds allow for, noise included, where it
        would else be 0.1.
        """
        places = self.keypoints[-1]
        t = (np.array(self.times_ns) - self.times_ns[-1]) / NANO
        history = np.array(self.keypoints)
        speeds, age = np.zeros((4, 3)), 0.5 * REST_S
        newest = t >= -VELOCITY_S - 1e-9
        newest[-_LEAST_SAMPLES:] = True
        if len(t) > 1:
            age = -float(t[newest].mean())
            at_rest = _resting_speeds(t, history)
            speeds = _slopes(t[newest], history[newest]) if at_rest is None else at_rest
        now = Partner(places[HAND_TIP], speeds[HAND_TIP], age, joints=places, speeds=speeds)
        return now.later((time_ns - self.times_ns[-1]) / NANO)


def _slopes(t: FloatArray, keypoints: FloatArray) -> FloatArray:
    """Of lines fitted to places (n, 4, 3) [m] at times (n,) [s]; (4, 3) [m/s]."""
    t = t - t.mean()
    found: FloatArray = np.tensordot(t, keypoints, 1) / float(t @ t)
    return found


def _resting_speeds(t: FloatArray, keypoints: FloatArray) -> FloatArray | None:
    """Velocities (4, 3) [m/s] of an arm that has been at rest all the time; none: it has not."""
    # Rates differ: what is known must reach back far enough, and with more samples than the short way.
    if t[0] > -0.9 * REST_S or len(t) < 3 * _LEAST_SAMPLES:
        return None
    speeds = _slopes(t, keypoints)
    off = keypoints - keypoints.mean(axis=0) - (t - t.mean())[:, None, None] * speeds
    at_rest = np.linalg.norm(speeds, axis=1).max() <= RESTING_M_S
    return speeds if at_rest and np.linalg.norm(off, axis=2).max() <= NOISE_M else None


@dataclass
class ArmInputs(RobotInputs):
    """Newest inputs of a node that hears motion capture itself."""

    what: ClassVar[str] = "arm"

    _arms: dict[str, dict[str, TrackedArm]] = field(default_factory=dict)

    def people_heard(self) -> dict[str, HeardPerson]:
        """From when the newest sample of each person's hand is; of both hands the older."""
        return {
            body_id: worst_of(HeardPerson(arm.times_ns[-1]) for arm in arms.values())
            for body_id, arms in self._arms.items()
        }

    def take(self, body_id: str, side: str, stamp_ns: int, keypoints: FloatArray) -> str:
        """Take a sample of an arm; one in which the hand is not seen counts as none.

        Args:
            body_id: Whose.
            side: Which of theirs, ``left`` or ``right``.
            stamp_ns: Capture time [ns].
            keypoints: Shoulder, elbow, wrist, hand tip (4, 3) [m]; NaN where not seen.

        Returns:
            What is wrong with it, as :meth:`TrackedArm.add`.
        """
        if not np.isfinite(keypoints[HAND_TIP]).all():
            return ""
        arms = self._arms.setdefault(body_id, {})
        return arms.setdefault(side, TrackedArm()).add(stamp_ns, keypoints)

    def forget(self) -> None:
        """Drop all that was heard, because its stamps mean nothing any more."""
        super().forget()
        self._arms.clear()

    def forget_body(self, body_id: str) -> None:
        """Drop what is known of a body."""
        self._arms.pop(body_id, None)

    def partners(self, time_ns: int) -> list[Partner]:
        """The arms of all tracked bodies, extrapolated to a time [ns]."""
        return [arm.partner(time_ns) for arm in self._tracked()]

    def arms_now(self) -> list[FloatArray]:
        """Keypoints (4, 3) [m] of each tracked arm, where they were seen last."""
        return [arm.keypoints[-1] for arm in self._tracked()]

    def newest_sample_ns(self) -> int:
        """Oldest among the newest samples of the tracked hands [ns]; 0 when nobody is tracked."""
        return min((arm.times_ns[-1] for arm in self._tracked()), default=0)

    def _tracked(self) -> Iterator[TrackedArm]:
        bodies = (self._arms.get(body_id, {}) for body_id in self.tracked or ())
        return (arm for arms in bodies for arm in arms.values())


class Arms(BodyTopics):
    """Arms of tracked bodies, as motion capture says.

    Args:
        node: As of :class:`BodyTopics`.
        inputs: What is known of them.
        max_future: So far ahead of the node's clock a stamp may be [s].
    """

    what, message, qos = "arm", HumanArm, SENSOR

    def __init__(self, node: HriNode, inputs: ArmInputs, max_future: float) -> None:
        super().__init__(node, inputs)
        self._inputs, self._max_future = inputs, max_future

    def take_one(self, body_id: str, message: HumanArm) -> None:
        """Take a sample."""
        self.take_sample(body_id, message)

    def take_sample(self, body_id: str, message: HumanArm) -> ArmSample:
        """Take a sample.

        What no arm can be is refused: whose it is goes on being where they were, and grows old, which
        stops the robot. What else is wrong with a sample is told.

        Returns:
            What it says.

        Raises:
            DataError: when it is refused.
        """
        sample = current_sample(message, self._node.tick_ns, self._max_future)
        check_sample(sample, body_id)
        said = self._inputs.take(body_id, sample.side, sample.stamp_ns, sample.keypoints)
        if said:
            self._node.fault("arm", f"the {sample.side} arm of {body_id}: {said}")
        check_finite(message)
        return sample
