"""A robot that moves, and one that is pushed."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hri_sim.faults.own_motion import REST, SETTLE_S, OwnMotion, own_motion

STEP_S = 0.004
SPEED = 0.01
"""What the robot becomes faster towards the person with every state [m/s]."""


def judged(
    joints: list[float], asked: list[float], touches: list[int], *, moving: bool = True
) -> OwnMotion:
    def timed(values: list[float]) -> list[tuple[float, float]]:
        return [(n * STEP_S, float(value)) for n, value in enumerate(values)]

    states = [(n * STEP_S, float(count), SPEED * n) for n, count in enumerate(touches)]
    return own_motion(timed(joints), timed(asked), states, moving=moving)


STOP = [1.0] * 10 + [0.0] * 40


def test_a_robot_that_stops() -> None:
    found = judged(STOP, STOP, [0] * 50)
    assert not found.moves
    assert found.rest_s == 10 * STEP_S
    assert found.touched_moving == found.touched_at_rest == 0


def test_joints_that_swing_after_the_reference_has_stopped_still_move() -> None:
    found = judged([1.0] * 20 + [0.0] * 30, STOP, [0] * 50)
    assert found.rest_s == 20 * STEP_S


def test_a_person_who_leans_on_a_robot_at_rest_does_not_end_its_rest() -> None:
    joints, touches = STOP.copy(), [0] * 50
    joints[29:40] = [0.05] * 11
    touches[30:45] = [2] * 15
    found = judged(joints, STOP, touches)
    assert found.rest_s == 10 * STEP_S
    assert (found.touched_moving, found.touched_at_rest) == (0, 15)


def test_a_robot_that_swings_back_when_it_is_let_go_of_is_still_pushed() -> None:
    joints, touches = STOP.copy(), [0] * 50
    joints[20:24], joints[27:30] = [0.05] * 4, [0.03] * 3
    touches[20:22] = [1] * 2
    assert judged(joints, STOP, touches).rest_s == 10 * STEP_S


def test_a_robot_that_is_pushed_while_it_stops_rests_when_its_reference_has_settled() -> None:
    joints, touches = [1.0] * 10 + [0.3] * 40, [0] * 8 + [1] * 42
    found = judged(joints, STOP, touches)
    assert not found.moves
    assert found.rest_s == pytest.approx(10 * STEP_S + SETTLE_S, abs=1.5 * STEP_S)
    assert found.touched_moving >= 2  # those before it rested count
    assert found.touched_moving + found.touched_at_rest == 42
    # Joints that move by themselves, and those of a robot of whose reference nobody tells, move.
    assert judged(joints, STOP, [0] * 50).moves
    assert own_motion(
        [(n * STEP_S, value) for n, value in enumerate(joints)],
        [],
        [(n * STEP_S, float(count), 0.0) for n, count in enumerate(touches)],
        moving=True,
    ).moves


def test_a_touch_long_ago_is_no_excuse() -> None:
    joints, touches = STOP.copy(), [0] * 50
    touches[14:16] = [1] * 2
    long, quiet = [0.0] * 50, [0] * 50
    found = judged([*joints, *long, *([0.05] * 10)], STOP + [0.0] * 60, touches + quiet + [0] * 10)
    assert found.moves
    assert found.rest_s is None


def test_a_robot_that_nobody_touches_and_that_moves_again_was_not_at_rest() -> None:
    joints = STOP.copy()
    joints[30:35] = [0.05] * 5
    assert judged(joints, STOP, [0] * 50).rest_s == 35 * STEP_S


def test_a_robot_that_is_asked_to_move_moves_whoever_leans_on_it() -> None:
    asked, touches = STOP.copy(), [0] * 50
    asked[30:] = [0.05] * 20
    touches[25:] = [1] * 25
    found = judged(STOP, asked, touches)
    assert found.moves
    assert found.rest_s is None
    assert (found.touched_moving, found.touched_at_rest) == (20, 5)


def test_a_robot_that_touches_before_it_rests_has_touched_while_it_moved() -> None:
    found = judged(STOP, STOP, [0] * 5 + [1] * 10 + [0] * 35)
    assert (found.touched_moving, found.touched_at_rest) == (5, 5)
    # How it came at them counts until it rests.
    np.testing.assert_allclose(found.came_at, 9 * SPEED)


def test_a_robot_that_goes_away_from_whom_it_touches_does_not_come_at_them() -> None:
    states = [(n * STEP_S, 1.0, -0.2) for n in range(5)]
    assert own_motion([], [], states, moving=True).came_at == 0.0


def test_a_robot_at_rest_all_the_time() -> None:
    found = judged([0.0] * 5, [0.0] * 5, [0] * 5, moving=False)
    assert not found.moves
    assert found.rest_s is None


def test_nothing_heard_leaves_it_as_it_was() -> None:
    for moving in (True, False):
        found = own_motion([], [], [(0.0, 1.0, 0.1)], moving=moving)
        assert found.moves is moving
        assert found.touched_moving == moving


@given(st.lists(st.tuples(st.floats(0, 0.1), st.floats(0, 0.1), st.integers(0, 2)), max_size=40))
def test_whatever_happens(moments: list[tuple[float, float, int]]) -> None:
    joints, asked, touches = (
        (list(column) for column in zip(*moments, strict=True)) if moments else ([],) * 3
    )
    found = judged(joints, asked, touches)
    assert found.touched_moving + found.touched_at_rest == int(np.count_nonzero(touches))
    assert found.moves == (found.rest_s is None)
    if not any(touches) and joints:
        # Without people it is what joints and reference say.
        slow = max(joints[-1], asked[-1]) < REST
        assert not slow or not found.moves
