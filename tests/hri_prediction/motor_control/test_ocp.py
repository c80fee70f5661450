"""Reaches as optimal control: derivatives, optimality, limits, and the reference by multiple shooting."""

import pickle

import numpy as np
import pytest
from drawn import optimum, problem, state
from hypothesis import given, settings
from hypothesis import strategies as st
from pieces import costs_of, pieces
from scipy.linalg import cho_factor, cho_solve

from hri_prediction.errors import ConfigError, DataError
from hri_prediction.motor_control.arm_model import ArmModel, JointLimits
from hri_prediction.motor_control.assembly import BAND
from hri_prediction.motor_control.convention import CONVENTIONS
from hri_prediction.motor_control.costs import (
    CHAPTER_2,
    CHAPTER_3,
    COSTS,
    Smoothing,
    check_simplex,
    check_weights,
    indices_of,
)
from hri_prediction.motor_control.multiple_shooting import MultipleShooting
from hri_prediction.motor_control.newton import factorise, pin, solve_factorised
from hri_prediction.motor_control.ocp import NotConverged, ReachSolver
from hri_prediction.motor_control.problem import ReachProblem
from hri_prediction.motor_control.scaling import RANGE, scaling_of
from hri_prediction.motor_control.spline import basis_at, spline_table

PHASES = np.linspace(0.0, 1.0, 61)


