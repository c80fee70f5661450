"""Where the two people of a dyad sit, and how they sit there."""

import numpy as np
import pytest

from hri_sim.dyads.arms import LIMBS_M, SeatedArm
from hri_sim.dyads.setups import ARRANGEMENTS, TARGETS, draw_setup, draw_setups


@pytest.mark.parametrize("arrangement", ARRANGEMENTS)
def test_both_look_at_the_table_and_reach_into_the_same_region(arrangement: str) -> None:
    for seed in range(5):
        setup = draw_setup("x", arrangement, np.random.default_rng(seed))
        assert setup.places.shape == (2, 1 + TARGETS, 3)
        for person in range(2):
            yaw = setup.yaw[person]
            looks = -np.array((np.cos(yaw), np.sin(yaw)))
            seat = setup.shoulders[person, :2] - 0.18 * np.array((looks[1], -looks[0]))
            np.testing.assert_allclose(seat, -0.55 * looks, atol=1e-9)
            targets = setup.places[person, 1:]
            assert (np.abs(targets[:, :2]) <= (0.24, 0.20)).all()
            assert (targets[:, 2] > 0.0).all()
            from_home = np.linalg.norm(targets - setup.places[person, 0], axis=1)
            assert (from_home >= 0.22).all()


def test_names_and_arrangements_go_by_turns() -> None:
    setups = draw_setups(5, np.random.default_rng(0))
    names = ["opposite_0", "corner_0", "beside_0", "opposite_1", "corner_1"]
    assert [setup.name for setup in setups] == names
    again = draw_setups(5, np.random.default_rng(0))
    np.testing.assert_array_equal(setups[4].places, again[4].places)


@pytest.mark.parametrize("arrangement", ARRANGEMENTS)
def test_arms_end_at_the_hand_with_limbs_of_their_length(arrangement: str) -> None:
    setup = draw_setup("x", arrangement, np.random.default_rng(2))
    for person in range(2):
        arm = SeatedArm(setup.shoulders[person], float(setup.yaw[person]))
        points = arm.keypoints(setup.places[person])
        np.testing.assert_allclose(points[:, 3], setup.places[person], atol=1e-12)
        limbs = np.linalg.norm(np.diff(points, axis=1), axis=2)
        np.testing.assert_allclose(limbs, np.broadcast_to(LIMBS_M, limbs.shape), atol=1e-12)
        assert (points[:, 1, 2] < setup.shoulders[person, 2]).all()  # elbows hang


def test_people_lean_towards_far_places_alone() -> None:
    arm = SeatedArm(np.array((0.0, 0.0, 0.4)), 0.3)
    near, far = arm.keypoints(((-0.2, 0.0, 0.1), (-0.8, 0.0, 0.1)))
    assert np.linalg.norm(near[0] - arm.shoulder) < 1e-4
    lean = far[0] - arm.shoulder
    assert 0.15 < np.linalg.norm(lean) < 0.4
    assert lean[0] < 0.0


def test_an_arm_turned_is_the_turned_arm() -> None:
    hands = np.random.default_rng(0).uniform(-0.3, 0.3, (6, 3)) - (0.3, 0.0, 0.2)
    quarter = np.array(((0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)))
    ahead = SeatedArm(np.zeros(3), 0.0).keypoints(hands)
    turned = SeatedArm(np.zeros(3), 0.5 * np.pi).keypoints(hands @ quarter.T)
    np.testing.assert_allclose(turned, ahead @ quarter.T, atol=1e-12)
