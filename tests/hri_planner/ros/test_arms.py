"""What is known of tracked arms, whatever motion capture says of them."""

import numpy as np
import pytest

from hri_planner.ros.arms import ArmInputs, TrackedArm
from hri_planner.supervision.freshness import HeardPerson

MS = 1_000_000
ARM = np.array(((0.9, 0.0, 0.4), (0.7, 0.1, 0.2), (0.6, 0.05, 0.2), (0.45, 0.1, 0.3)))
SPEED = np.array((-0.5, 0.2, 0.0))
ELBOW, WRIST, HAND = 1, 2, 3


def at(ms: float) -> np.ndarray:
    """An arm that moves along as a whole."""
    return ARM + SPEED * ms / 1000.0


def tracked(until_ms: int = 80) -> TrackedArm:
    arm = TrackedArm()
    for ms in range(0, until_ms + 1, 4):
        arm.add(ms * MS, at(ms))
    return arm


def unseen(keypoints: np.ndarray, *joints: int) -> np.ndarray:
    found = keypoints.copy()
    found[list(joints)] = np.nan
    return found


def moved(keypoints: np.ndarray, joint: int, way: float) -> np.ndarray:
    found = keypoints.copy()
    found[joint, 2] += way
    return found


def test_an_arm_goes_on_as_it_did() -> None:
    partner = tracked().partner(100 * MS)
    assert partner.joints == pytest.approx(at(100))
    assert partner.position == pytest.approx(at(100)[HAND])
    assert partner.speeds == pytest.approx(np.tile(SPEED, (4, 1)))
    # Since the middle of the 48 ms that gave the speed.
    assert partner.age == pytest.approx(0.044)


def noisy(rng: np.random.Generator, place: np.ndarray) -> np.ndarray:
    return place + 0.002 * rng.standard_normal((4, 3))


@pytest.mark.parametrize("period_ms", [4, 8, 10])
def test_at_rest_the_noise_of_motion_capture_is_no_speed(period_ms: int) -> None:
    rng, arm, fastest = np.random.default_rng(3), TrackedArm(), []
    for ms in range(0, 4000, period_ms):
        arm.add(ms * MS, noisy(rng, ARM))
        if ms >= 200:
            partner = arm.partner(ms * MS)
            fastest.append(np.linalg.norm(partner.speeds, axis=1).max())
    assert np.quantile(fastest, 0.9) < 0.03
    assert partner.age <= 0.024 + 1e-9


@pytest.mark.parametrize("period_ms", [4, 8])
@pytest.mark.parametrize("seed", range(10))
def test_who_sets_out_is_hardly_faster_than_speed_and_age_allow(seed: int, period_ms: int) -> None:
    """Bounds assume that the speed differs by no more than 4 m/s² since its age; noise comes on top."""
    rng, arm = np.random.default_rng(seed), TrackedArm()
    way = rng.standard_normal(3)
    way /= np.linalg.norm(way)
    over = []
    for ms in range(0, 500, period_ms):
        since = max(ms - 300, 0) / 1000.0
        arm.add(ms * MS, noisy(rng, ARM + 0.5 * 4.0 * since**2 * way))
        if ms >= 200:
            partner = arm.partner(ms * MS)
            missed = float((4.0 * since * way - partner.velocity) @ way)
            over.append(missed - 4.0 * partner.age)
    assert max(over) < 0.16
    assert np.mean(over) < 0.0


@pytest.mark.parametrize("period_ms", [33, 60])
def test_slow_sources_say_speeds_too(period_ms: int) -> None:
    arm = TrackedArm()
    for ms in range(0, 600, period_ms):
        arm.add(ms * MS, at(ms))
    partner = arm.partner(ms * MS)
    assert partner.speeds == pytest.approx(np.tile(SPEED, (4, 1)))
    assert partner.age == pytest.approx(period_ms / 1000.0)


