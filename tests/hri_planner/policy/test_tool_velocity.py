"""Joint speeds that give the tool a velocity."""

import numpy as np
import pytest

from hri_planner.policy.rest import LIMIT_MARGIN
from hri_planner.policy.tool_velocity import ToolVelocity, ToolVelocityConfig
from hri_planner.robot.kinematics import tool_jacobian
from hri_planner.robot.model import load_robot

DT = 0.004
BENT = np.array((0.1, 0.7, 0.2, -1.4, 0.1, 0.6, 0.0))


def follow(q: np.ndarray, path, steps: int) -> tuple[np.ndarray, float, float]:
    """Joint angles, the largest tool error on the way [m], and the largest joint speed [rad/s]."""
    inverse = ToolVelocity(load_robot(), ToolVelocityConfig())
    worst = fastest = 0.0
    speeds = np.zeros(7)
    for step in range(steps):
        position, velocity = path(step * DT)
        speeds = inverse.joint_speeds(q, speeds, position, velocity, DT)
        q = q + speeds * DT
        fastest = max(fastest, float(np.abs(speeds).max()))
        worst = max(worst, float(np.linalg.norm(inverse.tool(q) - path((step + 1) * DT)[0])))
    return q, worst, fastest


def test_a_path_is_followed_to_a_millimetre() -> None:
    start = ToolVelocity(load_robot(), ToolVelocityConfig()).tool(BENT)

    def path(time: float) -> tuple[np.ndarray, np.ndarray]:
        angle = 2.0 * time
        offset = 0.1 * np.array((np.cos(angle) - 1.0, np.sin(angle), 0.0))
        return start + offset, 0.2 * np.array((-np.sin(angle), np.cos(angle), 0.0))

    _, worst, fastest = follow(BENT, path, 800)
    assert worst <= 1e-3
    assert fastest <= 2.0


def test_limits_hold_where_the_path_leads_out_of_reach() -> None:
    robot = load_robot()
    start = ToolVelocity(robot, ToolVelocityConfig()).tool(BENT)
    q, _, fastest = follow(
        BENT, lambda t: (start + np.array((0.4, 0.0, 0.4)) * t, np.array((0.4, 0.0, 0.4))), 1000
    )
    assert robot.within_limits(q, 1e-9)
    assert fastest <= 0.9 * robot.velocity.max() + 1e-9


@pytest.mark.parametrize("seed", range(8))
def test_random_ways_stay_within_limits(seed: int) -> None:
    robot, rng = load_robot(), np.random.default_rng(seed)
    inverse = ToolVelocity(robot, ToolVelocityConfig())
    q, speeds = rng.uniform(robot.lower, robot.upper), np.zeros(7)
    for _ in range(300):
        before = speeds
        speeds = inverse.joint_speeds(q, before, inverse.tool(q), rng.normal(0.0, 1.0, 3), DT)
        assert np.isfinite(speeds).all()
        assert (np.abs(speeds - before) <= 25.0 * DT + 1e-9).all()
        assert (np.abs(speeds) <= 0.9 * robot.velocity + 1e-9).all()
        q = q + speeds * DT
        assert robot.within_limits(q, 1e-9)


@pytest.mark.parametrize("joint", range(7))
@pytest.mark.parametrize("side", ["lower", "upper"])
def test_a_joint_at_its_limit_leaves_the_tool_to_the_others(joint: int, side: str) -> None:
    """It stays where it is or turns back, and never nears the limit."""
    robot = load_robot()
    inverse = ToolVelocity(robot, ToolVelocityConfig())
    q, limit = BENT.copy(), getattr(robot, side)[joint]
    sign = 1.0 if side == "upper" else -1.0
    q[joint] = limit - sign * 1e-3  # nearer than the tool's motion brings it
    jacobian = np.empty((3, 7))
    tool_jacobian(q, robot.lengths, np.empty(3), jacobian)
    # What the joint alone would make of the tool: outwards.
    velocity = 0.1 * sign * jacobian[:, joint] / max(np.linalg.norm(jacobian[:, joint]), 0.05)
    speeds, begun = np.zeros(7), q[joint]
    tool = inverse.tool(q)
    for step in range(100):
        speeds = inverse.joint_speeds(q, speeds, tool + step * DT * velocity, velocity, DT)
        q = q + speeds * DT
        assert sign * (q[joint] - begun) <= 1e-9
    assert robot.within_limits(q)
    if np.linalg.norm(velocity) > 0.01 and joint < 6:
        assert np.linalg.norm(inverse.tool(q) - tool) > 0.02  # the others go on


