"""The first guess: the arm as the world sees it, and the path of least cost aligned to it."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hri_prediction.errors import DataError
from hri_prediction.hybrid.body import CONVENTION, BodyArm, facing_towards
from hri_prediction.hybrid.config import HybridConfig
from hri_prediction.hybrid.prior_path import Geometry, optimal_path, straight_path
from hri_prediction.motor_control.arm_model import ArmModel
from hri_prediction.motor_control.costs import CHAPTER_2

ALPHA = np.array([0.3, 0.4, 0.2, 0.1])


@settings(max_examples=30, deadline=None)
@given(
    st.floats(-60.0, 80.0),
    st.floats(-30.0, 110.0),
    st.floats(10.0, 120.0),
    st.sampled_from([0.0, 1.3, np.pi]),
)
def test_postures_come_back_from_positions(q1, q2, q3, facing):
    for side in ("right", "left"):
        arm = BodyArm(ArmModel.of_body(convention=CONVENTION), 0.09, facing, side)
        angles = np.radians([q1, q2, q3])
        at = arm.positions(angles[None])[0]
        np.testing.assert_allclose(arm.positions(arm.posture(at)[None])[0], at, atol=1e-5)


def test_the_hand_gets_to_its_target(body, rest, targets):
    start = body.posture((rest.points[1:3] - rest.points[0]).ravel())
    for tip in targets.values():
        q = body.posture_at(tip - rest.points[0], start)
        at = body.positions(q[None])[0]
        forearm = (at[3:] - at[:3]) / np.linalg.norm(at[3:] - at[:3])
        np.testing.assert_allclose(at[3:] + body.hand_m * forearm, tip - rest.points[0], atol=1e-4)


def test_a_target_out_of_reach_is_refused_with_how_far(body):
    with pytest.raises(DataError, match="no nearer than"):
        body.posture_at(np.array([-1.3, 0.0, 0.0]), np.radians([20.0, 60.0, 40.0]))


def test_the_path_begins_where_the_arm_rests_and_ends_at_the_target(body, rest, targets):
    # Where no model can be: the shoulder has rolled.
    start = (rest.points[1:3] - rest.points[0]).ravel() + np.array(
        [0.0, 0.02, -0.02, 0.01, 0.0, 0.02]
    )
    tip = targets["near"] - rest.points[0]
    path = optimal_path(body, Geometry(start, tip), 1.0, ALPHA, CHAPTER_2, 0.04)
    assert not path.why_not
    np.testing.assert_allclose(path.values[0], start, atol=0.004)
    np.testing.assert_allclose(path.values[-1], body.positions(path.q_end[None])[0], atol=0.004)
    assert 0.7 < path.share < 1.0
    line = straight_path(body, Geometry(start, tip), 1.0, 0.04)
    np.testing.assert_allclose(line.values[0], start, atol=0.004)
    np.testing.assert_allclose(line.values[-1], path.values[-1], atol=0.006)
    # An optimum is not a straight line.
    assert np.linalg.norm(path.values[30, 3:] - line.values[30, 3:]) > 0.005


def test_a_trunk_goes_along_where_the_arm_is_too_short(body, rest):
    start = (rest.points[1:3] - rest.points[0]).ravel()
    reach = body.arm.upper_m + body.arm.forearm_m + body.hand_m
    tip = np.array([-(reach + 0.1), 0.05, -0.1])
    for path in (
        optimal_path(body, Geometry(start, tip), 1.0, ALPHA, CHAPTER_2, 0.04),
        straight_path(body, Geometry(start, tip), 1.0, 0.04),
    ):
        np.testing.assert_allclose(body.tips(path.values[-1:])[0], tip, atol=0.01)


def test_it_turns_with_the_person(body, rest, targets):
    start = (rest.points[1:3] - rest.points[0]).ravel()
    tip = targets["near"] - rest.points[0]
    path = optimal_path(body, Geometry(start, tip), 1.0, ALPHA, CHAPTER_2, 0.04)
    turn = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    turned = BodyArm(body.arm, body.hand_m, body.facing_rad - 0.5 * np.pi, body.side)
    rotated = (start.reshape(2, 3) @ turn.T).ravel()
    again = optimal_path(turned, Geometry(rotated, turn @ tip), 1.0, ALPHA, CHAPTER_2, 0.04)
    expected = (path.values.reshape(-1, 2, 3) @ turn.T).reshape(-1, 6)
    np.testing.assert_allclose(again.values, expected, atol=1e-4)


def test_where_the_hand_is_already_is_no_reach(body, rest):
    start = (rest.points[1:3] - rest.points[0]).ravel()
    with pytest.raises(DataError, match="a reach of 4 cm or more"):
        straight_path(body, Geometry(start, rest.points[3] - rest.points[0]), 1.0, 0.04)


def test_lengths_are_measured(body, rest, rng):
    points = rest.points + rng.normal(0.0, 0.002, (200, 4, 3))
    points[::3, 3] = np.nan
    found = BodyArm.measured(points, "right", body.facing_rad, 0.07)
    assert found.arm.upper_m == pytest.approx(body.arm.upper_m, abs=0.002)
    assert found.arm.forearm_m == pytest.approx(body.arm.forearm_m, abs=0.002)
    assert found.hand_m == pytest.approx(0.09, abs=0.002)
    points[:, 3] = np.nan
    assert BodyArm.measured(points, "right", 0.0, 0.07).hand_m == 0.07
    with pytest.raises(DataError, match="never seen together"):
        BodyArm.measured(np.full((5, 4, 3), np.nan), "right", 0.0, 0.07)


def test_people_face_their_targets():
    shoulder = np.array([0.7, 0.0, 0.4])
    targets = np.array([[0.3, 0.2, 0.2], [0.4, -0.1, 0.2]])
    assert abs(facing_towards(shoulder, targets)) == pytest.approx(np.pi)


def test_the_page_has_all_that_is_taken_for_granted():
    page = Path(__file__).parents[3] / "docs" / "hybrid.md"
    lines = [line for line in page.read_text().splitlines() if line.startswith("| `guess.")]
    wanted = []
    for field in dataclasses.fields(HybridConfig):
        unit = f" {field.metadata['unit']}" if field.metadata["unit"] else ""
        doc = field.metadata["doc"]
        wanted.append(f"| `guess.{field.name}` | {field.default:g}{unit} | {doc} |")
    assert [line for line in lines if "`guess.*`" not in line] == wanted
