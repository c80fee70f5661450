"""What the monitor makes of who is heard of: arms that are missing, people who leave."""

from __future__ import annotations

import numpy as np
import pytest
from std_msgs.msg import Header

from hri_planner.ros.people import People, unseen_arms
from hri_planner.separation.config import BOTH, SEEN, BodyConfig, ReleaseConfig
from hri_planner.separation.parts import parts_of
from hri_prediction.errors import DataError
from hri_prediction.ros.messages import HumanArm, HumanPrediction
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


def people(arms: str = SEEN) -> People:
    made = People(ReleaseConfig(arms=arms))
    made.tracked = ("ann",)
    made.take_arm(arm(100), 104 * MS)
    return made


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
    made.tracked = ()
    made.forget_body("ann")
    assert made.gone(304 * MS) == []
    (gone,) = made.arms(304 * MS)["ann"]
    assert gone.was
    np.testing.assert_array_equal(gone.keypoints, ARM)
    np.testing.assert_allclose(gone.age_s, 0.204)
    assert np.isnan(gone.speeds).all()  # as fast as is assumed
    assert made.trouble(304 * MS) == ""
    assert made.gone(605 * MS) == ["ann"]
    assert made.arms(605 * MS) == {}


def test_who_leaves_has_trunk_and_head_all_the_while() -> None:
    made = people(BOTH)
    made.take_arm(arm(100, "left", 0.4), 104 * MS)
    before = parts_of("ann", made.arms(104 * MS)["ann"], BodyConfig())
    made.tracked = ()
    made.forget_body("ann")
    after = parts_of("ann", made.arms(304 * MS)["ann"], BodyConfig())
    assert [part.name for part in after] == [f"{part.name} (as it was)" for part in before]
    for one, other in zip(before, after, strict=True):
        np.testing.assert_array_equal(one.ends, other.ends)
        assert (one.radius, one.arm) == (other.radius, other.arm)
        assert (other.age_s >= 0.2).all()


def test_who_is_not_listed_and_still_seen_is_there() -> None:
    """The list may be that of a second source, which knows nothing of them."""
    made = people()
    made.tracked = ("bob",)
    made.forget_body("ann")
    for stamp_ms in range(104, 2000, 4):
        made.take_arm(arm(stamp_ms), (stamp_ms + 4) * MS)
        assert made.gone((stamp_ms + 4) * MS) == []
    assert made.unlisted(2000 * MS) == ["ann"]
    assert "ann" in made.arms(2000 * MS)
    assert made.unlisted(2200 * MS) == []
    assert made.gone(2495 * MS) == []
    assert made.gone(2501 * MS) == ["ann"]


def test_who_comes_back_is_as_before() -> None:
    made = people()
    made.gone(104 * MS)
    made.tracked = ()
    made.forget_body("ann")
    made.gone(204 * MS)
    made.tracked = ("ann",)
    made.take_arm(arm(208), 212 * MS)
    assert made.gone(1000 * MS) == []
    assert [seen.was for seen in made.arms(212 * MS)["ann"]] == [False]
    made.forget()
    assert made.arms(212 * MS) == {}


def test_who_has_left_is_let_go_though_the_clock_went_back() -> None:
    made = people()
    made.gone(104 * MS)
    made.tracked = ()
    made.forget_body("ann")
    made.forget()  # what was said at later times means nothing
    assert made.gone(10 * MS) == []
    assert made.gone(511 * MS) == ["ann"]


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