def test_joints_keep_off_their_limits() -> None:
    robot = load_robot()
    inverse = ToolVelocity(robot, ToolVelocityConfig())
    q, speeds = BENT.copy(), np.zeros(7)
    inwards = robot.frames(q)[0] - inverse.tool(q)
    for _ in range(1500):  # towards the shoulder, until the elbow can bend no more
        speeds = inverse.joint_speeds(q, speeds, inverse.tool(q), 0.2 * inwards, DT)
        q = q + speeds * DT
        assert robot.within_limits(q, LIMIT_MARGIN * -1.0)
    assert abs(q[3]) == pytest.approx(robot.upper[3] - LIMIT_MARGIN, abs=1e-3)


def singular_way(kind: str, seed: int):
    """A smooth motion of the joints through a singular posture: the tool's way, and where it begins."""
    rng = np.random.default_rng(seed)
    first, second, turned, fifth = rng.uniform(-1.0, 1.0, 4)
    if kind == "stretched":
        through = np.array((first, second, turned, 0.0, fifth, 0.0, 0.0))
    else:
        through = np.array((first, 0.0, 0.5 * np.pi, 1.2 + 0.5 * second, fifth, 0.0, 0.0))
    drawn = rng.standard_normal(7)
    travel, seconds = 0.8 * drawn / np.linalg.norm(drawn), 2.5
    robot = load_robot()

    def path(time: float) -> tuple[np.ndarray, np.ndarray]:
        def tool(at: float) -> np.ndarray:
            u = min(max(at / seconds, 0.0), 1.0)
            bell = u**3 * (10.0 + u * (-15.0 + 6.0 * u))
            return robot.frames(through + (bell - 0.5) * travel)[3]

        return tool(time), (tool(time + 1e-4) - tool(time - 1e-4)) / 2e-4

    return path, through - 0.5 * travel


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("kind", ["stretched", "inner"])
def test_through_singular_postures_the_tool_stays_on_its_way_and_joints_are_slow(
    kind: str, seed: int
) -> None:
    path, start = singular_way(kind, seed)
    _, worst, fastest = follow(start, path, 700)
    assert worst <= 1e-3
    assert fastest <= 2.0


@pytest.mark.parametrize("beyond", [0.01, 0.05, 0.15])
def test_beyond_its_reach_the_arm_stands_still_and_it_comes_back(beyond: float) -> None:
    """Neither does it tremble about the stretched posture, nor is it caught there."""
    robot = load_robot()
    q = np.array((0.3, 0.7, 0.2, 0.6, 0.0, 0.3, 0.0))
    shoulder, tool = robot.frames(np.zeros(7))[0], robot.frames(q)[3]
    reach = np.linalg.norm(robot.frames(np.zeros(7))[3] - shoulder)
    length = float(np.linalg.norm(tool - shoulder))
    out = (tool - shoulder) / length
    inverse, speeds = ToolVelocity(robot, ToolVelocityConfig()), np.zeros(7)
    accelerations, seconds = [], np.arange(0.0, 5.0, DT)

    def share(time: float) -> float:
        u = min(max(time / 1.5 if time < 2.0 else (4.0 - time) / 1.5, 0.0), 1.0)
        return u**3 * (10.0 + u * (-15.0 + 6.0 * u))

    for time in seconds:
        far = [
            length + (reach + beyond - length) * share(at)
            for at in (time - 1e-4, time, time + 1e-4)
        ]
        new = inverse.joint_speeds(
            q, speeds, shoulder + far[1] * out, (far[2] - far[0]) / 2e-4 * out, DT
        )
        accelerations.append((new - speeds) / DT)
        speeds, q = new, q + new * DT
    held = np.array(accelerations)[(seconds > 1.7) & (seconds < 2.4)]
    assert np.sqrt(np.mean(np.sum(held**2, axis=1))) < 1.0
    assert np.linalg.norm(inverse.tool(q) - tool) < 1e-3
