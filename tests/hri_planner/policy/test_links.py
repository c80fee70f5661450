"""The robot's arm gives way to people, as far as the tool's motion lets it, and never wildly."""

import numpy as np
import pinocchio
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hri_planner.dmp.drive import Drive, begin
from hri_planner.dmp.potential_field import FieldConfig
from hri_planner.dmp.response import response
from hri_planner.policy.config import PolicyConfig
from hri_planner.policy.links import ARM_LINKS, away_from_limbs
from hri_planner.policy.partner import Partner
from hri_planner.policy.planner import limits_of
from hri_planner.policy.stretch import Moved, stretch
from hri_planner.policy.tool_velocity import AWAY_DAMPING_M, ToolVelocity, ToolVelocityConfig
from hri_planner.robot.ik import solve_ik
from hri_planner.robot.kinematics import point_jacobian
from hri_planner.robot.model import load_robot
from hri_prediction.geometry.segments import capsule_distances

DT, DURATION = 0.004, 2.5
ROBOT = load_robot()
LIMBS = np.array((0.05, 0.04, 0.05))
RADII = ROBOT.capsule_radii[:ARM_LINKS, None] + LIMBS
REACH, GAIN = 0.12, 4.0
POSTURE = np.array((0.0, -0.1376, 0.0, 1.9745, 0.0, -1.0, 0.0))
GOAL = np.array((0.62, 0.0, 0.12))
STILL = np.zeros(7)


def jacobian(q: np.ndarray, link: int = 2, share: float = 1.0) -> np.ndarray:
    found = np.empty((3, 7))
    point_jacobian(q, ROBOT.lengths, link, share, np.empty(3), found)
    return found


def inverse(posture: np.ndarray = POSTURE) -> ToolVelocity:
    return ToolVelocity(ROBOT, ToolVelocityConfig(), posture)


