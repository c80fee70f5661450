"""What a movement primitive says step by step is the motion that a matrix product makes at once."""

import numpy as np
import pytest

from hri_planner.dmp.basis import projected
from hri_planner.dmp.drive import MEMORY, Drive, begin, settled
from hri_planner.dmp.potential_field import FieldConfig
from hri_planner.dmp.response import response
from hri_planner.policy.partner import Partner
from hri_planner.policy.separation import SeparationConfig
from hri_planner.policy.stretch import Limits, Moved, stretch
from hri_planner.policy.tool_velocity import ToolVelocity, ToolVelocityConfig
from hri_planner.robot.model import load_robot

DT, DURATION = 0.004, 2.5
ROBOT = load_robot()
POSTURE = np.array((0.0, -0.1376, 0.0, 1.9745, 0.0, -1.0, 0.0))
START = ROBOT.frames(POSTURE)[3]
GOAL = np.array((0.56, 0.24, 0.12))
FREE = Limits(SeparationConfig(0.15), True, None)
FIELD = FieldConfig()


def gentle(seed: int) -> np.ndarray:
    """Weights of a motion that joints and tool can follow."""
    smooth = np.sin(np.linspace(0.0, np.pi, 20) * np.arange(1, 4)[:, None])
    return 0.03 * np.random.default_rng(seed).standard_normal((3, 3)) @ smooth


def driven(
    weights: np.ndarray, parts: list[int], partners=(), field=FIELD, goal=GOAL, limits=FREE
) -> list[Moved]:
    inverse = ToolVelocity(ROBOT, ToolVelocityConfig(), POSTURE)
    drive = Drive.of(goal, DURATION, weights, field)
    place, speed, memory = START, np.zeros(3), begin(START)
    q, qd, found, done = POSTURE, np.zeros(7), [], 0
    for steps in parts:
        known = [partner.later(done * DT) for partner in partners]
        found.append(stretch(place, speed, drive, q, qd, known, steps, DT, limits, inverse, memory))
        place, speed, memory = (getattr(found[-1], name)[-1] for name in _STATE)
        q, qd, done = found[-1].q[-1], found[-1].qd[-1], done + steps
    return found


_STATE = ("position", "velocity", "memory")


def whole(parts: list[Moved], name: str) -> np.ndarray:
    return np.concatenate([getattr(part, name) for part in parts])


@pytest.mark.parametrize("seed", range(4))
def test_steps_are_the_roll_out_as_long_as_joints_follow(seed: int) -> None:
    weights = gentle(seed)
    parts = driven(weights, [1, 7, 400, 217])
    path = response(DURATION, DT).rollouts(START, GOAL, weights)
    assert not whole(parts, "strayed").any()
    assert not whole(parts, "filtered").any()
    np.testing.assert_allclose(whole(parts, "position"), path[1:], rtol=0.0, atol=1e-6)
    tools = ROBOT.frames(whole(parts, "q"))[:, 3]
    assert np.linalg.norm(tools - path[1:], axis=1).max() < 1e-3
    assert np.linalg.norm(path[:, 2] - path[0, 2]) > 0.0
    np.testing.assert_allclose(
        whole(parts, "memory")[:, 0], np.arange(1, 626) * DT / DURATION, atol=1e-12
    )


def test_after_its_end_a_motion_stays_at_its_goal() -> None:
    parts = driven(gentle(0), [625, 250])
    assert np.linalg.norm(parts[1].position - GOAL, axis=1).max() < 1e-4
    assert np.linalg.norm(parts[1].velocity[-1]) < 1e-4


def test_a_memory_is_where_a_motion_begins_or_rests() -> None:
    assert begin(START).shape == settled(GOAL).shape == (MEMORY,)
    inverse = ToolVelocity(ROBOT, ToolVelocityConfig(), POSTURE)
    drive = Drive.of(START, DURATION, gentle(1), FIELD)
    moved = stretch(
        START, np.zeros(3), drive, POSTURE, np.zeros(7), [], 50, DT, FREE, inverse, settled(START)
    )
    np.testing.assert_allclose(moved.position, np.tile(START, (50, 1)), atol=1e-9)


def test_weights_are_projected_when_a_drive_is_made() -> None:
    weights = np.random.default_rng(2).standard_normal((3, 20))
    np.testing.assert_array_equal(Drive.of(GOAL, 1.0, weights, FIELD).weights, projected(weights))


def arm_at(place: np.ndarray) -> Partner:
    joints = place + np.array(((0.45, 0.1, 0.3), (0.25, 0.05, 0.0), (0.05, 0.02, 0.0), (0, 0, 0)))
    return Partner(place, np.zeros(3), 0.0, joints, np.zeros((4, 3)))


def test_the_field_moves_the_tool_aside_of_an_arm_before_the_filter_must() -> None:
    arm = arm_at(0.5 * (START + GOAL) + (0.02, 0.0, 0.0))
    acted = {}
    for strength in (0.0, 0.1, 0.3):
        parts = driven(np.zeros((3, 20)), [900], [arm], FieldConfig(strength=strength))
        # A grazing curve may take a millimetre of what is kept; see the separation's own tests.
        assert parts[0].nearest >= 0.15 - 1e-3
        acted[strength] = int(parts[0].filtered.sum())
        unlike = parts[0].position[:625] - response(DURATION, DT).rollouts(
            START, GOAL, np.zeros((3, 20))
        )[1:]  # fmt: skip
        assert np.linalg.norm(unlike, axis=1).max() > 0.03
    assert acted[0.3] < acted[0.1] < acted[0.0]


def test_stretches_of_any_length_make_the_same_motion() -> None:
    arm = arm_at(GOAL + np.array((0.3, 0.0, 0.1)))
    comes = Partner(
        arm.position, np.array((-0.1, 0.0, 0.0)), 0.0, arm.joints, np.full((4, 3), (-0.1, 0.0, 0.0))
    )
    one = driven(gentle(3), [480], [comes])
    other = driven(gentle(3), [8] * 60, [comes])
    for name in ("position", "velocity", "q", "qd", "memory"):
        np.testing.assert_allclose(whole(one, name), whole(other, name), atol=1e-9)
