"""People as the separation monitor knows them: where arms were seen last, and what is predicted of them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from hri_planner.ros.bodies import BodyTopics
from hri_planner.ros.conversions import check_side, forecast_from_message
from hri_planner.separation.config import BOTH, SEEN, ReleaseConfig
from hri_planner.separation.monitor import ArmPrediction
from hri_planner.separation.parts import SeenArm
from hri_planner.separation.track import ArmWatch
from hri_prediction.arm.geometry import KEYPOINTS, SIDES
from hri_prediction.errors import DataError
from hri_prediction.ros.conversions import check_finite, sample_from_message
from hri_prediction.ros.messages import HumanArm, HumanPrediction
from hri_prediction.ros.node import HriNode
from hri_prediction.ros.qos import PREDICTIONS, SENSOR
from hri_prediction.ros.time import NANO, to_ns

FloatArray = NDArray[np.float64]
ARM_LENGTH = 0.6
"""From shoulder to hand tip, about [m]: so far an arm that nobody sees may be ahead of what is seen."""


@dataclass
class People:
    """What was heard of people.

    Attributes:
        config: How old samples may be, and what is doubted.
        measures: Whether speeds are wanted.
        tracked: Who is tracked; none while nobody has said so.
    """

    config: ReleaseConfig
    measures: bool = True
    tracked: tuple[str, ...] | None = None
    _watches: dict[str, dict[str, ArmWatch]] = field(default_factory=dict)
    _predictions: dict[str, dict[str, HumanPrediction]] = field(default_factory=dict)
    _left: dict[str, int] = field(default_factory=dict)
    _now_ns: int = 0

    def take_arm(self, message: HumanArm, now_ns: int) -> None:
        """Take a sample.

        Raises:
            DataError: when it cannot be used, and the arm stays where it was and grows old; or when it is
                taken, but the arm jumps.
        """
        sample = sample_from_message(message)
        ahead = (sample.stamp_ns - now_ns) / NANO
        if ahead > self.config.max_future:
            raise DataError(
                f"a sample of {message.body_id} is stamped {ahead:.3f} s in the future",
                hint="are the clocks of capture and of this machine the same?",
            )
        arms = self._watches.setdefault(message.body_id, {})
        watch = arms.setdefault(sample.side, ArmWatch(sample.side, self.config, self.measures))
        jumps = watch.jumps
        watch.add(sample.stamp_ns, sample.keypoints)
        if watch.jumps != jumps:
            raise DataError(
                f"the {sample.side} arm of {message.body_id} jumps",
                expected=f"points slower than {self.config.plausible_speed:g} m/s",
                hint="swapped markers, or two sources of one body: it is reckoned with in both places "
                "for a while",
            )

    def take_prediction(self, message: HumanPrediction, radii: FloatArray) -> None:
        """Take what is predicted of one of a body's arms; an invalid prediction is none.

        Raises:
            DataError: when it cannot be used; then there is none of that arm.
        """
        arms = self._predictions.setdefault(message.body_id, {})
        arms.pop(message.side, None)
        check_side(message)
        if message.state != HumanPrediction.INVALID:
            forecast_from_message(message, 0, radii)  # checks it
            arms[message.side] = message

    def forget_body(self, body_id: str) -> None:
        """A body is no longer listed; it is reckoned with until it has not been seen for a while."""
        self._left.setdefault(body_id, self._now_ns)
        self._predictions.pop(body_id, None)

    def gone(self, now_ns: int) -> list[str]:
        """Bodies that are not listed, and have not been seen for so long that they count as gone.

        They are forgotten. Who is not on the list, and is still seen, is there: the list may be that of
        another source, which knows nothing of them.
        """
        self._now_ns = now_ns
        listed = self.tracked or ()
        self._left = {
            body_id: min(left_ns, now_ns)  # the clock may have gone back
            for body_id, left_ns in self._left.items()
            if body_id not in listed
        }
        leaving_ns = round(self.config.leaving_time * NANO)
        found = [
            body_id
            for body_id, left_ns in self._left.items()
            if now_ns > max(left_ns, self._newest_ns(body_id)) + leaving_ns
        ]
        for body_id in found:
            del self._left[body_id]
            self._watches.pop(body_id, None)
        return found

    def unlisted(self, now_ns: int) -> list[str]:
        """Bodies that are not listed and still seen."""
        oldest_ns = now_ns - round(self.config.max_sample_age * NANO)
        return [
            body_id
            for body_id, left_ns in self._left.items()
            if self._newest_ns(body_id) > max(oldest_ns, left_ns)
        ]

    def _newest_ns(self, body_id: str) -> int:
        arms = self._watches.get(body_id, {}).values()
        return max((watch.newest_ns or 0 for watch in arms), default=0)

    def forget(self) -> None:
        """Drop all that was seen, because its stamps mean nothing any more."""
        self._watches.clear()
        self._predictions.clear()

    @property
    def jumps(self) -> int:
        """Of all arms that are known."""
        return sum(watch.jumps for arms in self._watches.values() for watch in arms.values())

    def trouble(self, now_ns: int) -> str:
        """Why nobody knows where people are; empty when that is known."""
        if self.tracked is None:
            return "nothing says who is tracked" if self.config.require_tracking else ""
        for body_id in self.tracked:
            arms = self._watches.get(body_id, {})
            if not arms:
                return f"no arm of {body_id} yet"
            unheard = [side for side in SIDES if side not in arms]
            if unheard and self.config.arms == BOTH:
                return f"the {unheard[0]} arm of {body_id} was never seen (arms:=seen does without)"
            for side, watch in arms.items():
                if watch.newest_ns is None or watch.missing:
                    unseen = " and ".join(KEYPOINTS[k].replace("_", " ") for k in watch.missing)
                    return f"the {unseen} of {body_id}'s {side} arm was never seen"
                age = (now_ns - watch.newest_ns) / NANO
                if age > self.config.max_sample_age:
                    return f"the {side} arm of {body_id} was last seen {_ago(age)}"
        return ""

    def arms(self, now_ns: int) -> dict[str, list[SeenArm]]:
        """The arms of everybody who is tracked, or was until a while ago, by body id."""
        self._now_ns = now_ns
        found = {}
        for body_id, watches in self._watches.items():
            arms = [arm for watch in watches.values() for arm in watch.at(now_ns)]
            if body_id in (self.tracked or ()):
                found[body_id] = arms
            elif arms:
                found[body_id] = [arm.doubted() for arm in arms]
        return found

    def predictions(self, now_ns: int) -> Mapping[tuple[str, str], ArmPrediction]:
        """What is predicted, by body id and side; of a dead predictor nothing."""
        found = {}
        for message in (each for arms in self._predictions.values() for each in arms.values()):
            count = len(message.times)
            age = (now_ns - to_ns(message.header.stamp)) / NANO
            if not -self.config.max_future <= age <= self.config.max_prediction_age:
                continue
            found[message.body_id, message.side] = ArmPrediction(
                age,
                np.asarray(message.times, dtype=float),
                np.asarray(message.mean, dtype=float).reshape(count, 4, 3),
                np.asarray(message.covariance, dtype=float).reshape(count, 4, 3, 3),
            )
        return found


def unseen_arms(release: ReleaseConfig, intrusion: float) -> str:
    """What to know of people one of whose arms is not tracked; empty when it is reckoned with.

    Args:
        release: Whether such people are waited for.
        intrusion: What is reckoned with ahead of what is tracked [m].
    """
    if release.arms != SEEN or intrusion >= ARM_LENGTH:
        return ""
    return (
        f"arms: {release.arms} with intrusion: {intrusion:g} m: an arm that is not tracked is not reckoned "
        f"with. For people who have one set arms: {BOTH} and track it, or intrusion: {ARM_LENGTH:g}"
    )


def _ago(seconds: float) -> str:
    """How long ago, coarsely enough to be the same text for a while."""
    return f"{math.floor(seconds * 10.0) / 10.0:.1f} s ago" if seconds >= 0.1 else "just before"


class WatchedArms(BodyTopics):
    """Arms of tracked bodies, as motion capture says."""

    what, message, qos = "arm", HumanArm, SENSOR

    def __init__(self, node: HriNode, people: People) -> None:
        super().__init__(node, people)
        self._people = people

    def take_one(self, body_id: str, message: HumanArm) -> None:
        """Take a sample."""
        self._people.take_arm(message, self._node.tick_ns)
        check_finite(message)

    def leave(self, body_id: str) -> None:
        """Nobody lists the body any more; it is listened to until it is gone."""
        self._people.forget_body(body_id)

    def look(self, now_ns: int) -> None:
        """Listen no longer to who is gone."""
        for body_id in self._people.gone(now_ns):
            if body_id in self._topics:
                self.unsubscribe(body_id)


class WatchedPredictions(BodyTopics):
    """Predictions of tracked bodies.

    Args:
        node: Subscribes.
        people: Get the predictions.
        radii: Of upper arm, forearm and hand (3,) [m].
    """

    what, message, qos = "prediction", HumanPrediction, PREDICTIONS

    def __init__(self, node: HriNode, people: People, radii: FloatArray) -> None:
        super().__init__(node, people)
        self._people, self._radii = people, radii

    def take_one(self, body_id: str, message: HumanPrediction) -> None:
        """Take a prediction."""
        self._people.take_prediction(message, self._radii)
