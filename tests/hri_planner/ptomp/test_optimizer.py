"""The optimiser core: never worse, reproducible, keeps what is fixed."""

import numpy as np
import pytest

from hri_planner.ptomp import HumanForecast, PtompConfig
from hri_planner.ptomp.costs import CostModel
from hri_planner.ptomp.optimizer import Optimizer
from hri_planner.robot import load_robot, solve_ik

ROBOT = load_robot()
RADII = np.array([0.05, 0.04, 0.05])
COLUMNS = 45
STEP = 1.5 / 42


def _problem(precision="double"):
    """A straight joint motion through an arm that rests on the table."""
    rng = np.random.default_rng(0)
    seed = np.radians([0, -40, 0, 90, 0, -40, 0])
    ends = [solve_ik(ROBOT, np.array([0.5, y, 0.15]), seed, rng) for y in (-0.35, 0.35)]
    x = np.clip((np.arange(COLUMNS) - 2) / (COLUMNS - 3), 0, 1)[:, None]
    blend = x**3 * (10 - 15 * x + 6 * x * x)
    trajectory = np.ascontiguousarray((ends[0] + blend * (ends[1] - ends[0])).T)
    arm = np.array([[0.8, 0, 0.4], [0.75, 0, 0.15], [0.5, 0, 0.15], [0.41, 0, 0.15]])
    forecast = HumanForecast(0.0, 1.0, arm[None], np.full((1, 4), 0.01), RADII)
    model = CostModel(ROBOT, PtompConfig(precision=precision), None)
    model.bind(STEP * np.arange(-2, COLUMNS - 2), np.array([0.5, 0.35, 0.15]), [forecast], 0.07)
    return model, trajectory


def _run(seed, iterations=60, **changes):
    model, trajectory = _problem()
    cost = float(model.evaluate(trajectory[None])[0][0])
    options = {
        "free_until": COLUMNS - 1, "free_end": False, "sd": 0.35, "deadline": None,
        "iterations": iterations, **changes,
    }  # fmt: skip
    optimizer = Optimizer(PtompConfig(), np.random.default_rng(seed))
    return model, trajectory, cost, optimizer.run(model, trajectory, cost, **options)


def test_a_collision_is_optimised_away():
    model, trajectory, cost, result = _run(1)
    assert model.evaluate(trajectory[None])[2][0] < 0.0
    total, _, nearest = model.evaluate(result.trajectory[None])
    assert result.cost == pytest.approx(total[0])
    assert result.cost < 0.05 * cost
    assert nearest[0] > 0.03


def test_never_worse_at_any_length():
    costs = [_run(2, iterations)[3].cost for iterations in (0, 1, 5, 20)]
    assert costs == sorted(costs, reverse=True)


def test_same_seed_same_result():
    first, second = _run(3, 15)[3], _run(3, 15)[3]
    np.testing.assert_array_equal(first.trajectory, second.trajectory)
    assert not np.array_equal(first.trajectory, _run(4, 15)[3].trajectory)


def test_ends_past_and_last_joint_stay():
    _, trajectory, _, result = _run(5, 20)
    np.testing.assert_array_equal(result.trajectory[:, :3], trajectory[:, :3])
    np.testing.assert_array_equal(result.trajectory[:, -1], trajectory[:, -1])
    np.testing.assert_array_equal(result.trajectory[6], trajectory[6])
    _, trajectory, _, result = _run(5, 20, free_until=30)
    np.testing.assert_array_equal(result.trajectory[:, 30:], trajectory[:, 30:])


def test_a_free_end_moves():
    _, trajectory, _, result = _run(6, 20, free_until=COLUMNS, free_end=True)
    assert np.abs(result.trajectory[:6, -1] - trajectory[:6, -1]).max() > 1e-3


def test_deadline_stops_between_iterations():
    calls = iter([False, False, False, True])
    assert _run(7, 50, deadline=lambda: next(calls))[3].iterations == 3
