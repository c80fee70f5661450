"""What the monitor makes of who is heard of: arms that are missing, people who leave."""

from __future__ import annotations

import numpy as np
import pytest
from std_msgs.msg import Header

from hri_planner.ros.people import People
from hri_planner.separation.config import BOTH, SEEN, ReleaseConfig
from hri_prediction.ros.messages import HumanArm
from hri_prediction.ros.time import to_time

ARM = np.array([[0.9, 0.2, 0.4], [0.85, 0.2, 0.12], [0.6, 0.2, 0.1], [0.5, 0.2, 0.1]])
MS = 1_000_000


def arm(stamp_ms: int, side: str = "right") -> HumanArm:
    return HumanArm(
        header=Header(stamp=to_time(stamp_ms * MS), frame_id="world"),
        body_id="ann",
        side=side,
        keypoints=ARM.ravel(),
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
    (gone,) = made.arms(304 * MS)["ann"]
    assert gone.was
    np.testing.assert_array_equal(gone.keypoints, ARM)
    np.testing.assert_allclose(gone.age_s, 0.204)
    assert np.isnan(gone.speeds).all()  # as fast as is assumed
    assert made.trouble(304 * MS) == ""
    assert made.arms(605 * MS) == {}


def test_who_comes_back_is_there_twice_until_it_is_sure() -> None:
    made = people()
    made.arms(104 * MS)
    made.forget_body("ann")
    made.take_arm(arm(200), 204 * MS)
    assert [seen.was for seen in made.arms(204 * MS)["ann"]] == [False, True]
    made.forget()
    assert made.arms(204 * MS) == {}