def configurations(count: int, seed: int = 7, share: float = 1.0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return rng.uniform(share * ROBOT.lower, share * ROBOT.upper, (count, 7))


@pytest.mark.parametrize("link", [0, 1, 2])
@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
def test_points_of_links_move_as_their_jacobian_says(link: int, share: float) -> None:
    step, point, found = 1e-6, np.empty(3), np.empty((3, 7))

    def place(q: np.ndarray) -> np.ndarray:
        points = ROBOT.frames(q)
        return (1.0 - share) * points[..., link, :] + share * points[..., link + 1, :]

    for q in configurations(50):
        point_jacobian(q, ROBOT.lengths, link, share, point, found)
        np.testing.assert_allclose(point, place(q), atol=1e-14)
        slope = (place(q + step * np.eye(7)) - place(q - step * np.eye(7))).T / (2.0 * step)
        np.testing.assert_allclose(found, slope, atol=1e-8)


def test_ends_of_links_agree_with_pinocchio() -> None:
    model = pinocchio.buildModelFromXML(ROBOT.urdf_text)
    data = model.createData()
    for q in configurations(50):
        pinocchio.computeJointJacobians(model, data, q)
        pinocchio.updateFramePlacements(model, data)
        for link, name in enumerate(("lwr_link_4", "lwr_link_6", "lwr_tool")):
            there = pinocchio.getFrameJacobian(
                model, data, model.getFrameId(name), pinocchio.ReferenceFrame.LOCAL_WORLD_ALIGNED
            )
            np.testing.assert_allclose(jacobian(q, link), there[:3], atol=1e-12)


def clearance(q: np.ndarray, joints: np.ndarray) -> float:
    """Between the robot's upper and lower arm and all limbs (p, 4, 3)."""
    limbs = np.stack((joints[:, :-1], joints[:, 1:]), axis=2).reshape(-1, 2, 3)
    arm = ROBOT.robot_capsules(q)[:ARM_LINKS]
    wide = np.tile(LIMBS, len(joints))
    return float(capsule_distances(arm, ROBOT.capsule_radii[:ARM_LINKS], limbs, wide).min())


def away(q: np.ndarray, joints: np.ndarray, speeds: np.ndarray | None = None, reach: float = REACH):
    row = np.full(7, np.nan)
    moving = np.zeros_like(joints) if speeds is None else speeds
    grown = away_from_limbs(q, ROBOT.lengths, joints, moving, RADII, reach, GAIN, row)
    return row, grown


def people_near(q: np.ndarray, rng: np.random.Generator, count: int = 1) -> np.ndarray:
    """Arms somewhere around the robot's elbow."""
    around = ROBOT.frames(q)[1] + rng.normal(0.0, 0.15, (count, 1, 3))
    return around + rng.normal(0.0, 0.15, (count, 4, 3))


@pytest.mark.parametrize("count", [1, 2])
def test_the_distance_changes_as_its_row_says(count: int) -> None:
    rng, step, tried = np.random.default_rng(0), 1e-6, 0
    for q in configurations(150, 1):
        joints = people_near(q, rng, count)
        distance = clearance(q, joints)
        row, grown = away(q, joints)
        if distance >= REACH:
            assert grown == 0.0
            assert (row == 0.0).all()
            continue
        assert grown == pytest.approx(GAIN * (REACH - distance))
        if distance < -0.08:
            continue  # next to axes that cross, it is as well on the other side
        slopes = [
            (clearance(q + step * e, joints) - clearance(q - step * e, joints)) / (2.0 * step)
            for e in np.eye(7)
        ]
        halves = [(clearance(q + step * e, joints) - distance) / step for e in np.eye(7)]
        if not np.allclose(slopes, halves, atol=1e-4):
            continue  # two pairs of limbs are as near as each other
        np.testing.assert_allclose(row, slopes, atol=1e-5)
        tried += 1
    assert tried > 40


def test_who_comes_is_given_way_to_sooner_and_who_goes_is_not_followed() -> None:
    q = POSTURE
    side = ROBOT.frames(q)[1] + np.array((0.0, 0.2, 0.0))
    joints = side + np.array(((0.0, 0.3, 0.3), (0.0, 0.2, 0.1), (0.0, 0.1, 0.0), (0.0, 0.0, 0.0)))
    joints = joints[None]
    row, rests = away(q, joints)
    assert 0.0 < rests < GAIN * REACH
    missing = 1.0 - clearance(q, joints) / REACH
    for speed, wanted in ((-0.3, missing * 0.3), (0.3, 0.0)):
        again, grown = away(q, joints, np.full((1, 4, 3), (0.0, speed, 0.0)))
        np.testing.assert_array_equal(again, row)
        assert grown - rests == pytest.approx(wanted, rel=0.05)
    # Farther than it reaches, nobody is given way to.
    assert away(q, joints, reach=0.05)[1] == 0.0
    assert away(q, joints, reach=0.0)[1] == 0.0


def test_hands_alone_and_touching_axes_break_nothing() -> None:
    assert away(POSTURE, np.zeros((0, 4, 3)))[1] == 0.0
    assert away(POSTURE, np.zeros((1, 1, 3)))[1] == 0.0
    elbow = ROBOT.frames(POSTURE)[1]
    for joints in (np.tile(elbow, (1, 4, 1)), np.tile(ROBOT.frames(POSTURE)[:2], (1, 2, 1))):
        row, grown = away(POSTURE, joints)
        assert np.isfinite(row).all()
        assert np.isfinite(grown)


LONG = 0.1
"""So long a step that no acceleration is at its limit [s]."""


def bent(rng: np.random.Generator) -> np.ndarray:
    """Far from all limits and from a stretched arm."""
    while True:
        q = rng.uniform(0.5 * ROBOT.lower, 0.5 * ROBOT.upper)
        if np.linalg.svd(jacobian(q))[1][2] > 0.2:
            return q


@pytest.mark.parametrize("seed", range(30))
def test_giving_way_leaves_the_tool_as_it_was(seed: int) -> None:
    rng = np.random.default_rng(seed)
    q, robot = bent(rng), inverse()
    velocity, row = rng.normal(0.0, 0.05, 3), rng.normal(0.0, 0.3, 7)
    without = robot.joint_speeds(q, STILL, robot.tool(q), velocity, LONG)
    asked = max(float(row @ without), 0.0) + 0.05
    found = robot.joint_speeds(q, STILL, robot.tool(q), velocity, LONG, (row, asked))
    np.testing.assert_allclose(jacobian(q) @ found, velocity, atol=1e-9)
    np.testing.assert_allclose(jacobian(q) @ without, velocity, atol=1e-9)
    # What the null space has of it is made up but for the damping.
    assert row @ without < row @ found <= asked + 1e-9
    free = row @ (np.eye(7) - np.linalg.pinv(jacobian(q)) @ jacobian(q))
    missing, size = asked - row @ without, free @ free
    assert row @ (found - without) == pytest.approx(missing * size / (size + AWAY_DAMPING_M**2))
    # One-sided: where the distance grows so fast anyhow, nothing is added.
    for less in (row @ without, row @ without - 0.3):
        again = robot.joint_speeds(q, STILL, robot.tool(q), velocity, LONG, (row, float(less)))
        np.testing.assert_allclose(again, without, atol=1e-12)


@settings(max_examples=200, deadline=None)
@given(seed=st.integers(0, 2**31), asked=st.floats(0.0, 1.5))
def test_giving_way_never_costs_the_tool_its_motion(seed: int, asked: float) -> None:
    """Not even when joints are at their limits of speed and acceleration because of it."""
    rng = np.random.default_rng(seed)
    q, robot = bent(rng), inverse()
    velocity, row = rng.normal(0.0, 0.1, 3), rng.normal(0.0, 0.3, 7)
    before = np.linalg.pinv(jacobian(q)) @ velocity
    without = robot.joint_speeds(q, before, robot.tool(q), velocity, DT)
    if np.linalg.norm(jacobian(q) @ without - velocity) > 1e-9:
        return
    found = robot.joint_speeds(q, before, robot.tool(q), velocity, DT, (row, asked))
    np.testing.assert_allclose(jacobian(q) @ found, velocity, atol=1e-6)


def test_a_robot_at_rest_gives_way_and_its_tool_stays() -> None:
    robot = inverse()
    q, tool, speeds = POSTURE, inverse().tool(POSTURE), STILL
    side = ROBOT.frames(q)[1] + np.array((0.02, 0.17, 0.0))
    joints = (side + np.array(((0, 0.3, 0.3), (0, 0.2, 0.1), (0, 0.1, 0), (0, 0, 0))))[None]
    gaps = [clearance(q, joints)]
    for _ in range(500):
        speeds = robot.joint_speeds(q, speeds, tool, np.zeros(3), DT, away(q, joints))
        q = q + DT * speeds
        gaps.append(clearance(q, joints))
        assert np.linalg.norm(robot.tool(q) - tool) < 1e-4
    assert gaps[0] < 0.07
    assert gaps[-1] > gaps[0] + 0.01
    assert min(gaps) >= gaps[0] - 1e-6
    assert max(gaps) < REACH + 0.01
    assert np.abs(speeds).max() < 0.1, "and comes to rest"


def literal(q: np.ndarray, velocity: np.ndarray, row: np.ndarray, asked: float) -> np.ndarray:
    """Equation 7.18 as it is written, of one obstacle point along the normal, undamped."""
    own = jacobian(q)
    pseudo = np.linalg.pinv(own)
    free = row @ (np.eye(7) - pseudo @ own)
    return pseudo @ velocity + free / (free @ free) * (asked - row @ pseudo @ velocity)


@pytest.mark.parametrize("beside", [1e-12, 1e-9, 1e-6, 1e-4, 1e-3])
@pytest.mark.parametrize("seed", range(5))
def test_where_the_tool_decides_the_distance_it_does_not_explode(seed: int, beside: float) -> None:
    """The row of the distance is next to those of the tool: the arm can only give way with the tool."""
    rng = np.random.default_rng(seed)
    q, robot = bent(rng), inverse()
    own = jacobian(q)
    free = np.linalg.svd(own)[2][3:6]
    row = rng.normal(0.0, 1.0, 3) @ own + beside * free[0]
    velocity = rng.normal(0.0, 0.05, 3)
    asked = float(row @ np.linalg.pinv(own) @ velocity) + 0.4
    assert np.abs(literal(q, velocity, row, asked)).max() > 0.1 * 0.4 / beside
    found = robot.joint_speeds(q, STILL, robot.tool(q), velocity, LONG, (row, asked))
    assert np.abs(found).max() <= 2.0
    np.testing.assert_allclose(own @ found, velocity, atol=1e-9)


def bell(start: np.ndarray, goal: np.ndarray, duration: float) -> np.ndarray:
    """Weights of a minimum-jerk motion."""
    motion = response(duration, DT)
    u = np.minimum(motion.times / duration, 1.0)
    way = u**3 * (10.0 + u * (-15.0 + 6.0 * u))
    return motion.fit(start + way[:, None] * (goal - start))


def followed(
    q: np.ndarray, goal: np.ndarray, people: list[Partner], duration: float, *, reach: float = REACH
) -> tuple[Moved, float]:
    """Joints along a way that nothing but the arm's giving way interferes with, and the tool's error."""
    config = PolicyConfig(filter=False, link_reach=reach)
    robot = inverse(q)
    begun = robot.tool(q)
    weights = bell(begun, goal, duration)
    drive = Drive.of(goal, duration, weights, FieldConfig(strength=0.0))
    steps = round(duration / DT)
    moved = stretch(
        begun, np.zeros(3), drive, q, STILL, people, steps, DT,
        limits_of(ROBOT, config, floor=None), robot, begin(begun),
    )  # fmt: skip
    path = response(duration, DT).rollouts(begun, goal, weights)[1:]
    tools = ROBOT.frames(moved.q)[:, 3]
    return moved, float(np.linalg.norm(tools - path, axis=1).max())


def standing(joints: np.ndarray, velocity=(0.0, 0.0, 0.0)) -> Partner:
    speeds = np.tile(velocity, (4, 1))
    return Partner(joints[-1], speeds[-1], 0.0, joints, speeds)


SIDES = ((0.05, 0.17, 0.0), (0.0, -0.16, 0.05), (0.0, 0.0, 0.18), (0.1, 0.1, -0.12))
ARM = np.array(((0.3, 0.3, 0.2), (0.1, 0.1, 0.1), (0.02, 0.02, 0.0), (0.0, 0.0, 0.0)))


@pytest.mark.parametrize("side", [None, *SIDES])
@pytest.mark.parametrize("azimuth", [0.0, 0.8])
@pytest.mark.parametrize("share", [0.9, 0.98])
def test_stretched_arms_are_neither_fast_nor_off_their_way(share, azimuth, side) -> None:
    """To 98 % of its reach, where a singular value is below what is damped; past an arm that stands."""
    way = np.array((0.9 * np.cos(azimuth), 0.9 * np.sin(azimuth), 0.2))
    way /= np.linalg.norm(way)
    seed = np.array((0.0, -0.4, 0.0, 1.4, 0.0, -0.8, 0.0))
    q = solve_ik(ROBOT, ROBOT.shoulder + 0.6 * way, seed, np.random.default_rng(0))
    goal = ROBOT.shoulder + share * ROBOT.reach * way
    people = [] if side is None else [standing(ROBOT.frames(q)[1] + side + ARM)]
    moved, error = followed(q, goal, people, 3.0)
    assert not moved.strayed.any()
    assert np.abs(moved.qd).max() <= 2.0
    assert error <= 1e-3
    assert ROBOT.within_limits(moved.q, 1e-9)
    last = np.linalg.svd(jacobian(moved.q[-1]))[1][2]
    assert last < (0.25 if share == 0.9 else 0.10)


def beside_the_arm() -> list[tuple[np.ndarray, tuple[float, ...]]]:
    """Arms that do not touch the robot's, standing or coming slowly."""
    rng, found = np.random.default_rng(0), []
    while len(found) < 8:
        joints = ROBOT.frames(POSTURE)[1] + rng.normal(0.0, 0.12, 3) + rng.normal(0.0, 0.15, (4, 3))
        if 0.01 < clearance(POSTURE, joints[None]) < 0.1:
            velocity = rng.normal(0.0, 0.05, 3) if len(found) % 2 else np.zeros(3)
            found.append((joints, tuple(velocity)))
    return found


@pytest.mark.parametrize(("joints", "velocity"), beside_the_arm())
def test_past_arms_beside_the_elbow_the_tool_keeps_to_its_way(joints, velocity) -> None:
    moved, error = followed(POSTURE, GOAL, [standing(joints, velocity)], DURATION)
    assert not moved.strayed.any()
    assert error <= 1e-3
    assert np.abs(moved.qd).max() <= 2.0


def test_the_arm_keeps_farther_from_people_than_without() -> None:
    gained = []
    for joints, velocity in beside_the_arm():
        gaps = []
        for reach in (0.0, REACH):
            moved, _ = followed(POSTURE, GOAL, [standing(joints, velocity)], DURATION, reach=reach)
            now = [
                clearance(q, (joints + DT * step * np.array(velocity))[None])
                for step, q in enumerate(moved.q)
            ]
            gaps.append(np.mean(np.minimum(now, REACH)))
        gained.append(gaps[1] - gaps[0])
    assert np.mean(gained) > 0.002
    assert min(gained) > -0.005


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 2**31), gain=st.floats(0.0, 20.0), reach=st.floats(0.05, 0.5))
def test_limits_hold_whatever_is_near(seed: int, gain: float, reach: float) -> None:
    rng = np.random.default_rng(seed)
    q, qd = rng.uniform(ROBOT.lower, ROBOT.upper), np.zeros(7)
    robot = inverse()
    joints = people_near(q, rng, 2)
    speeds = rng.normal(0.0, 0.5, (2, 4, 3))
    people = [Partner(j[-1], s[-1], 0.0, j, s) for j, s in zip(joints, speeds, strict=True)]
    config = PolicyConfig(filter=False, link_reach=reach, link_gain=gain)
    moved = stretch(
        robot.tool(q), np.zeros(3), rng.normal(0.0, 2.0, 3), q, qd, people, 60, DT,
        limits_of(ROBOT, config, floor=None), robot,
    )  # fmt: skip
    assert np.isfinite(moved.q).all()
    assert ROBOT.within_limits(moved.q, 1e-9)
    assert (np.abs(moved.qd) <= 0.9 * ROBOT.velocity + 1e-9).all()
    before = np.concatenate((qd[None], moved.qd[:-1]))
    assert (np.abs(moved.qd - before) <= 25.0 * DT + 1e-9).all()


