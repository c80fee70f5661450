"""Fourteen joints: where keypoints are, and joints found from keypoints."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hri_prediction.errors import DataError
from hri_prediction.ontology.upper_body import (
    COUNT,
    JOINTS,
    NEUTRAL,
    UpperBody,
    body_of,
    joints_of,
)

LIMBS = np.array((0.19, 0.29, 0.26, 0.09))
RIGHT = UpperBody(np.array((0.1, 0.2, 0.4)), 0.0, LIMBS)
LEFT = UpperBody(np.array((0.1, 0.2, 0.4)), 0.0, LIMBS, 1.0)


def test_there_are_fourteen_and_each_has_a_name() -> None:
    assert COUNT == len(set(JOINTS)) == 14


def test_at_zero_the_arm_hangs_down_beside_the_body() -> None:
    found = RIGHT.keypoints(np.zeros(14))
    np.testing.assert_allclose(found[0], (0.1, 0.2 - 0.19, 0.4))
    np.testing.assert_allclose(found[:, 2], 0.4 - np.array((0, 0.29, 0.55, 0.64)))
    np.testing.assert_allclose(found[:, :2], np.tile(found[0, :2], (4, 1)))


@pytest.mark.parametrize(
    ("joint", "point", "axis", "sign"),
    [
        ("trunk x", 3, 0, 1), ("trunk pitch", 0, 0, 0), ("shoulder elevation", 0, 2, 1),
        ("shoulder flexion", 3, 0, 1), ("shoulder abduction", 3, 1, -1), ("elbow flexion", 3, 0, 1),
        ("wrist flexion", 3, 0, 1), ("wrist deviation", 3, 1, -1),
    ],
)  # fmt: skip
def test_joints_move_what_they_say(joint: str, point: int, axis: int, sign: int) -> None:
    q = np.zeros(14)
    q[JOINTS.index(joint)] = 0.3
    moved = RIGHT.keypoints(q)[point] - RIGHT.keypoints(np.zeros(14))[point]
    assert np.sign(round(moved[axis], 12)) == sign


@given(st.integers(0, 10**6))
@settings(max_examples=40)
def test_limbs_keep_their_length_and_sides_mirror(seed: int) -> None:
    q = np.random.default_rng(seed).normal(0.0, 0.6, 14)
    points = RIGHT.keypoints(q)
    np.testing.assert_allclose(np.linalg.norm(np.diff(points, axis=0), axis=1), LIMBS[1:])
    mirrored = q.copy()
    mirrored[[1, 3, 5]] *= -1.0  # trunk y, yaw and roll are the world's
    other = LEFT.keypoints(mirrored)
    np.testing.assert_allclose(other[:, [0, 2]], points[:, [0, 2]], atol=1e-12)
    np.testing.assert_allclose(other[:, 1] - 0.2, 0.2 - points[:, 1], atol=1e-12)


def test_many_are_as_one_each() -> None:
    q = np.random.default_rng(0).normal(0.0, 0.5, (3, 5, 14))
    found = RIGHT.keypoints(q)
    assert found.shape == (3, 5, 4, 3)
    np.testing.assert_array_equal(found[2, 4], RIGHT.keypoints(q[2, 4]))


def test_headings_turn_everything() -> None:
    turned = UpperBody(np.zeros(3), np.pi / 2, LIMBS)
    straight = UpperBody(np.zeros(3), 0.0, LIMBS)
    q = np.random.default_rng(1).normal(0.0, 0.4, 14)
    x, y, z = straight.keypoints(q).T
    np.testing.assert_allclose(turned.keypoints(q), np.stack((-y, x, z), axis=1), atol=1e-12)


@given(st.integers(0, 10**6))
@settings(max_examples=25)
def test_joints_of_keypoints_have_these_keypoints(seed: int) -> None:
    rng = np.random.default_rng(seed)
    q = NEUTRAL + rng.normal(0.0, 0.25, 14) * ([0.2] * 7 + [1.0] * 7)
    wanted = RIGHT.keypoints(q)
    found = joints_of(RIGHT, wanted[None])
    np.testing.assert_allclose(RIGHT.keypoints(found)[0], wanted, atol=3e-3)


def test_a_smooth_movement_has_smooth_joints() -> None:
    share = np.linspace(0.0, 1.0, 60)
    gone = (10 * share**3 - 15 * share**4 + 6 * share**5)[:, None]
    q = NEUTRAL + gone * np.array([0.05, 0, 0, 0.1, 0.1, 0, 0, 0.6, 0.2, 0.1, -0.5, 0, 0.1, 0])
    found = joints_of(RIGHT, RIGHT.keypoints(q))
    assert np.abs(np.diff(found, 2, axis=0)).max() < 0.01
    error = np.linalg.norm(RIGHT.keypoints(found) - RIGHT.keypoints(q), axis=-1)
    assert error.max() < 3e-3


def test_bodies_are_those_of_recordings() -> None:
    points = RIGHT.keypoints(NEUTRAL + np.random.default_rng(0).normal(0.0, 0.02, (50, 14)))
    found = body_of(points, 0.0)
    np.testing.assert_allclose(found.limbs, LIMBS, atol=1e-9)
    np.testing.assert_allclose(found.base, RIGHT.base, atol=0.02)
    assert body_of(points, 0.0, "left").side == 1.0


def test_wrong_shapes_are_named() -> None:
    with pytest.raises(DataError, match=r"joints have shape \(13,\); expected \(..., 14\)"):
        RIGHT.keypoints(np.zeros(13))
    with pytest.raises(DataError, match="all finite"):
        joints_of(RIGHT, np.full((2, 4, 3), np.nan))
