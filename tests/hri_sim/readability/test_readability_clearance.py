"""How near a robot came is what capsules and boxes say."""

import numpy as np
import pytest

from hri_planner.policy.link_bounds import box_clearance
from hri_planner.robot.model import load_robot
from hri_prediction.geometry.segments import capsule_distances
from hri_sim.readability.clearance import limb_clearance

ROBOT = load_robot()
RADII = (0.05, 0.04, 0.06)


def motion(seed: int, count: int = 40) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    joints = rng.uniform(0.8 * ROBOT.lower, 0.8 * ROBOT.upper, (count, 7))
    person = rng.uniform(-0.2, 0.2, (count, 4, 3)) + rng.uniform(-0.8, 0.8, 3)
    return joints, person


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("limbs", [1, 2, 3])
def test_the_nearest_of_all_capsules_at_all_times_counts(seed: int, limbs: int) -> None:
    joints, person = motion(seed)
    person, radii = person[:, : limbs + 1], RADII[:limbs]
    wanted = min(
        capsule_distances(
            ROBOT.robot_capsules(q), ROBOT.capsule_radii,
            np.stack((arm[:-1], arm[1:]), axis=1), np.array(radii),
        ).min()
        for q, arm in zip(joints, person, strict=True)
    )  # fmt: skip
    assert limb_clearance(ROBOT, joints, person, radii) == pytest.approx(wanted, abs=1e-12)


@pytest.mark.parametrize(
    ("rows", "width", "keypoints", "says"),
    [(5, 7, 3, r"\(5, 4, 3\), not \(5, 3, 3\)"), (4, 7, 4, r"\(4, 4, 3\)"), (5, 6, 4, r"\(n, 7\)")],
)
def test_what_does_not_fit_is_refused(rows: int, width: int, keypoints: int, says: str) -> None:
    with pytest.raises(ValueError, match=says):
        limb_clearance(ROBOT, np.zeros((rows, width)), np.zeros((5, keypoints, 3)), RADII)


def test_limbs_that_cross_the_robot_are_below_nothing() -> None:
    joints = np.zeros((1, 7))
    elbow = ROBOT.frames(joints)[0, 1]
    person = elbow + np.array([((-0.2, 0.0, 0.0), (0.2, 0.0, 0.0), (0.4, 0.0, 0.0))])
    assert limb_clearance(ROBOT, joints, person, (0.05, 0.04)) == pytest.approx(-0.07 - 0.05)


@pytest.mark.parametrize("seed", range(6))
def test_boxes_are_as_near_as_the_axes_say(seed: int) -> None:
    """Of a box that an axis is in, the deepest place counts."""
    joints, _ = motion(seed)
    rng = np.random.default_rng(seed)
    boxes = np.stack((rng.uniform(-0.7, 0.7, (3, 3)), rng.uniform(0.02, 0.2, (3, 3))), axis=1)
    share = np.linspace(0.0, 1.0, 2001)[:, None]
    wanted = np.inf
    for points in ROBOT.frames(joints):
        for link, radius in enumerate(ROBOT.capsule_radii):
            places = points[link] + share * (points[link + 1] - points[link])
            for centre, half in boxes:
                off = np.abs(places - centre) - half
                depth = np.minimum(off.max(axis=1), 0.0)
                outside = np.linalg.norm(np.maximum(off, 0.0), axis=1)
                wanted = min(wanted, (outside + depth).min() - radius)
    assert box_clearance(ROBOT, joints, boxes) == pytest.approx(wanted, abs=1e-3)


def test_a_thin_plate_through_the_arm_is_touched() -> None:
    upright = np.zeros((1, 7))
    for height in np.linspace(0.4, 1.2, 40):
        plate = np.array([((0.0, 0.0, height), (0.3, 0.3, 1e-3))])
        assert box_clearance(ROBOT, upright, plate) < 0.0


def test_without_boxes_nothing_is_near() -> None:
    assert box_clearance(ROBOT, np.zeros((3, 7)), np.zeros((0, 2, 3))) == np.inf
