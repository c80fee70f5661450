"""Links of the robot stop before boxes, whatever the tool wants."""

import numpy as np
import pytest

from hri_planner.policy.link_bounds import LINKS, box_clearance, link_bounds
from hri_planner.policy.separation import NO_BOXES, SeparationConfig
from hri_planner.policy.stretch import Limits, stretch
from hri_planner.policy.tool_velocity import ToolVelocity, ToolVelocityConfig
from hri_planner.robot.kinematics import tool_jacobian
from hri_planner.robot.model import load_robot

ROBOT = load_robot()
DT, MARGIN = 0.004, 0.02
START = np.array((-0.4414, -0.4035, -0.4182, 1.8368, -0.1328, -0.7231, 0.0))
INVERSE = ToolVelocity(ROBOT, ToolVelocityConfig(), START)
REST = np.zeros(3)
UPPER, LOWER, HAND = (float(radius) for radius in ROBOT.capsule_radii)


def limits(boxes=NO_BOXES, floor=None) -> Limits:
    return Limits(
        SeparationConfig(),
        True,
        floor,
        boxes,
        HAND + MARGIN,
        tool_radius=HAND,
        link_radii=(UPPER, LOWER),
    )


def way(aim: np.ndarray, kept: Limits, steps: int = 600) -> np.ndarray:
    """Joints (n, 7) of a robot whose tool is drawn to a place."""
    q, qd = START, np.zeros(7)
    place, speed, joints = INVERSE.tool(START), REST, [START[None]]
    for _ in range(0, steps, 8):
        wanted = 25.0 * (aim - place) - 8.0 * speed
        moved = stretch(place, speed, wanted, q, qd, [], 8, DT, kept, INVERSE)
        place, speed, q, qd = moved.position[-1], moved.velocity[-1], moved.q[-1], moved.qd[-1]
        joints.append(moved.q)
    return np.concatenate(joints)


def beside(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """A post (1, 2, 3) that lower arm or hand sweep into, and where the tool is drawn."""
    rng = np.random.default_rng(seed)
    frames = ROBOT.frames(START)
    place = frames[1] + rng.uniform(0.3, 0.9) * (frames[3] - frames[1])
    side = rng.choice((-1.0, 1.0))
    post = np.array((place + np.array((0.0, side * 0.25, -0.1)), (0.03, 0.03, 0.25)))
    aim = frames[3] + np.array((rng.uniform(-0.1, 0.1), side * 0.5, rng.uniform(-0.1, 0.1)))
    return post[None], aim


@pytest.mark.parametrize("seed", range(12))
def test_links_stop_before_a_box_that_they_would_sweep_into(seed: int) -> None:
    post, aim = beside(seed)
    assert box_clearance(ROBOT, START[None], post) > MARGIN
    free = way(aim, limits())
    kept = way(aim, limits(post))
    assert box_clearance(ROBOT, free, post) < 0.0, "else it shows nothing"
    assert box_clearance(ROBOT, kept, post) >= 0.5 * MARGIN
    assert np.abs(np.diff(kept, axis=0)).max() > 1e-4, "and it does move"


def test_the_wrist_stays_above_the_floor_where_the_tool_would_rise_and_it_would_sink() -> None:
    floor = 0.25
    kept = way(np.array((0.45, -0.3, 0.27)), limits(floor=floor), 800)
    frames = np.array([ROBOT.frames(q) for q in kept])
    assert frames[:, 3, 2].min() >= floor - 1e-4
    assert frames[:, 2, 2].min() >= floor + LOWER - HAND - 1e-3


def bounds_of(q: np.ndarray, qd: np.ndarray, boxes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    count = LINKS * len(boxes)
    outward, least = np.empty((count, 3)), np.empty(count)
    margins = np.array((UPPER, LOWER, HAND)) + MARGIN
    link_bounds(q, qd, ROBOT.lengths, boxes, margins, DT, 8.0, 8.0, outward, least)
    return outward, least


@pytest.mark.parametrize("seed", range(10))
def test_along_the_bound_the_tool_takes_the_link_away_from_the_box(seed: int) -> None:
    """A step of the tool along `outward`, by the joints, makes the distance larger: finite differences."""
    rng = np.random.default_rng(seed)
    frames = ROBOT.frames(START)
    place = frames[1] + rng.uniform(0.5, 0.9) * (frames[2] - frames[1])
    out = rng.standard_normal(3)
    out -= (
        out
        @ (frames[2] - frames[1])
        * (frames[2] - frames[1])
        / np.sum((frames[2] - frames[1]) ** 2)
    )
    box = np.array(((place + 0.2 * out / np.linalg.norm(out), (0.02, 0.02, 0.02)),))
    outward, least = bounds_of(START, np.zeros(7), box)
    assert np.isfinite(least[1])
    jacobian, place, radius = np.empty((3, 7)), np.empty(3), LOWER
    tool_jacobian(START, ROBOT.lengths, place, jacobian)
    step = 1e-4 * np.linalg.pinv(jacobian) @ outward[1]

    def gap(q: np.ndarray) -> float:
        first, second = ROBOT.frames(q)[1:3]
        shares = np.linspace(0.0, 1.0, 4001)[:, None]
        off = np.abs(first + shares * (second - first) - box[0, 0]) - box[0, 1]
        return float(np.linalg.norm(np.maximum(off, 0.0), axis=1).min()) - radius

    assert gap(START + step) > gap(START - step) + 1e-5


def test_a_link_that_is_too_near_is_only_kept_from_coming_nearer() -> None:
    frames = ROBOT.frames(START)
    middle = 0.5 * (frames[1] + frames[2])
    box = np.array(((middle + np.array((0.0, 0.0, -0.12)), (0.05, 0.05, 0.05)),))
    assert box_clearance(ROBOT, START[None], box) < MARGIN
    _, least = bounds_of(START, np.zeros(7), box)
    assert (least[np.isfinite(least)] <= 1e-9).all()
    still = way(INVERSE.tool(START), limits(box), 80)
    assert np.abs(still - START).max() < 1e-6


def test_what_is_far_and_nothing_at_all_ask_for_nothing() -> None:
    far = np.array(((3.0, 3.0, 0.0), (0.1, 0.1, 0.1)))[None]
    assert (bounds_of(START, np.zeros(7), far)[1] == -np.inf).all()
    assert len(bounds_of(START, np.zeros(7), NO_BOXES)[1]) == 0
    assert box_clearance(ROBOT, START[None], NO_BOXES) == np.inf