def test_after_a_gap_it_goes_on_as_before_it() -> None:
    arm = tracked()
    arm.add(144 * MS, at(144))
    partner = arm.partner(144 * MS)
    assert partner.speeds == pytest.approx(np.tile(SPEED, (4, 1)))
    assert partner.age > 0.02


def test_of_a_single_sample_no_speed_is_known() -> None:
    arm = TrackedArm()
    arm.add(0, ARM)
    partner = arm.partner(20 * MS)
    assert partner.position == pytest.approx(ARM[HAND])
    assert partner.age == pytest.approx(0.096 + 0.020)


def test_a_joint_that_is_not_seen_goes_along_with_the_hand() -> None:
    arm = tracked()
    for ms in range(84, 200, 4):
        arm.add(ms * MS, unseen(at(ms), ELBOW, WRIST))
    assert arm.partner(200 * MS).joints == pytest.approx(at(200), abs=1e-9)
    first = TrackedArm()
    first.add(0, unseen(ARM, 0, ELBOW, WRIST))
    assert first.keypoints[-1] == pytest.approx(np.tile(ARM[HAND], (4, 1)))
    # Once it is seen it is there, however far away it was thought to be.
    first.add(4 * MS, at(4))
    assert np.linalg.norm(first.keypoints[-1][ELBOW] - at(4)[ELBOW]) < 0.3


@pytest.mark.parametrize("joint", [0, ELBOW, WRIST])
@pytest.mark.parametrize("hidden_ms", [8, 60, 500, None])
def test_a_joint_that_is_seen_again_has_not_come_from_where_it_was_thought_to_be(
    joint: int, hidden_ms: int | None
) -> None:
    """It rested 15 cm from there; without samples of it from before, it was thought to be the hand."""
    arm = TrackedArm() if hidden_ms is None else tracked()
    begin, hidden_ms = (0, 60) if hidden_ms is None else (84, hidden_ms)
    for ms in range(begin, begin + hidden_ms, 4):
        arm.add(ms * MS, unseen(at(ms), joint))
    back = begin + hidden_ms
    off = 0.06 if hidden_ms < 60 else 0.15
    for ms in range(back, back + 60, 4):
        arm.add(ms * MS, moved(at(ms), joint, off))
        found = arm.partner(ms * MS)
        assert np.linalg.norm(found.speeds, axis=1).max() < 1.5
        assert found.joints == pytest.approx(moved(at(ms), joint, off), abs=1e-6)


@pytest.mark.parametrize("joint", [0, ELBOW, WRIST, HAND])
def test_a_single_jump_is_not_believed(joint: int) -> None:
    arm = tracked()
    arm.add(84 * MS, moved(at(84), joint, 0.3))
    partner = arm.partner(84 * MS)
    assert partner.joints == pytest.approx(at(84), abs=1e-6)
    assert np.abs(partner.speeds - SPEED).max() < 0.05
    arm.add(88 * MS, at(88))
    assert arm.partner(88 * MS).joints == pytest.approx(at(88), abs=1e-6)


@pytest.mark.parametrize("joint", [0, ELBOW, WRIST, HAND])
def test_a_jump_that_stays_is_believed_after_a_while_and_is_no_speed(joint: int) -> None:
    arm = tracked()
    for ms in range(84, 84 + 100, 4):
        arm.add(ms * MS, moved(at(ms), joint, 0.5))
        assert np.linalg.norm(arm.partner(ms * MS).speeds, axis=1).max() < 1.5
    assert arm.partner(180 * MS).joints == pytest.approx(moved(at(180), joint, 0.5), abs=1e-6)


def test_what_is_in_use_does_not_change() -> None:
    arm = tracked()
    before = arm.partner(80 * MS)
    joints = before.joints.copy()
    for ms in range(84, 184, 4):
        arm.add(ms * MS, moved(at(ms), ELBOW, 0.4))
    np.testing.assert_array_equal(before.joints, joints)


