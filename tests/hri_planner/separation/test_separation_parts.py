"""What people are made of, and how motion capture is followed."""

import numpy as np
import pytest

from hri_planner.separation.config import BodyConfig, ReleaseConfig
from hri_planner.separation.parts import Part, parts_of
from hri_planner.separation.track import ArmWatch
from hri_prediction.arm.geometry import SIDES
from hri_prediction.errors import DataError

RELEASE = ReleaseConfig()
ARM = np.array([[0.9, 0.2, 0.4], [0.85, 0.2, 0.12], [0.6, 0.2, 0.1], [0.5, 0.2, 0.1]])
MS = 1_000_000


def watch(*samples: tuple[int, np.ndarray], side: str = "right") -> ArmWatch:
    made = ArmWatch(side, RELEASE)
    for stamp_ms, keypoints in samples:
        made.add(stamp_ms * MS, keypoints)
    return made


def test_an_arm_is_where_it_was_seen_and_grows_old() -> None:
    (arm,) = watch((100, ARM)).at(130 * MS)
    np.testing.assert_array_equal(arm.keypoints, ARM)
    np.testing.assert_allclose(arm.age_s, 0.03)
    assert np.isnan(arm.speeds).all()  # one sample says nothing of speed


def test_a_hidden_keypoint_stays_and_grows_old_alone() -> None:
    hidden = ARM.copy() + 0.001
    hidden[1] = np.nan
    (arm,) = watch((100, ARM), (140, hidden)).at(150 * MS)
    np.testing.assert_allclose(arm.age_s, [0.01, 0.05, 0.01, 0.01])
    np.testing.assert_array_equal(arm.keypoints[1], ARM[1])


def test_what_was_never_seen_is_named() -> None:
    hidden = ARM.copy()
    hidden[2] = np.nan
    made = watch((100, hidden))
    assert made.missing == (2,)
    assert made.at(100 * MS) == []
    made.add(104 * MS, np.full((4, 3), np.nan))
    assert made.newest_ns == 100 * MS  # a sample in which nothing is seen is none


def test_older_samples_say_nothing() -> None:
    made = watch((100, ARM), (96, ARM + 0.02), (100, ARM + 0.01))
    np.testing.assert_array_equal(made.at(100 * MS)[0].keypoints, ARM)
    assert made.jumps == 0


def test_speed_is_that_of_a_line_through_the_newest_samples() -> None:
    velocity = np.array([-0.8, 0.1, 0.3])
    made = watch(*((4 * k, ARM + 0.004 * k * velocity) for k in range(30)))
    (arm,) = made.at(116 * MS)
    np.testing.assert_allclose(arm.speeds, np.tile(velocity, (4, 1)), atol=1e-9)
    assert arm.half_window_s == pytest.approx(0.024)


def test_an_arm_that_jumps_is_in_both_places_for_a_while() -> None:
    made = watch((96, ARM), (100, ARM), (104, ARM + 0.3))
    assert made.jumps == 1
    now, was = made.at(150 * MS)
    np.testing.assert_array_equal(now.keypoints, ARM + 0.3)
    np.testing.assert_array_equal(was.keypoints, ARM)
    assert was.was
    np.testing.assert_allclose(was.age_s, 0.05)
    assert np.isnan(was.speeds).all()  # so that it is reckoned with at the assumed speed
    assert len(made.at((104 + 201) * MS)) == 1


def test_two_sources_of_one_body_leave_it_in_both_places() -> None:
    samples = [(4 * k, ARM + (0.4 if k % 2 else 0.0)) for k in range(50)]
    arms = watch(*samples).at(200 * MS)
    places = {round(float(arm.keypoints[3, 0]), 2) for arm in arms}
    assert places == {0.5, 0.9}


@pytest.mark.parametrize("factor", [1000.0, 0.01])
def test_wrong_units_are_refused(factor: float) -> None:
    made = watch((100, ARM))
    with pytest.raises(DataError, match=r"metres"):
        made.add(104 * MS, factor * ARM)
    np.testing.assert_array_equal(made.at(104 * MS)[0].keypoints, ARM)


def seen(*sides: str) -> list:
    arms = []
    for side in sides:
        offset = np.array([0.0, 0.4 if side == "right" else 0.0, 0.0])
        arms += watch((100, ARM + offset), side=side).at(100 * MS)
    return arms


def test_arms_alone_are_three_capsules_each() -> None:
    parts = parts_of("p", seen("left", "right"), BodyConfig(trunk=False))
    assert [part.name for part in parts][:3] == ["left upper_arm", "left forearm", "left hand"]
    assert len(parts) == 6
    assert all(part.arm for part in parts)


def named(arms: list, name: str, config: BodyConfig | None = None) -> list[Part]:
    parts = parts_of("p", arms, config or BodyConfig())
    return [part for part in parts if part.name == name]


