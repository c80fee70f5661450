"""The kernel's distances against Pinocchio with coal, and at places where formulas are delicate."""

import numpy as np
import pytest

from hri_planner.benchmarks.plain_distances import arm_points, capsule_gaps, row_gaps, row_points
from hri_planner.benchmarks.references import PinocchioLoop
from hri_planner.ptomp import HumanForecast, PtompConfig
from hri_planner.ptomp.costs import CostModel
from hri_planner.ptomp.layout import ROW
from hri_planner.robot import load_robot
from hri_prediction.errors import DataError

ROBOT = load_robot()
RADII = np.array([0.05, 0.04, 0.03])
LIMBS = np.array([0.29, 0.26, 0.09])
COLUMNS, COUNT = 100, 30
TOLERANCE = {"double": 1e-9, "single": 1e-5}


def _arms(rng, columns=COLUMNS):
    """Arms anywhere about the robot, limbs in any direction (columns, 4, 3)."""
    axes = rng.standard_normal((columns, 3, 3))
    axes *= LIMBS[:, None] / np.linalg.norm(axes, axis=2, keepdims=True)
    arm = np.zeros((columns, 4, 3))
    arm[:, 1:] = np.cumsum(axes, axis=1)
    return arm + rng.uniform([-0.7, -0.7, 0.0], [0.7, 0.7, 1.2], (columns, 1, 3))


def _ours(arm, q, precision="double"):
    """Clearances (n, P) of configurations (n, P, 7)."""
    model = CostModel(ROBOT, PtompConfig(precision=precision), None)
    times = 0.04 * np.arange(len(arm))
    people = HumanForecast(0.0, 0.04, arm, np.zeros(arm.shape[:2]), RADII)
    model.bind(times, np.zeros(3), [people], 0.05)
    return model.clearances(np.swapaxes(q, 1, 2))


@pytest.mark.parametrize("precision", TOLERANCE)
def test_agrees_with_pinocchio_and_coal(precision):
    rng = np.random.default_rng(4)
    arm = _arms(rng)
    q = rng.uniform(ROBOT.lower, ROBOT.upper, (COUNT, COLUMNS, 7))
    gaps = PinocchioLoop(ROBOT, arm, RADII).gaps(q)
    assert np.unique(gaps.argmin(axis=2)).size == 9  # each of the pairs is nearest somewhere
    assert gaps.min() < 0.0
    assert np.abs(_ours(arm, q, precision) - gaps.min(axis=2)).max() < TOLERANCE[precision]
    plain = capsule_gaps(arm_points(q, ROBOT.lengths), ROBOT.capsule_radii, arm, RADII)[0]
    assert np.abs(plain.reshape(gaps.shape) - gaps).max() < 1e-12
    rows = row_gaps(
        row_points(list(np.moveaxis(q, 2, 0)[:6]), ROBOT.lengths, np),
        ROBOT.capsule_radii, np.moveaxis(arm, 0, 2), RADII, np,
    )  # fmt: skip
    rows = np.stack([gap for part in rows for gap, _ in part], axis=2)
    assert np.abs(rows - gaps).max() < 1e-12


@pytest.mark.parametrize("precision", TOLERANCE)
@pytest.mark.parametrize("turn", [0.0, 1e-9, 1e-6, 1e-4, 1e-2])
def test_parallel_axes(turn, precision):
    """An arm along the upright robot, or nearly so."""
    axis = np.array([np.sin(turn), 0.0, np.cos(turn)])
    rng = np.random.default_rng(5)
    starts = rng.uniform([0.2, -0.3, -0.5], [0.4, 0.3, 1.5], (COLUMNS, 3))
    reach = np.concatenate(([0.0], np.cumsum(LIMBS)))
    arm = starts[:, None] + reach[:, None] * axis
    q = np.zeros((1, COLUMNS, 7))
    gaps = PinocchioLoop(ROBOT, arm, RADII).gaps(q).min(axis=2)
    assert np.abs(_ours(arm, q, precision) - gaps).max() < TOLERANCE[precision]


def test_limbs_without_length():
    arm = np.repeat(_arms(np.random.default_rng(6), 3)[:, :1], 4, axis=1)
    q = np.random.default_rng(7).uniform(ROBOT.lower, ROBOT.upper, (2, 3, 7))
    points = ROBOT.frames(q)
    start, axis = points[..., :-1, :], np.diff(points, axis=-2)
    share = ((arm[:, :3] - start) * axis).sum(-1) / (axis**2).sum(-1)
    foot = start + np.clip(share, 0.0, 1.0)[..., None] * axis
    gaps = np.linalg.norm(arm[:, :3] - foot, axis=-1) - ROBOT.capsule_radii - RADII.max()
    assert np.abs(_ours(arm, q) - gaps.min(axis=2)).max() < 1e-12


def test_sine_and_cosine_in_and_beyond_the_limits():
    """Through the elbow's place, which only the first two joints turn."""
    model = CostModel(ROBOT, PtompConfig(), None)
    model.bind(0.01 * np.arange(160.0), np.zeros(3), [], 0.0)
    for limit, tolerance in ((3.2, 1e-13), (3.6, 1e-10), (4.5, 1e-8)):
        q = np.zeros((1, 7, 160))
        q[0, 1] = np.linspace(-limit, limit, 160)
        model.clearances(q)
        work = model.problem[-1].reshape(-1, ROW)
        elbow = ROBOT.frames(q[0].T)[:, 1]
        assert np.abs(work[:3, :160].T - elbow).max() < tolerance


def test_shapes_of_coal_keep_their_length():
    arm = _arms(np.random.default_rng(8))
    with pytest.raises(DataError, match="length"):
        PinocchioLoop(ROBOT, arm + 0.1 * np.random.default_rng(9).standard_normal(arm.shape), RADII)
