"""What the monitor makes of who is heard of: arms that are missing, people who leave."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest
from std_msgs.msg import Header

from hri_planner.ros.people import Near, People, WatchedArms, unseen_arms
from hri_planner.separation.config import BOTH, SEEN, BodyConfig, ReleaseConfig
from hri_planner.separation.parts import SeenArm, parts_of
from hri_prediction.errors import DataError
from hri_prediction.ros.messages import HumanArm, HumanPrediction, IdsList
from hri_prediction.ros.time import to_time

ARM = np.array([[0.9, 0.2, 0.4], [0.85, 0.2, 0.12], [0.6, 0.2, 0.1], [0.5, 0.2, 0.1]])
MS = 1_000_000


def arm(stamp_ms: int, side: str = "right", beside: float = 0.0) -> HumanArm:
    return HumanArm(
        header=Header(stamp=to_time(stamp_ms * MS), frame_id="world"),
        body_id="ann",
        side=side,
        keypoints=(ARM + np.array([0.0, beside, 0.0])).ravel(),
        valid=[True] * 4,
    )


def far(_: Sequence[SeenArm], __: np.ndarray) -> bool:
    return False


def beside(_: Sequence[SeenArm], __: np.ndarray) -> bool:
    return True


def people(arms: str = SEEN) -> People:
    made = People(ReleaseConfig(arms=arms))
    made.lists.heard(0, ["ann"], 104 * MS)
    made.take_arm(arm(100), 104 * MS)
    return made


def unlist(made: People, now_ms: int, *others: str) -> None:
    """The only source no longer lists ann."""
    made.lists.heard(now_ms, others, now_ms * MS)
    for step in range(1, 4):
        made.lists.heard(now_ms, others, (now_ms + 24 * step) * MS)
    assert made.tracked == others
    made.forget_body("ann")


@pytest.mark.parametrize(("arms", "trouble"), [(SEEN, ""), (BOTH, "the left arm of ann was never")])
def test_a_second_arm_is_waited_for_unless_one_will_do(arms: str, trouble: str) -> None:
    made = people(arms)
    assert made.trouble(104 * MS).startswith(trouble)
    assert bool(made.trouble(104 * MS)) == bool(trouble)
    made.take_arm(arm(104, "left"), 108 * MS)
    assert made.trouble(108 * MS) == ""


def test_who_leaves_the_list_is_reckoned_with_a_while() -> None:
    made = people()
    (seen,) = made.arms(104 * MS)["ann"]
    assert not seen.was
    unlist(made, 240)
    assert made.gone(304 * MS, far) == []
    (gone,) = made.arms(304 * MS)["ann"]
    assert gone.was
    np.testing.assert_array_equal(gone.keypoints, ARM)
    np.testing.assert_allclose(gone.age_s, 0.204)
    assert np.isnan(gone.speeds).all()  # as fast as is assumed
    assert made.trouble(304 * MS) == ""
    assert made.gone(605 * MS, far) == ["ann"]
    assert made.arms(605 * MS) == {}


LOST = "ann was lost beside the robot, and is no longer listed"


def lose(made: People, near: Near = beside) -> None:
    """Ann is not listed, nor seen, until 4992 ms."""
    made.gone(104 * MS, near)
    unlist(made, 104)
    for now_ms in range(112, 5000, 8):
        made.lists.heard(104, (), now_ms * MS)
        assert made.gone(now_ms * MS, near) == []


def test_who_was_near_the_robot_is_not_forgotten() -> None:
    made = people()
    lose(made)
    assert made.trouble(4992 * MS) == LOST
    (lost,) = made.arms(4992 * MS)["ann"]
    assert lost.was
    # Somebody says that they are there, and they are seen: as before.
    made.lists.heard(4996 * MS, ["ann"], 4996 * MS)
    made.gone(4996 * MS, far)
    made.lists.heard(104, (), 4996 * MS)
    assert list(made.lost) == ["ann"]
    made.take_arm(arm(4992), 4996 * MS)
    assert made.gone(5000 * MS, beside) == []
    assert made.trouble(5000 * MS) == ""
    assert not made.lost


def test_who_was_lost_stays_so_though_the_robot_goes_away() -> None:
    made = people()
    lose(made)
    assert made.gone(5000 * MS, far) == []
    assert made.trouble(5000 * MS).startswith("ann was lost")
    # They are seen, and not listed: there, and not known to be followed.
    made.take_arm(arm(5004), 5004 * MS)
    made.gone(5008 * MS, far)
    made.lists.heard(104, (), 5008 * MS)
    assert made.trouble(5008 * MS) == LOST
    assert made.gone(9000 * MS, far) == []


def test_the_robot_that_comes_by_once_is_enough() -> None:
    """It was near while they were not seen, and is not when they count as lost."""
    made = people()
    passes = iter([False] * 20 + [True] + [False] * 1000)
    lose(made, lambda arms, points: next(passes))
    assert made.trouble(4992 * MS) == LOST


@pytest.mark.parametrize("step_ms", [-10, -3_000])
def test_who_was_lost_stays_so_though_the_clock_goes_back(step_ms: int) -> None:
    made = people()
    lose(made)
    made.forget((5000 + step_ms) * MS)
    for now_ms in range(5000 + step_ms, 9000, 8):
        made.lists.heard(104, (), now_ms * MS)
        assert made.gone(now_ms * MS, far) == []
    assert made.trouble(8992 * MS) == LOST
    (lost,) = made.arms(8992 * MS)["ann"]
    np.testing.assert_array_equal(lost.keypoints, ARM)


@pytest.mark.parametrize("listed", [True, False])
def test_who_is_lost_while_the_clock_goes_back_is_known(listed: bool) -> None:
    made = people()
    made.gone(104 * MS, beside)
    made.gone(112 * MS, beside)
    if not listed:
        unlist(made, 104)
    made.forget(60 * MS)
    made.gone(60 * MS, far)
    if listed:
        unlist(made, 60)
    for now_ms in range(124, 5000, 8):
        made.lists.heard(60 if listed else 104, (), now_ms * MS)
        assert made.gone(now_ms * MS, far) == []
    assert made.trouble(4992 * MS) == LOST


def test_trunk_and_what_is_seen_of_an_arm_count_for_being_near() -> None:
    made, told = people(), []
    message = arm(104, "left")
    message.valid = [True, False, False, False]
    made.take_arm(message, 104 * MS)

    def near(arms: Sequence[SeenArm], points: np.ndarray) -> bool:
        told.append(([each.side for each in arms], points.tolist()))
        return False

    made.gone(104 * MS, near)
    made.gone(112 * MS, near)
    assert told == [(["right"], [ARM[0].tolist()])]


def test_a_list_that_nobody_says_any_longer_is_none() -> None:
    made = people()
    unlist(made, 128)
    assert made.trouble(320 * MS) == ""
    assert made.trouble(321 * MS) == "nothing says any longer who is tracked"
    made.lists.heard(128, (), 321 * MS)
    assert made.trouble(328 * MS) == ""
    unwatched = People(ReleaseConfig(arms=SEEN, require_tracking=False))
    unwatched.lists.heard(0, (), 0)
    assert unwatched.trouble(10_000 * MS) == ""


def test_one_source_of_two_that_dies_is_missed() -> None:
    made = People(ReleaseConfig())
    for now_ms in range(0, 1000, 40):
        made.lists.heard(1, (), now_ms * MS)
        if now_ms < 400:
            made.lists.heard(2, (), now_ms * MS)
    assert made.trouble(960 * MS) == "a source no longer says who is tracked (it listed nobody)"
    made.lists.heard(3, (), 960 * MS)
    assert made.trouble(960 * MS) == ""


def test_who_leaves_has_trunk_and_head_all_the_while() -> None:
    made = people(BOTH)
    made.take_arm(arm(100, "left", 0.4), 104 * MS)
    before = parts_of("ann", made.arms(104 * MS)["ann"], BodyConfig())
    unlist(made, 104)
    after = parts_of("ann", made.arms(304 * MS)["ann"], BodyConfig())
    assert [part.name for part in after] == [f"{part.name} (as it was)" for part in before]
    for one, other in zip(before, after, strict=True):
        np.testing.assert_array_equal(one.ends, other.ends)
        assert (one.radius, one.arm) == (other.radius, other.arm)
        assert (other.age_s >= 0.2).all()


def test_who_is_not_listed_and_still_seen_is_there() -> None:
    """The list may be that of a second source, which knows nothing of them."""
    made = people()
    unlist(made, 104, "bob")
    for stamp_ms in range(104, 2000, 4):
        made.take_arm(arm(stamp_ms), (stamp_ms + 4) * MS)
        assert made.gone((stamp_ms + 4) * MS, far) == []
    assert made.unlisted(2000 * MS) == ["ann"]
    assert "ann" in made.arms(2000 * MS)
    assert made.unlisted(2200 * MS) == []
    assert made.gone(2495 * MS, far) == []
    assert made.gone(2501 * MS, far) == ["ann"]


def test_who_comes_back_is_as_before() -> None:
    made = people()
    made.gone(104 * MS, far)
    unlist(made, 104)
    made.gone(204 * MS, far)
    made.lists.heard(2, ["ann"], 204 * MS)
    made.take_arm(arm(208), 212 * MS)
    assert made.gone(1000 * MS, far) == []
    assert [seen.was for seen in made.arms(212 * MS)["ann"]] == [False]
    made.forget(2 * MS)  # their place is known all the same
    assert [seen.was for seen in made.arms(2 * MS)["ann"]] == [True]
    made.take_arm(arm(4), 8 * MS)
    assert [seen.was for seen in made.arms(8 * MS)["ann"]] == [False]


def test_who_has_left_is_let_go_though_the_clock_went_back() -> None:
    made = people()
    made.gone(104 * MS, far)
    unlist(made, 104)
    made.forget(4 * MS)  # what was said at later times means nothing
    assert made.gone(10 * MS, far) == []
    assert made.gone(511 * MS, far) == ["ann"]


def test_who_was_seen_before_the_clock_went_back_grows_older() -> None:
    made = people()
    made.gone(104 * MS, far)
    unlist(made, 104)
    (before,) = made.arms(204 * MS)["ann"]
    np.testing.assert_allclose(before.age_s, 0.104)
    made.forget(20 * MS)
    for now_ms, age_s in ((20, 0.104), (28, 0.112), (420, 0.504)):
        (seen,) = made.arms(now_ms * MS)["ann"]
        np.testing.assert_allclose(seen.age_s, age_s, atol=1e-9)
    made.forget(10 * MS)  # once more: no age is lost
    for now_ms, age_s in ((10, 0.504), (110, 0.604)):
        (seen,) = made.arms(now_ms * MS)["ann"]
        np.testing.assert_allclose(seen.age_s, age_s, atol=1e-9)


def test_an_arm_that_is_seen_again_says_nothing_of_the_other() -> None:
    made = people()
    made.take_arm(arm(100, "left", 0.4), 104 * MS)
    made.gone(104 * MS, far)
    made.arms(104 * MS)
    made.forget(4 * MS)
    made.take_arm(arm(4), 8 * MS)
    found = {seen.side: seen for seen in made.arms(104 * MS)["ann"]}
    assert not found["right"].was
    assert found["left"].was
    np.testing.assert_allclose(found["left"].age_s, 0.104)
    made.take_arm(arm(104, "left", 0.4), 108 * MS)
    assert [seen.was for seen in made.arms(108 * MS)["ann"]] == [False, False]


@pytest.mark.parametrize("part", ["an arm", "a keypoint", "hidden"])
def test_who_is_not_listed_and_seen_in_part_stops_the_robot(part: str) -> None:
    made = people(BOTH if part == "an arm" else SEEN)
    if part == "hidden":
        made.take_arm(arm(100, "left"), 104 * MS)
    if part == "a keypoint":
        made = People(ReleaseConfig(arms=SEEN))
        made.lists.heard(0, ["ann"], 104 * MS)
    unlist(made, 104)
    for stamp_ms in range(164, 1000, 4):
        message = arm(stamp_ms)
        message.valid[3] = part != "a keypoint"
        made.take_arm(message, (stamp_ms + 4) * MS)
        made.lists.heard(104, (), (stamp_ms + 4) * MS)
        made.gone((stamp_ms + 4) * MS, far)
    said = {
        "an arm": "the left arm of ann was never seen (arms:=seen does without)",
        "a keypoint": "the hand tip of ann's right arm was never seen",
        "hidden": "the left arm of ann was last seen 0.8 s ago",
    }
    assert made.trouble(1000 * MS) == said[part]
    made.lists.heard(104, (), 2000 * MS)
    assert made.gone(2000 * MS, far) == ["ann"]
    assert made.trouble(2000 * MS) == ""


class Bus:
    """A node that hears what is said on topics, as far as it listens; publishers of arms by topic."""

    def __init__(self) -> None:
        self.tick_ns = 0
        self.heard: dict[str, Callable[[Any], None]] = {}
        self.publishers = {"humans/bodies/ann/arm": 1}

    def listen(self, kind: Any, topic: str, handler: Callable[[Any], None], qos: Any) -> None:
        self.heard[topic] = handler

    def ignore(self, topic: str) -> None:
        del self.heard[topic]

    def resolve_topic_name(self, topic: str) -> str:
        return topic

    def count_publishers(self, topic: str) -> int:
        return self.publishers.get(topic, 0)

    def fault(self, *said: Any) -> None:
        raise AssertionError(said)


def test_who_comes_back_into_sight_is_reckoned_with_though_nobody_lists_them() -> None:
    bus, made = Bus(), People(ReleaseConfig(arms=SEEN))
    watched = WatchedArms(bus, made, far)  # type: ignore[arg-type]

    def run(ms: int, *ids: str, stamp: int, seen: bool) -> None:
        for now_ms in range(bus.tick_ns // MS + 4, bus.tick_ns // MS + ms + 1, 4):
            bus.tick_ns = now_ms * MS
            if now_ms % 40 == 0:
                header = Header(stamp=to_time(stamp))
                watched.take(IdsList(header=header, ids=list(ids)))
            if seen and "humans/bodies/ann/arm" in bus.heard:
                bus.heard["humans/bodies/ann/arm"](arm(now_ms - 4))
            watched.look(bus.tick_ns)

    run(1000, "ann", stamp=1, seen=True)
    run(2000, stamp=2, seen=False)
    assert made.arms(bus.tick_ns) == {}
    run(200, stamp=2, seen=True)
    assert [each.was for each in made.arms(bus.tick_ns)["ann"]] == [True]
    assert made.unlisted(bus.tick_ns) == ["ann"]
    # Nobody sends them any more: nobody listens for them.
    bus.publishers.clear()
    run(2000, stamp=2, seen=False)
    assert bus.heard == {}
    run(1000, "ann", stamp=3, seen=True)
    assert [each.was for each in made.arms(bus.tick_ns)["ann"]] == [False]


def test_who_is_hidden_beside_a_second_source_is_missed_and_seen_again() -> None:
    bus, made = Bus(), People(ReleaseConfig(arms=SEEN))
    watched = WatchedArms(bus, made, far)  # type: ignore[arg-type]
    for now_ms in range(4, 4000, 4):
        bus.tick_ns = now_ms * MS
        for stamp, ids in ((1, ["ann"]), (2, [])):
            if now_ms % 40 == 0:
                watched.take(IdsList(header=Header(stamp=to_time(stamp)), ids=ids))
        if "humans/bodies/ann/arm" in bus.heard and not 2000 < now_ms < 2600:
            bus.heard["humans/bodies/ann/arm"](arm(now_ms - 4))
        watched.look(bus.tick_ns)
        if 2100 < now_ms < 2600:
            assert made.trouble(bus.tick_ns).startswith("the right arm of ann was last seen")
        elif now_ms > 40 and not 2000 < now_ms <= 2100:
            assert not made.trouble(bus.tick_ns)
    assert list(made.arms(bus.tick_ns)) == ["ann"]


def prediction(side: str, state: int = HumanPrediction.IDLE) -> HumanPrediction:
    return HumanPrediction(
        header=Header(stamp=to_time(100 * MS), frame_id="world"),
        body_id="ann",
        side=side,
        state=state,
        times=[0.0, 0.1],
        mean=np.tile(ARM, (2, 1)).ravel(),
        covariance=np.tile(1e-4 * np.eye(3), (8, 1, 1)).ravel(),
    )


def test_each_arm_has_its_own_prediction() -> None:
    made, radii = people(), np.full(3, 0.05)
    for side in ("left", "right"):
        made.take_prediction(prediction(side), radii)
    assert set(made.predictions(104 * MS)) == {("ann", "left"), ("ann", "right")}
    made.take_prediction(prediction("left", HumanPrediction.INVALID), radii)
    assert set(made.predictions(104 * MS)) == {("ann", "right")}
    with pytest.raises(DataError, match="has side 'both'"):
        made.take_prediction(prediction("both"), radii)
    made.take_prediction(prediction("left"), radii)
    made.forget_body("ann")
    assert made.predictions(104 * MS) == {}


NAN, INF = float("nan"), float("inf")


@pytest.mark.parametrize(
    "times",
    [
        [5.0, 5.1],
        [-0.1, 0.0],
        [0.1, 0.0],
        [0.0, 0.0],
        [0.0, -0.1],
        [0.0, 0.1, 0.3],
        [0.0, 0.1, 0.1],
        [0.0, NAN, 0.2],
        [0.0, 0.1, NAN],
        [NAN, NAN],
        [0.0, INF],
        [0.0, INF, INF],
        [-INF, 0.0],
    ],
)
def test_a_prediction_for_times_that_make_no_sense_is_refused(times: list[float]) -> None:
    made, radii = people(), np.full(3, 0.05)
    made.take_prediction(prediction("right"), radii)
    wrong, count = prediction("right"), len(times)
    wrong.times = times
    wrong.mean = np.tile(ARM, (count, 1)).ravel()
    wrong.covariance = np.tile(1e-4 * np.eye(3), (4 * count, 1, 1)).ravel()
    with pytest.raises(DataError, match="0 first, and equal steps"):
        made.take_prediction(wrong, radii)
    assert made.predictions(104 * MS) == {}


@pytest.mark.parametrize(
    ("arms", "intrusion", "said"),
    [(BOTH, 0.05, False), (SEEN, 0.05, True), (SEEN, 0.0, True), (SEEN, 0.6, False)],
)
def test_an_arm_that_is_not_reckoned_with_is_spoken_of(
    arms: str, intrusion: float, said: bool
) -> None:
    text = unseen_arms(ReleaseConfig(arms=arms), intrusion)
    assert bool(text) == said
    if said:
        assert text.startswith(f"arms: seen with intrusion: {intrusion:g} m")
        assert "arms: both" in text
        assert "intrusion: 0.6" in text
