"""Inverse kinematics: exact, within limits, diverse, reproducible, and clear about failure."""

import numpy as np
import pytest

from hri_planner.robot import ik_candidates, load_robot, solve_ik
from hri_prediction.errors import PlanningError

ROBOT = load_robot()
SEED = np.radians([0.0, -40.0, 0.0, 90.0, 0.0, -40.0, 10.0])


def test_goals_of_the_work_space_are_reached():
    rng = np.random.default_rng(3)
    for _ in range(300):
        goal = rng.uniform([0.30, -0.5, 0.08], [0.60, 0.5, 0.40])
        candidates = ik_candidates(ROBOT, goal, SEED, rng)
        assert np.abs(ROBOT.frames(candidates)[:, 3] - goal).max() < 1e-6
        assert ROBOT.within_limits(candidates)
        np.testing.assert_array_equal(candidates[:, 6], SEED[6])


def test_candidates_differ_and_are_ranked():
    candidates = ik_candidates(ROBOT, np.array([0.45, 0.2, 0.2]), SEED, np.random.default_rng(0))
    assert len(candidates) >= 10
    distances = np.linalg.norm(candidates - SEED, axis=1)
    assert np.all(np.diff(distances) >= 0)
    gaps = np.linalg.norm((candidates[:, None] - candidates[None])[..., :6], axis=-1)
    assert gaps[~np.eye(len(candidates), dtype=bool)].min() > 0.1


def test_a_solution_is_its_own_nearest():
    goal = ROBOT.frames(SEED)[3]
    np.testing.assert_allclose(solve_ik(ROBOT, goal, SEED, np.random.default_rng(0)), SEED)


def test_same_seed_same_result():
    goal = np.array([0.5, -0.3, 0.15])
    first, second = (ik_candidates(ROBOT, goal, SEED, np.random.default_rng(5)) for _ in range(2))
    np.testing.assert_array_equal(first, second)


def test_unreachable_goals_name_the_distance():
    rng = np.random.default_rng(0)
    far = ROBOT.shoulder + np.array([ROBOT.reach + 0.25, 0, 0])
    with pytest.raises(PlanningError, match=r"out of reach by 250\.0 mm"):
        solve_ik(ROBOT, far, SEED, rng)
    with pytest.raises(PlanningError, match="out of reach by"):
        solve_ik(ROBOT, ROBOT.shoulder + np.array([0.02, 0, 0]), SEED, rng)
    with pytest.raises(PlanningError, match="three finite"):
        solve_ik(ROBOT, np.array([0.4, np.nan, 0.2]), SEED, rng)