@pytest.mark.parametrize("convention", CONVENTIONS)
def test_every_derivative_matches_finite_differences(convention, rng):
    solver = ReachSolver(ArmModel.of_body(convention=convention))
    task = problem(10)
    low, high = solver.unknown_rows(task)
    coefficients = solver.smooth(task)
    coefficients[low:high] += rng.normal(0.0, 0.02, (high - low, 3))
    weights = rng.uniform(0.5, 1.5, 7) / costs_of(solver, task, coefficients)
    costs, gradient, hessian, every = pieces(solver, task, coefficients, weights)
    np.testing.assert_allclose(costs, costs_of(solver, task, coefficients), rtol=1e-12)
    np.testing.assert_allclose(gradient, weights @ every, rtol=1e-9, atol=1e-9)
    step = 1e-5
    for _ in range(12):
        i = int(rng.integers(gradient.size))
        moved = np.zeros_like(coefficients)
        moved[low + i // 3, i % 3] = step
        ahead, behind = (costs_of(solver, task, coefficients + s * moved) for s in (1.0, -1.0))
        numeric = (ahead - behind) / (2.0 * step)
        scale = np.abs(every).max(axis=1)
        np.testing.assert_allclose(every[:, i], numeric, rtol=1e-5, atol=1e-6 * scale.max())
        ahead, behind = (
            pieces(solver, task, coefficients + s * moved, weights)[1] for s in (1.0, -1.0)
        )
        np.testing.assert_allclose(
            hessian[i], (ahead - behind) / (2.0 * step), atol=2e-6 * np.abs(hessian).max()
        )


def test_hessian_is_a_band(solver):
    task = problem(3)
    _, _, hessian, _ = pieces(solver, task, solver.smooth(task), np.ones(7))
    rows, columns = np.nonzero(hessian)
    assert np.abs(rows - columns).max() == BAND


@given(st.integers(0, 1000), st.integers(1, 60), st.integers(0, 20))
@settings(max_examples=40, deadline=None)
def test_banded_solves_are_those_of_lapack(seed, size, band):
    rng = np.random.default_rng(seed)
    root = np.tril(np.triu(rng.normal(size=(size, size)), -band))
    matrix = root @ root.T + 0.1 * np.eye(size)
    right, factor = rng.normal(size=size), np.zeros((size, size))
    assert factorise(matrix, band, factor)
    found = right.copy()
    solve_factorised(factor, band, found)
    np.testing.assert_allclose(found, cho_solve(cho_factor(matrix), right), rtol=1e-6, atol=1e-8)
    held = rng.random(size) < 0.3
    pin(matrix, band, held)
    assert factorise(matrix, band, factor)
    np.testing.assert_allclose(np.diag(matrix)[held], 1.0)
    assert not factorise(-np.eye(size), band, factor)


def test_basis_is_a_partition_of_unity_with_exact_derivatives():
    phases = np.linspace(0.0, 1.0, 40)
    basis = basis_at(phases, 16)
    np.testing.assert_allclose(basis[:, 0].sum(axis=1), 1.0, atol=1e-12)
    np.testing.assert_allclose(basis[:, 1:].sum(axis=2), 0.0, atol=1e-7)
    table = spline_table(16, 4)
    assert table.weights.sum() == pytest.approx(1.0)
    assert table.coefficients == 21
    with pytest.raises(ValueError, match="read-only"):
        table.values[0] = 0.0


def test_least_joint_jerk_is_the_polynomial_of_fifth_degree(solver):
    task = problem(5)
    motion = solver.solve(task, np.eye(7)[COSTS.index("joint_jerk")])
    s = PHASES[:, None]
    shape = s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
    expected = task.q_start + shape * (task.q_end - task.q_start)
    np.testing.assert_allclose(motion.angles(PHASES), expected, atol=1e-9)
    way = task.q_end - task.q_start
    assert motion.costs[2] == pytest.approx(720.0 * (way @ way) / task.duration**5, rel=1e-9)


@given(st.integers(0, 80), st.integers(0, 10_000))
@settings(max_examples=15, deadline=None)
def test_an_optimum_is_no_worse_than_anything_beside_it(solver, number, seed):
    rng = np.random.default_rng(seed)
    task = problem(number)
    motion, weights = optimum(solver, task, rng.dirichlet(np.ones(5)), CHAPTER_3)
    cost = weights @ motion.costs
    low, high = solver.unknown_rows(task)
    for size in (1e-3, 0.05):
        other = np.array(motion.coefficients)
        other[low:high] += rng.normal(0.0, size, (high - low, 3))
        assert weights @ costs_of(solver, task, other) > cost
    # and the same from elsewhere
    start = np.array(motion.coefficients)
    start[low:high] += rng.normal(0.0, 0.3, (high - low, 3))
    again = solver.solve(task, weights, start=start)
    assert weights @ again.costs == pytest.approx(cost, rel=1e-9)


@given(st.integers(0, 80), st.floats(1e-3, 1e3))
@settings(max_examples=10, deadline=None)
def test_the_unit_of_the_cost_does_not_matter(solver, number, factor):
    task = problem(number)
    motion, weights = optimum(solver, task, np.full(4, 0.25))
    other = solver.solve(task, factor * weights)
    np.testing.assert_allclose(other.angles(PHASES), motion.angles(PHASES), atol=1e-7)


def test_ends_are_those_of_the_problem(solver):
    task = ReachProblem.moving(
        [0.1, 0.2, 0.4], [0.3, 1.1, 0.8], 1.2, [0.1, -0.2, 0.3], [0.2, 0.4, -0.1]
    )
    motion = solver.solve(task, np.ones(7))
    ends = np.array([0.0, 1.0])
    np.testing.assert_allclose(motion.angles(ends), [task.q_start, task.q_end], atol=1e-12)
    np.testing.assert_allclose(motion.angles(ends, 1), [task.v_start, task.v_end], atol=1e-10)
    assert np.abs(motion.angles(ends, 2)).min() > 1e-3  # left to the optimum
    rest = problem(0)
    motion = solver.solve(rest, np.ones(7))
    for order in (1, 2):
        np.testing.assert_allclose(motion.angles(ends, order), 0.0, atol=1e-9)


def test_sensitivity_matches_solving_again(solver, rng):
    for number in (2, 40, 77):
        task = problem(number)
        motion, weights = optimum(solver, task, rng.dirichlet(np.full(5, 3.0)), CHAPTER_3)
        chosen = indices_of(CHAPTER_3)
        moved, path = solver.path_derivatives(task, motion, weights, chosen, PHASES)
        for row, index in enumerate(chosen):
            step = 1e-5 * weights[index]
            ahead, behind = (
                solver.solve(task, weights + s * step * np.eye(7)[index], motion.coefficients)
                for s in (1.0, -1.0)
            )
            numeric = (ahead.coefficients - behind.coefficients) / (2.0 * step)
            scale = np.abs(numeric).max()
            np.testing.assert_allclose(moved[row], numeric, atol=1e-4 * scale)
            difference = ahead.hand(PHASES, solver.arm) - behind.hand(PHASES, solver.arm)
            np.testing.assert_allclose(
                path[..., row], difference / (2.0 * step), atol=1e-4 * np.abs(path[..., row]).max()
            )
        # Weights that are all scaled change nothing.
        unchanged = np.tensordot(weights[chosen], moved, axes=1)
        assert np.abs(unchanged).max() < 1e-6


def test_joint_limits_hold_and_bind(arm, solver):
    weights = np.eye(7)[COSTS.index("hand_jerk")] + 1e-3 * np.eye(7)[COSTS.index("joint_jerk")]
    for number in range(81):  # until one turns its elbow farther than at either end
        task = problem(number)
        free = solver.solve(task, weights)
        highest = free.angles(PHASES)[:, 2].max()
        end = max(task.q_start[2], task.q_end[2])
        if highest > end + np.radians(3.0):
            break
    ceiling = np.degrees(0.5 * (highest + end))
    limits = JointLimits.degrees(((-90.0, 90.0), (-45.0, 135.0), (0.0, ceiling)))
    tight = ReachSolver(arm, limits)
    bound = tight.solve(task, weights)
    found = np.degrees(bound.angles(PHASES)[:, 2].max())
    assert found <= ceiling + 1e-9
    assert weights @ bound.costs > weights @ free.costs
    held = np.isclose(np.degrees(bound.coefficients[:, 2]), ceiling, atol=1e-9)
    assert held.any()
    moved = tight.sensitivity(task, bound, weights, np.array([COSTS.index("energy")]))
    assert np.abs(moved[0][held, 2]).max() == 0.0
    assert np.abs(moved).max() > 0.0


def test_multiple_shooting_finds_the_same(arm, solver, rng):
    reference = MultipleShooting(arm, 20)
    for number in (4, 60):
        task = problem(number)
        motion, weights = optimum(solver, task, rng.dirichlet(np.full(4, 3.0)))
        other = reference.solve(task, weights)
        assert other.converged, other.status
        apart = reference.hand(other) - motion.hand(np.linspace(0.0, 1.0, 21), arm)
        assert np.linalg.norm(apart, axis=1).max() < 5e-4
        np.testing.assert_allclose(
            other.costs[indices_of(CHAPTER_2)], motion.costs[indices_of(CHAPTER_2)], rtol=0.02
        )
    with pytest.raises(DataError, match="at least one more than 0"):
        reference.solve(problem(4), np.zeros(7))
    with pytest.raises(DataError, match="begins with q1"):
        reference.solve(ReachProblem.at_rest([9.0, 0.0, 0.5], [0.0, 1.0, 0.5], 1.0), np.ones(7))


def test_multiple_shooting_finds_the_same_of_a_part_of_a_motion(arm, solver, rng):
    """Cut out of it where the hand is slow: velocities are given, accelerations are the optimum's."""
    reference = MultipleShooting(arm, 30)
    for number in (4, 60):
        whole, _ = optimum(solver, problem(number), rng.dirichlet(np.full(4, 3.0)))
        (q0, q1), (v0, v1) = (whole.angles(np.array([0.1, 0.9]), order) for order in (0, 1))
        task = ReachProblem.moving(q0, q1, 0.8 * whole.duration, v0, v1)
        motion, weights = optimum(solver, task, rng.dirichlet(np.full(4, 3.0)))
        other = reference.solve(task, weights)
        assert other.converged, other.status
        np.testing.assert_allclose(other.velocities[[0, -1]], [v0, v1], atol=1e-6)
        apart = reference.hand(other) - motion.hand(np.linspace(0.0, 1.0, 31), arm)
        assert np.linalg.norm(apart, axis=1).max() < 5e-4


def test_scaling_brings_costs_to_one_range(solver):
    found = scaling_of(solver, problem(8))
    largest = np.max([motion.costs for motion in found.optima.values()], axis=0)
    np.testing.assert_allclose(found.factors * largest, largest[2], rtol=1e-12)
    assert found.factors[2] == 1.0
    assert (scaling_of(solver, problem(8), RANGE).factors[3] >= found.factors[3]).all()
    with pytest.raises(ConfigError, match="maximum, range"):
        scaling_of(solver, problem(8), "none")


def test_one_motion_for_the_same_input(solver):
    first, second = (optimum(solver, problem(20), np.full(4, 0.25))[0] for _ in range(2))
    np.testing.assert_array_equal(first.coefficients, second.coefficients)


@pytest.mark.parametrize(
    ("values", "word"),
    [
        (([0, 0, np.nan], [0, 1, 0], 1.0), "q_start"),
        (([0, 0, 0], [0, 1], 1.0), "shape"),
        (([0, 0, 0], [0, 1, 0], 0.0), "duration 0.0 s"),
        (([0, 0, 0], [0, 1, 0], -1.0), "positive time"),
        (([0, 0, 0], [0, 1, 0], np.inf), "duration"),
        (([0, 0.5, 0], [0, 0.5, 0], 1.0), "no length"),
    ],
)
def test_reaches_that_cannot_be_are_refused(values, word):
    with pytest.raises(DataError, match=word):
        ReachProblem.at_rest(*values)


def test_what_no_joint_or_weight_can_be_is_refused(solver):
    with pytest.raises(DataError, match=r"ends with q3 = -28\.6 deg.*0 to 150"):
        solver.solve(ReachProblem.at_rest([0, 0, 0.5], [0, 1, -0.5], 1.0), np.ones(7))
    for weights in (np.ones(6), -np.ones(7), np.zeros(7), np.full(7, np.nan)):
        with pytest.raises(DataError, match="weights"):
            check_weights(weights)
        with pytest.raises(DataError, match="weights"):
            solver.solve(problem(0), weights)
    for alpha in ([0.5, 0.6, 0.0, 0.0], [1.5, -0.5, 0.0, 0.0], [0.5, np.nan, 0.25, 0.25], [1.0]):
        with pytest.raises(DataError, match="alpha"):
            check_simplex(alpha, CHAPTER_2)
    for names in ((), ("hand_jerk", "hand_jerk"), ("effort",)):
        with pytest.raises(ConfigError, match="hand_jerk"):
            indices_of(names)


def test_a_solve_that_does_not_converge_says_what_it_was(solver, monkeypatch):
    monkeypatch.setattr("hri_prediction.motor_control.ocp.ITERATIONS", 1)
    with pytest.raises(NotConverged, match="1 iterations") as caught:
        solver.solve(problem(0), np.eye(7)[0])
    assert caught.value.reach.duration == problem(0).duration
    assert caught.value.weights[0] == 1.0


def test_solvers_and_their_errors_go_to_other_processes(solver, monkeypatch):
    twin = pickle.loads(pickle.dumps(solver))
    task = problem(7)
    np.testing.assert_array_equal(
        twin.solve(task, np.ones(7)).coefficients, solver.solve(task, np.ones(7)).coefficients
    )
    monkeypatch.setattr("hri_prediction.motor_control.ocp.ITERATIONS", 1)
    with pytest.raises(NotConverged) as caught:
        solver.solve(task, np.eye(7)[0])
    again = pickle.loads(pickle.dumps(caught.value))
    assert str(again) == str(caught.value)
    assert again.reach.duration == task.duration


def test_settings_and_starts_that_cannot_be_are_refused(arm, solver):
    with pytest.raises(ConfigError, match="two or more"):
        ReachSolver(arm, intervals=1)
    for wrong in ({"power": 0.0}, {"speed": -1.0}, {"power": float("nan")}):
        with pytest.raises(ConfigError, match="positive"):
            Smoothing(**wrong)
    for start in (np.zeros((30, 3)), np.full((21, 3), np.nan)):
        with pytest.raises(DataError, match="start"):
            solver.solve(problem(0), np.ones(7), start=start)
    with pytest.raises(DataError, match="alpha"):
        scaling_of(solver, problem(0)).weights([0.5], ("hand_jerk",))


def test_a_reach_in_motion_moves_with_its_weights_as_solving_again_says(solver, rng):
    task = ReachProblem.moving(
        [0.1, 0.2, 0.4], [0.3, 1.1, 0.8], 1.2, [0.1, -0.2, 0.3], [0.2, 0.4, -0.1]
    )
    weights = scaling_of(solver, task).weights(rng.dirichlet(np.full(4, 3.0)), CHAPTER_2)
    motion = solver.solve(task, weights)
    chosen = indices_of(CHAPTER_2)
    moved = solver.sensitivity(task, motion, weights, chosen)
    for row, index in enumerate(chosen):
        step = 1e-5 * weights[index]
        ahead, behind = (
            solver.solve(task, weights + s * step * np.eye(7)[index], motion.coefficients)
            for s in (1.0, -1.0)
        )
        numeric = (ahead.coefficients - behind.coefficients) / (2.0 * step)
        np.testing.assert_allclose(moved[row], numeric, atol=1e-4 * np.abs(numeric).max())


def test_kernels_take_the_state_as_it_is(solver, rng):
    from hri_prediction.motor_control.integrand import costs_at

    z, y, out = state(rng), rng.normal(size=10), np.empty(7)
    costs_at(z, y, 0.05, 0.02, out)
    assert out[0] == pytest.approx(y[:3] @ y[:3])
    assert out[5] == pytest.approx((np.hypot(z[3:6] * y[3:6], 0.05) - 0.05).sum())


def test_an_optimum_that_rounding_hides_is_one():
    """The gradient of this one never gets below 1.1e-13 of the cost, and steps change nothing any more."""
    task = ReachProblem.at_rest(
        [0.3559012943005567, 0.5821454306759924, 0.6331740846072419],
        [-0.06075868391870827, 1.2746953649557011, 0.22064038098966995],
        1.8488057796466526,
    )
    solver = ReachSolver(ArmModel.of_body(1.6833636431056866, 78.94541503853252))
    assert solver.solve(task, np.eye(7)[COSTS.index("hand_jerk")]).iterations < 20