def test_an_upright_trunk_and_head_hang_from_both_shoulders() -> None:
    upright = BodyConfig(max_lean=0.0)
    middle = ARM[0] + [0.0, 0.2, 0.0]
    trunk, *_ = named(seen("left", "right"), "trunk", upright)
    np.testing.assert_allclose(trunk.ends, [middle, middle - [0.0, 0.0, 0.55]])
    assert not trunk.arm
    head, *_ = named(seen("left", "right"), "head", upright)
    np.testing.assert_allclose(head.ends, [middle, middle - [0.0, 0.0, -0.22]])
    # Broader than deep: the sides reach as far as the shoulders.
    sides = [named(seen("left", "right"), f"{side} side", upright)[0] for side in SIDES]
    reach = max(part.ends[0, 1] + part.radius for part in sides)
    assert reach == pytest.approx(ARM[0, 1] + 0.4, abs=1e-9)


def test_hips_may_be_behind_the_shoulders_and_the_head_before_them() -> None:
    """Left of the right shoulder, at larger y, somebody looks along -x."""
    middle = ARM[0] + [0.0, 0.2, 0.0]
    hips = np.array([part.ends[1] for part in named(seen("left", "right"), "trunk")]) - middle
    np.testing.assert_allclose(np.linalg.norm(hips, axis=1), 0.55)
    np.testing.assert_allclose(hips[:, 1], 0.0, atol=1e-9)
    assert hips[:, 0].max() == pytest.approx(0.55 * np.sin(0.52))
    assert hips[:, 0].min() == pytest.approx(-0.55 * np.sin(0.52 / 3.0))
    # Between two axes nobody's trunk sticks out by much.
    assert np.diff(np.sort(hips[:, 0])).max() < 0.16
    heads = np.array([part.ends[1] for part in named(seen("left", "right"), "head")]) - middle
    assert sorted(heads[:, 0]) == pytest.approx([-0.22 * np.sin(0.52), 0.0])


@pytest.mark.parametrize("lower", SIDES)
def test_who_leans_aside_has_hips_below_the_higher_shoulder(lower: str) -> None:
    arms = seen("left", "right")
    tilt = np.radians(15.0)
    for arm in arms:
        arm.keypoints[0, 2] += 0.2 * np.tan(tilt) * (-1.0 if arm.side == lower else 1.0)
    higher = next(side for side in SIDES if side != lower)
    upright = BodyConfig(max_lean=0.0)
    beyond, *_ = named(arms, f"{higher} side", upright)
    below, *_ = named(arms, f"{lower} side", upright)
    way = beyond.ends[1] - beyond.ends[0]
    aside = 1.0 if higher == "right" else -1.0
    np.testing.assert_allclose(
        way, 0.55 * np.array([0.0, aside * np.sin(tilt), -np.cos(tilt)]), atol=1e-9
    )
    # A shrug is possible as well.
    np.testing.assert_allclose(below.ends[1] - below.ends[0], [0.0, 0.0, -0.55], atol=1e-9)


def test_a_single_shoulder_may_be_at_either_end_of_somebody_who_leans_anywhere() -> None:
    (trunk,) = named(seen("left"), "trunk")
    np.testing.assert_allclose(trunk.ends[0], ARM[0])
    assert trunk.radius == pytest.approx(0.16 + np.hypot(0.5 * 0.43, 0.55 * np.sin(0.52)))
    (head,) = named(seen("left"), "head")
    assert head.radius == pytest.approx(0.20 + np.hypot(0.5 * 0.43, 0.22 * np.sin(0.52)))


def test_shoulders_above_each_other_do_not_tell_where_somebody_looks() -> None:
    arms = seen("left", "right")
    arms[1].keypoints[0] = arms[0].keypoints[0] + [0.0, 0.0, 0.3]
    (trunk,) = named(arms, "trunk")
    assert trunk.radius == pytest.approx(0.16 + np.hypot(0.15, 0.55 * np.sin(0.52)))


def jumped(*, shoulder: float) -> list:
    """A left arm that stays, and a right one that jumps, its shoulder by so much."""
    new = ARM + np.array([0.0, 0.4, 0.0])
    new[2:] += 0.3
    new[0] += [shoulder, 0.0, 0.0]
    old = ARM + np.array([0.0, 0.4, 0.0])
    arms = watch((100, ARM), (104, ARM), side="left").at(110 * MS)
    return arms + watch((96, old), (100, old), (104, new)).at(110 * MS)


def test_where_a_hand_was_alone_there_is_no_second_trunk() -> None:
    names = [part.name for part in parts_of("p", jumped(shoulder=0.02), BodyConfig())]
    assert {name for name in names if name.startswith("trunk")} == {"trunk"}
    assert "right hand (as it was)" in names


def test_where_a_shoulder_was_there_may_still_be_a_trunk() -> None:
    (was,) = named(jumped(shoulder=0.3), "trunk (as it was)")
    np.testing.assert_allclose(was.ends[0], ARM[0] + [0.0, 0.4, 0.0])
    # It may be at either side of that shoulder.
    assert was.radius > 0.16 + 0.5 * 0.43
    names = {part.name for part in parts_of("p", jumped(shoulder=0.3), BodyConfig())}
    assert {"trunk", "head", "head (as it was)"} <= names