def test_whose_arm_is_not_known_is_not_given_way_to() -> None:
    hand = Partner(ROBOT.frames(POSTURE)[1] + 0.1, np.zeros(3))
    moved, error = followed(POSTURE, GOAL, [hand], DURATION)
    alone, _ = followed(POSTURE, GOAL, [], DURATION)
    np.testing.assert_allclose(moved.q, alone.q, atol=1e-12)
    assert error <= 1e-3


def test_without_reach_links_do_not_give_way() -> None:
    joints, velocity = beside_the_arm()[0]
    moved, _ = followed(POSTURE, GOAL, [standing(joints, velocity)], DURATION, reach=0.0)
    alone, _ = followed(POSTURE, GOAL, [], DURATION, reach=0.0)
    np.testing.assert_allclose(moved.q, alone.q, atol=1e-12)


def test_free_joints_go_to_the_posture_as_the_tool_moves() -> None:
    """From beside it they come nearer; those that begin there stay near."""
    aside = POSTURE.copy()
    for _ in range(40):
        free = np.linalg.svd(jacobian(aside))[2][3:6]
        aside = aside + 0.01 * free.T @ free @ np.array((1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0))
    aside = solve_ik(ROBOT, inverse().tool(POSTURE), aside, np.random.default_rng(0))
    begun, ends = np.abs(aside - POSTURE).max(), {}
    for name, posture in (("there", aside), ("beside", POSTURE)):
        robot = inverse(posture)
        start, q, speeds = robot.tool(aside), aside, STILL
        for step in range(2000):
            angle = np.pi * step * DT
            place = start + 0.05 * np.array((np.cos(angle) - 1.0, np.sin(angle), 0.0))
            going = 0.05 * np.pi * np.array((-np.sin(angle), np.cos(angle), 0.0))
            speeds = robot.joint_speeds(q, speeds, place, going, DT)
            q = q + DT * speeds
        ends[name] = np.abs(q - posture).max()
    assert begun > 0.2
    assert ends["beside"] < 0.6 * begun
    assert ends["there"] < 0.6 * begun
