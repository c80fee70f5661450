"""Compiled stretches are what hand and joints do step by step."""

from dataclasses import replace

import numpy as np
import pytest

from hri_planner.policy.partner import Partner
from hri_planner.policy.runner import PolicyRunner
from hri_planner.policy.separation import NO_BOXES, SeparationConfig
from hri_planner.policy.stretch import STRAYED_M, Limits, stretch
from hri_planner.policy.tool_velocity import ToolVelocity, ToolVelocityConfig
from hri_planner.rnn.model_file import find_policy, load_policy, shipped_policies
from hri_planner.robot.model import load_robot

DT = 0.004
ROBOT = load_robot()
START = np.array((-0.8847, -0.4889, 0.0, 1.6675, 0.0, -0.8601, 0.0))
GOAL = np.array((0.331, 0.406, 0.322))
ARM = np.array(((0.9, 0.0, 0.4), (0.7, 0.1, 0.2), (0.6, 0.05, 0.2), (0.45, 0.1, 0.3)))
TOWARDS = np.array(((0.0, 0.0, 0.0), (-0.2, 0.1, 0.0), (-0.5, 0.2, 0.1), (-0.8, 0.3, 0.1)))
WHOLE = Partner(ARM[3], TOWARDS[3], 0.03, ARM, TOWARDS)
APART = SeparationConfig(0.2)
HAND = Partner(np.array((0.3, -0.3, 0.4)), np.array((0.1, 0.3, -0.1)), 0.05)


@pytest.mark.parametrize("partners", [[], [WHOLE], [HAND], [WHOLE, HAND]])
@pytest.mark.parametrize("limits", [
    Limits(APART, True, None), Limits(APART, True, 0.42), Limits(APART, False, 0.42),
])  # fmt: skip
def test_it_is_the_runner_and_the_inverse_by_turns(
    partners: list[Partner], limits: Limits, monkeypatch: pytest.MonkeyPatch
) -> None:
    # The runner knows no links; these have tests of their own.
    monkeypatch.setattr(Limits, "link_boxes", NO_BOXES)
    policy = load_policy(find_policy(shipped_policies()[0]))
    apart = limits.separation if limits.apart else None
    runner = PolicyRunner(policy, apart, DT, limits.floor)
    inverse = ToolVelocity(ROBOT, ToolVelocityConfig())
    hand = runner.begin(inverse.tool(START), (0.2, 0.3, -0.2))
    q, qd = START, np.zeros(7)
    acted = 0
    for begin in range(0, 96, 8):
        known = [partner.later(begin * DT) for partner in partners]
        wanted, memory = runner.asked(hand, GOAL, known)
        moved = stretch(hand.position, hand.velocity, wanted, q, qd, known, 8, DT, limits, inverse)
        told = runner.after(hand, moved, wanted, memory)
        nearest = np.inf
        for step in range(8):
            later = [partner.later(step * DT) for partner in known]
            nearest = min([nearest, *(partner.distance(hand.position) for partner in later)])
            hand = runner.step(hand, GOAL, later)
            new = inverse.joint_speeds(q + qd * DT, qd, hand.position, hand.velocity, DT)
            q = np.clip(q + 0.5 * DT * (qd + new), ROBOT.lower, ROBOT.upper)
            qd = new
            tool, velocity = inverse.tool_motion(q, qd)
            strayed = np.linalg.norm(tool - hand.position) > STRAYED_M
            assert moved.strayed[step] == strayed
            if strayed:
                hand = replace(hand, position=tool, velocity=velocity)
            for name in ("position", "velocity", "acceleration", "memory", "wanted"):
                np.testing.assert_allclose(
                    getattr(told[step], name), getattr(hand, name), rtol=0.0, atol=1e-6
                )
            assert (told[step].filtered, told[step].count) == (hand.filtered, hand.count)
            np.testing.assert_allclose(moved.q[step], q, atol=1e-7)
            np.testing.assert_allclose(moved.qd[step], qd, atol=1e-6)
            acted += hand.filtered
        assert moved.nearest == pytest.approx(nearest)
    if limits.floor is not None or (limits.separation is not None and partners):
        assert acted


def test_a_hand_that_the_joints_cannot_follow_is_put_back_to_the_tool() -> None:
    inverse = ToolVelocity(ROBOT, ToolVelocityConfig())
    begin = inverse.tool(START)
    fast = np.array((0.0, 3.0, 0.0))
    moved = stretch(
        begin, fast, np.zeros(3), START, np.zeros(7), [], 8, DT, Limits(APART, False, None), inverse
    )
    assert moved.strayed.any()
    first = int(np.argmax(moved.strayed))
    tool, velocity = inverse.tool_motion(moved.q[first], moved.qd[first])
    assert moved.position[first] == pytest.approx(tool)
    assert moved.velocity[first] == pytest.approx(velocity)


@pytest.mark.parametrize("apart", [False, True])
def test_the_largest_acceleration_holds_with_and_without_a_filter(apart: bool) -> None:
    inverse = ToolVelocity(ROBOT, ToolVelocityConfig())
    limits = Limits(SeparationConfig(0.2, hand_acceleration=5.0), apart, None)
    moved = stretch(
        inverse.tool(START), np.zeros(3), np.array((0.0, 20.0, 0.0)), START, np.zeros(7), [], 4, DT,
        limits, inverse,
    )  # fmt: skip
    np.testing.assert_allclose(moved.acceleration, np.tile((0.0, 5.0, 0.0), (4, 1)), atol=1e-9)
    assert not moved.filtered.any()