def test_what_is_out_of_order_says_nothing_and_a_clock_that_went_back_begins_anew() -> None:
    arm = tracked()
    arm.add(40 * MS, ARM + 1.0)
    assert arm.partner(80 * MS).joints == pytest.approx(at(80))
    late = TrackedArm()
    late.add(5000 * MS, ARM)
    late.add(100 * MS, ARM + 0.5)
    assert late.partner(100 * MS).joints == pytest.approx(ARM + 0.5)


def test_inputs_are_of_those_who_are_tracked() -> None:
    inputs = ArmInputs(radii=np.array((0.05, 0.04, 0.05)))
    assert inputs.partners(0) == []
    assert inputs.newest_sample_ns() == 0
    for name, ms in (("ann", 8), ("bob", 4)):
        inputs.take(name, "right", ms * MS, ARM)
    assert inputs.partners(0) == []
    inputs.lists.heard(0, ["ann", "bob", "eve"], 0)
    assert len(inputs.partners(10 * MS)) == 2
    assert inputs.newest_sample_ns() == 4 * MS
    assert {name: heard.stamp_ns for name, heard in inputs.people_heard().items()} == {
        "ann": 8 * MS,
        "bob": 4 * MS,
    }
    # Without a hand it is no sample: the one before grows old.
    inputs.take("bob", "right", 12 * MS, unseen(ARM, HAND))
    assert inputs.newest_sample_ns() == 4 * MS
    inputs.forget_body("bob")
    assert len(inputs.partners(10 * MS)) == 1
    inputs.forget()
    assert inputs.people_heard() == {}
    assert inputs.arms_now() == []


def test_both_arms_of_a_body_are_two() -> None:
    """As one they would be an arm that jumps to and fro."""
    inputs = ArmInputs(radii=np.array((0.05, 0.04, 0.05)))
    inputs.lists.heard(0, ["ann"], 0)
    for ms in range(0, 60, 4):
        inputs.take("ann", "right", ms * MS, ARM)
        if ms < 40:
            inputs.take("ann", "left", ms * MS, ARM + 0.3)
    right, left = inputs.arms_now()
    np.testing.assert_array_equal(right, ARM)
    np.testing.assert_array_equal(left, ARM + 0.3)
    for partner in inputs.partners(60 * MS):
        assert partner.velocity == pytest.approx(np.zeros(3))
    # One that falls silent is waited for: as old as the body is what is known least of it.
    assert inputs.people_heard() == {"ann": HeardPerson(36 * MS)}
    assert inputs.newest_sample_ns() == 36 * MS
    inputs.forget_body("ann")
    assert inputs.people_heard() == {}
    assert inputs.arms_now() == []


def test_what_is_wrong_with_a_sample_is_said() -> None:
    arm = tracked(80)
    assert arm.add(84 * MS, at(84)) == ""
    assert arm.add(84 * MS, at(84)) == arm.add(60 * MS, at(60)) == "late or repeated sample"
    said = arm.add(88 * MS, moved(at(88), ELBOW, 0.2))
    assert said == "jump: elbow; the hand, which does not, tells where the arm is"
    elsewhere = at(92) + 0.5
    assert arm.add(92 * MS, elsewhere) == "jump: shoulder, elbow, wrist, hand tip; not believed yet"
    assert arm.partner(92 * MS).position == pytest.approx(at(92)[HAND])
    for ms in range(96, 148, 4):
        assert arm.add(ms * MS, elsewhere).endswith("not believed yet")
    assert arm.add(152 * MS, elsewhere).endswith("believed now, after 0.06 s")
    assert arm.partner(152 * MS).position == pytest.approx(elsewhere[HAND])
    assert arm.add(156 * MS, elsewhere) == ""
    assert arm.add(-2000 * MS, at(0)) == "the clock went back: it is looked at anew"


def test_an_arm_whose_hand_is_not_seen_is_not_taken() -> None:
    inputs = ArmInputs(radii=np.full(3, 0.05))
    assert inputs.take("ann", "left", 0, unseen(ARM, HAND)) == ""
    assert inputs.people_heard() == {}
