"""People as the separation monitor knows them: where arms were seen last, and what is predicted of them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from hri_planner.ros.bodies import BodyTopics
from hri_planner.ros.conversions import check_side, forecast_from_message
from hri_planner.separation.config import BOTH, SEEN, ReleaseConfig
from hri_planner.separation.monitor import ArmPrediction
from hri_planner.separation.parts import SeenArm
from hri_planner.separation.track import ArmWatch
from hri_prediction.arm.geometry import KEYPOINTS, SIDES
from hri_prediction.beat import Beat
from hri_prediction.errors import DataError
from hri_prediction.ros.conversions import check_finite, sample_from_message
from hri_prediction.ros.messages import HumanArm, HumanPrediction
from hri_prediction.ros.node import HriNode
from hri_prediction.ros.qos import PREDICTIONS, SENSOR
from hri_prediction.ros.time import NANO, to_ns
from hri_prediction.tracked_lists import TrackedLists

FloatArray = NDArray[np.float64]
Near = Callable[[Sequence[SeenArm], FloatArray], bool]
"""Whether somebody is near the robot: their arms, and points (n, 3) [m] of arms that were seen in part."""
PUBLISHERS_NS = NANO
"""So often it is looked whether somebody sends those who are gone [ns]."""
ARM_LENGTH = 0.6
"""From shoulder to hand tip, about [m]: so far an arm that nobody sees may be ahead of what is seen."""


@dataclass
class People:
    """What was heard of people.

    Attributes:
        config: How old samples may be, and what is doubted.
        measures: Whether speeds are wanted.
        lists: Who is tracked, as all sources say.
        lost: Who was near the robot when they were seen last, or since, and is no longer listed.
    """

    config: ReleaseConfig
    measures: bool = True
    lists: TrackedLists = field(init=False)
    lost: dict[str, None] = field(default_factory=dict)
    _watches: dict[str, dict[str, ArmWatch]] = field(default_factory=dict)
    _predictions: dict[str, dict[str, HumanPrediction]] = field(default_factory=dict)
    _left: dict[str, int] = field(default_factory=dict)
    _were: dict[str, list[SeenArm]] = field(default_factory=dict)
    _near: dict[str, bool] = field(default_factory=dict)
    _fresh: set[str] = field(default_factory=set)
    _again: set[str] = field(default_factory=set)
    _now_ns: int = 0
    _back_ns: int = 0

    def __post_init__(self) -> None:
        """Begin with nobody."""
        self.lists = TrackedLists(self.config.max_list_age)

    @property
    def tracked(self) -> tuple[str, ...] | None:
        """Who is tracked; none while nobody has said so."""
        return self.lists.ids

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
        jumps, newest_ns = watch.jumps, watch.newest_ns
        watch.add(sample.stamp_ns, sample.keypoints)
        if watch.newest_ns != newest_ns:
            self._saw(message.body_id, now_ns)
        if watch.jumps != jumps:
            raise DataError(
                f"the {sample.side} arm of {message.body_id} jumps",
                expected=f"points slower than {self.config.plausible_speed:g} m/s",
                hint="swapped markers, or two sources of one body: it is reckoned with in both places "
                "for a while",
            )

    def _saw(self, body_id: str, now_ns: int) -> None:
        self._fresh.add(body_id)
        self._again.add(body_id)
        seen = {side for side, watch in self._watches[body_id].items() if not watch.missing}
        if were := [arm for arm in self._were.pop(body_id, []) if arm.side not in seen]:
            self._were[body_id] = were
        if body_id not in (self.tracked or ()):
            self._left.setdefault(body_id, now_ns)

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
        if body_id in self._watches or body_id in self._were:
            self._left.setdefault(body_id, self._now_ns)
        self._predictions.pop(body_id, None)

    def gone(self, now_ns: int, near: Near) -> list[str]:
        """Bodies that are not listed, and have not been seen for so long that they count as gone.

        They are forgotten. Who is not on the list, and is still seen, is there. Nor is somebody forgotten
        who was near the robot when they were seen last, or to whom it has come since: that they were lost
        is only over when they are listed and seen again.

        Args:
            now_ns: The time [ns].
            near: Whether somebody is near the robot.
        """
        self._now_ns = now_ns
        listed = self.tracked or ()
        for body_id in {**self._watches, **self._were}:
            if body_id not in listed:
                self._left.setdefault(body_id, now_ns)
        self._left = {
            body_id: min(left_ns, now_ns)  # the clock may have gone back
            for body_id, left_ns in self._left.items()
            if body_id not in listed
        }
        self._look_for_robot(now_ns, near)
        self.lost = {
            body_id: None
            for body_id in self.lost
            if not (body_id in listed and body_id in self._again)
        }
        leaving_ns = round(self.config.leaving_time * NANO)
        found = []
        for body_id, left_ns in list(self._left.items()):
            unseen = now_ns > max(left_ns, self._newest_ns(body_id)) + leaving_ns
            if not unseen or body_id in self.lost:
                continue
            if self._near.get(body_id):
                self.lost[body_id] = None
                self._again.discard(body_id)
            else:
                self._drop(body_id)
                found.append(body_id)
        return found

    def _look_for_robot(self, now_ns: int, near: Near) -> None:
        """Find out who is near the robot, of those who are not listed, or not seen since the last look."""
        listed = self.tracked or ()
        for body_id in {**self._watches, **self._were}:
            fresh = body_id in self._fresh
            if fresh and body_id in listed:
                self._near.pop(body_id, None)
            elif fresh or not self._near.get(body_id):
                watches = self._watches.get(body_id, {}).values()
                places = [watch.places for watch in watches if watch.missing]
                points = np.concatenate(places) if places else np.empty((0, 3))
                points = points[~np.isnan(points[:, 0])]
                self._near[body_id] = near(self._arms_of(body_id, now_ns), points)
        self._fresh.clear()

    def _drop(self, body_id: str) -> None:
        del self._left[body_id]
        self._again.discard(body_id)
        for known in (self._watches, self._were, self._near):
            known.pop(body_id, None)

    def knows(self, body_id: str) -> bool:
        """Whether a body is listed, or reckoned with."""
        return body_id in (self.tracked or ()) or body_id in self._left

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

    def forget(self, now_ns: int) -> None:
        """The clock went back: stamps of what was seen mean nothing any more, places and ages do.

        Args:
            now_ns: What time it is now [ns]; from then on who was seen before grows older.
        """
        for body_id, watches in self._watches.items():
            if arms := [arm.doubted() for arm in self._arms_of(body_id, self._now_ns)]:
                self._were[body_id] = arms
            if any(watch.missing for watch in watches.values()):
                self._near[body_id] = True
        for body_id in self._were.keys() - self._watches.keys():
            self._were[body_id] = self._as_they_were(body_id, self._now_ns)
        self._back_ns = self._now_ns = now_ns
        self._fresh.clear()
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
            if body_id not in self._watches:
                return f"no arm of {body_id} yet"
            if unseen := self._unseen(body_id, now_ns):
                return unseen
        for body_id in self._left:
            # One that is no longer seen is leaving; but so far all of them is to have been seen.
            if unseen := self._unseen(body_id, self._newest_ns(body_id)):
                return unseen
        for body_id in self.lost:
            return f"{body_id} was lost beside the robot, and is no longer listed"
        return self.lists.trouble(now_ns) if self.config.require_tracking else ""

    def _unseen(self, body_id: str, time_ns: int) -> str:
        """What was not seen of somebody by then [ns], of whom something was; empty when all was."""
        arms = self._watches.get(body_id, {})
        unheard = [side for side in SIDES if side not in arms]
        if arms and unheard and self.config.arms == BOTH:
            return f"the {unheard[0]} arm of {body_id} was never seen (arms:=seen does without)"
        for side, watch in arms.items():
            if watch.newest_ns is None or watch.missing:
                unseen = " and ".join(KEYPOINTS[k].replace("_", " ") for k in watch.missing)
                return f"the {unseen} of {body_id}'s {side} arm was never seen"
            age = (time_ns - watch.newest_ns) / NANO
            if age > self.config.max_sample_age:
                return f"the {side} arm of {body_id} was last seen {_ago(age)}"
        return ""

    def arms(self, now_ns: int) -> dict[str, list[SeenArm]]:
        """The arms of everybody who is tracked, or was until a while ago, by body id."""
        self._now_ns = now_ns
        found = {
            body_id: self._arms_of(body_id, now_ns) for body_id in {**self._watches, **self._were}
        }
        listed = self.tracked or ()
        return {body_id: arms for body_id, arms in found.items() if arms or body_id in listed}

    def _arms_of(self, body_id: str, now_ns: int) -> list[SeenArm]:
        """The arms of somebody; doubted, where they are not listed or were seen by another clock."""
        watches = self._watches.get(body_id, {})
        arms = [arm for watch in watches.values() for arm in watch.at(now_ns)]
        if body_id not in (self.tracked or ()):
            arms = [arm.doubted() for arm in arms]
        return arms + self._as_they_were(body_id, now_ns)

    def _as_they_were(self, body_id: str, now_ns: int) -> list[SeenArm]:
        """The arms that somebody had before the clock went back, and that were not seen since."""
        since_s = max(now_ns - self._back_ns, 0) / NANO
        return [replace(arm, age_s=arm.age_s + since_s) for arm in self._were.get(body_id, [])]

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
    """Arms of tracked bodies, as motion capture says.

    Args:
        node: Subscribes.
        people: Get the samples.
        near: Whether somebody is near the robot.
    """

    what, message, qos = "arm", HumanArm, SENSOR

    def __init__(self, node: HriNode, people: People, near: Near) -> None:
        super().__init__(node, people)
        self._people, self._near = people, near
        self._beat = Beat(PUBLISHERS_NS)

    def take_one(self, body_id: str, message: HumanArm) -> None:
        """Take a sample."""
        self._people.take_arm(message, self._node.tick_ns)
        check_finite(message)

    def leave(self, body_id: str) -> None:
        """Nobody lists the body any more; it is listened to as long as somebody may send it."""
        self._people.forget_body(body_id)

    def look(self, now_ns: int) -> None:
        """Listen no longer to who is gone and whom nobody sends: who is sent may come back into sight."""
        self._people.gone(now_ns, self._near)
        if not self._beat.due(now_ns):
            return
        for body_id in [known for known in self._topics if not self._people.knows(known)]:
            if not self._node.count_publishers(
                self._node.resolve_topic_name(self._topics[body_id])
            ):
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
