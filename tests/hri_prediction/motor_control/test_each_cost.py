"""Each of the seven costs by itself, in each convention: derivatives, and the reference's figures."""

import numpy as np
import pytest
from drawn import problem
from pieces import costs_of, pieces

from hri_prediction.motor_control.arm_model import ArmModel
from hri_prediction.motor_control.convention import CONVENTIONS
from hri_prediction.motor_control.costs import COSTS
from hri_prediction.motor_control.multiple_shooting import MultipleShooting
from hri_prediction.motor_control.ocp import ReachSolver
from hri_prediction.motor_control.scaling import scaling_of

STEP = 1e-5


@pytest.fixture(scope="module")
def reference(arm):
    """Building the program takes seconds."""
    return MultipleShooting(arm, 30)


def slope(function, at, moved):
    """By five points: power changes within milliradians from one branch of its root to the other."""
    near, far = (
        function(at + share * moved) - function(at - share * moved) for share in (1.0, 2.0)
    )
    return (8.0 * near - far) / (12.0 * STEP)


@pytest.mark.parametrize("cost", COSTS)
@pytest.mark.parametrize("convention", CONVENTIONS)
def test_derivatives_match_finite_differences(convention, cost, rng):
    """By the scale of this cost alone: of a mix, errors of a small one would drown in a large one."""
    solver = ReachSolver(ArmModel.of_body(convention=convention))
    task, chosen = problem(10), COSTS.index(cost)
    low, high = solver.unknown_rows(task)
    coefficients = solver.smooth(task)
    coefficients[low:high] += rng.normal(0.0, 0.02, (high - low, 3))
    weights = np.zeros(7)
    weights[chosen] = 1.0 / costs_of(solver, task, coefficients)[chosen]
    _, gradient, hessian, every = pieces(solver, task, coefficients, weights)
    np.testing.assert_allclose(gradient, weights @ every, rtol=1e-9, atol=1e-12)
    for i in rng.choice(gradient.size, 6, replace=False):
        moved = np.zeros_like(coefficients)
        moved[low + i // 3, i % 3] = STEP
        numeric = slope(lambda at: weights @ costs_of(solver, task, at), coefficients, moved)
        assert gradient[i] == pytest.approx(numeric, rel=1e-6, abs=1e-7 * np.abs(gradient).max())
        numeric = slope(lambda at: pieces(solver, task, at, weights)[1], coefficients, moved)
        np.testing.assert_allclose(hessian[i], numeric, atol=1e-6 * np.abs(hessian).max())


@pytest.mark.parametrize("convention", CONVENTIONS)
def test_multiple_shooting_finds_the_same_of_a_mix_of_all(convention, rng):
    arm = ArmModel.of_body(convention=convention)
    solver, reference = ReachSolver(arm), MultipleShooting(arm, 30)
    task = problem(13)
    weights = scaling_of(solver, task).weights(rng.dirichlet(np.full(len(COSTS), 5.0)), COSTS)
    motion, other = solver.solve(task, weights), reference.solve(task, weights)
    assert other.converged, other.status
    apart = reference.hand(other) - motion.hand(np.linspace(0.0, 1.0, 31), arm)
    assert np.linalg.norm(apart, axis=1).max() < 5e-4
    np.testing.assert_allclose(other.costs, motion.costs, rtol=0.02)


@pytest.mark.parametrize("cost", COSTS)
def test_multiple_shooting_finds_the_same_where_one_cost_has_most_weight(
    arm, solver, reference, cost
):
    """With a little joint jerk: of some costs alone there is no optimum without endless jerk."""
    task = problem(40)
    alpha = np.full(len(COSTS), 0.02)
    alpha[COSTS.index("joint_jerk")] += 0.1
    alpha[COSTS.index(cost)] += 1.0 - alpha.sum()
    weights = scaling_of(solver, task).weights(alpha, COSTS)
    motion, other = solver.solve(task, weights), reference.solve(task, weights)
    assert other.converged, other.status
    apart = reference.hand(other) - motion.hand(np.linspace(0.0, 1.0, 31), arm)
    assert np.linalg.norm(apart, axis=1).max() < 5e-4
    np.testing.assert_allclose(other.costs, motion.costs, rtol=0.02)
