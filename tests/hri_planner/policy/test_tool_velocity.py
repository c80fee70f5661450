"""Joint speeds that give the tool a velocity."""

import numpy as np
import pytest

from hri_planner.policy.tool_velocity import ToolVelocity, ToolVelocityConfig
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
