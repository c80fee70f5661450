"""Posture of the simulated arm."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hri_sim.people.arm import WRIST_BEND, ArmModel

SHOULDER = (0.75, 0.0, 0.40)
RIGHT = ArmModel("right", SHOULDER, 0.29, 0.26, 0.09)
LEFT = ArmModel("left", SHOULDER, 0.29, 0.26, 0.09)

targets = st.tuples(st.floats(0.33, 0.6), st.floats(-0.25, 0.25), st.floats(0.08, 0.22))


@given(targets, st.floats(-1.0, 1.5), st.sampled_from([RIGHT, LEFT]))
def test_limbs_keep_their_lengths_and_the_wrist_its_bend(target, swivel, arm):
    points = arm.posture(np.array(target), swivel)
    limbs = np.diff(points, axis=0)
    np.testing.assert_allclose(np.linalg.norm(limbs, axis=1), [0.29, 0.26, 0.09], atol=1e-12)
    cosine = limbs[1] @ limbs[2] / (0.26 * 0.09)
    assert math.acos(cosine) == pytest.approx(WRIST_BEND, abs=1e-6)
    if arm.can_reach(target):
        np.testing.assert_allclose(points[3], target, atol=1e-12)


@given(targets, st.floats(-1.0, 1.5))
def test_left_arm_mirrors_the_right_one(target, swivel):
    mirror = np.array([1.0, -1.0, 1.0])
    right = RIGHT.posture(np.array(target), swivel)
    left = LEFT.posture(np.array(target) * mirror, swivel)
    np.testing.assert_allclose(left, right * mirror, atol=1e-12)


def test_elbow_hangs_down_and_swivels_outwards():
    target = np.array([0.45, 0.0, 0.15])
    hanging, turned = RIGHT.posture(target, 0.0)[1], RIGHT.posture(target, 0.5)[1]
    assert hanging[1] == pytest.approx(0.0, abs=1e-12)
    assert hanging[2] < SHOULDER[2] - 0.1
    assert turned[1] > 0.03
    assert turned[2] > hanging[2]


def test_wrist_bends_the_hand_downwards():
    points = RIGHT.posture(np.array([0.45, 0.0, 0.15]), 0.0)
    forearm, hand = np.diff(points, axis=0)[1:]
    assert math.atan2(hand[2], -hand[0]) < math.atan2(forearm[2], -forearm[0])


def test_places_out_of_reach_are_drawn_in():
    far, shoulder = np.array([-1.0, 0.0, 0.4]), np.array(SHOULDER)
    assert not RIGHT.can_reach(far)
    tip = RIGHT.posture(far, 0.2)[3]
    assert np.linalg.norm(tip - shoulder) == pytest.approx(RIGHT.reach[1])
    assert np.isfinite(RIGHT.posture(shoulder, 0.2)).all()
    assert np.isfinite(RIGHT.posture(shoulder - [0, 0, 0.4], 0.2)).all()


def test_arrays_of_targets():
    tips = np.random.default_rng(0).uniform((0.4, -0.2, 0.1), (0.5, 0.2, 0.2), (5, 6, 3))
    points = RIGHT.posture(tips, np.full((5, 6), 0.2))
    assert points.shape == (5, 6, 4, 3)
    np.testing.assert_allclose(points[2, 3], RIGHT.posture(tips[2, 3], 0.2))
