"""Weights of a part of a reach as those of the whole, from rest to rest: what is learnt and applied."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hri_prediction.hybrid.body import CONVENTION
from hri_prediction.hybrid.weight_process import of_whole, to_logs
from hri_prediction.hybrid.why import as_whole
from hri_prediction.motor_control import design
from hri_prediction.motor_control.arm_model import ANATOMICAL, ArmModel
from hri_prediction.motor_control.costs import CHAPTER_2, CHAPTER_3, indices_of
from hri_prediction.motor_control.ioc import explain
from hri_prediction.motor_control.observed import of_angles
from hri_prediction.motor_control.ocp import ReachSolver
from hri_prediction.motor_control.problem import ReachProblem
from hri_prediction.motor_control.scaling import rescaled, scaling_of
from hri_prediction.motor_control.seen import CUT_SHARE, SHARE_OF_PEAK, from_rest

positive = st.floats(0.05, 20.0)
CHOSEN = indices_of(CHAPTER_3)


@given(st.lists(st.tuples(positive, positive, positive), min_size=2, max_size=5))
def test_other_factors_leave_ratios_of_weights_as_they_were(rows: list[tuple[float, ...]]) -> None:
    alpha, factors, wanted = np.array(rows).T
    alpha = alpha / alpha.sum()
    found = rescaled(alpha, factors, wanted)
    assert found.sum() == pytest.approx(1.0)
    ratio = found * wanted / (alpha * factors)
    np.testing.assert_allclose(ratio, ratio[0], rtol=1e-9)
    np.testing.assert_allclose(rescaled(found, wanted, factors), alpha, rtol=1e-9)


def test_logarithms_are_as_sure_as_before() -> None:
    alpha = np.array([0.3, 0.4, 0.1, 0.1, 0.1])
    errors = 0.03**2 * (np.eye(5) - 0.2)  # their sum is known
    whole, of_errors = of_whole(alpha, errors, [2.0, 1.0, 3.0, 0.7, 1.1], [1.0, 1.0, 1.0, 1.0, 1.0])
    assert whole.sum() == pytest.approx(1.0)
    np.testing.assert_allclose(of_errors.sum(axis=0), 0.0, atol=1e-12)
    before, after = to_logs(alpha, errors, CHAPTER_3), to_logs(whole, of_errors, CHAPTER_3)
    np.testing.assert_allclose(after[1], before[1], rtol=1e-9)
    np.testing.assert_allclose(after[0] - before[0], np.log([2.0, 3.0, 0.7, 1.1]), atol=1e-9)


def test_so_much_of_a_movement_is_left() -> None:
    phases = np.linspace(0.0, 1.0, 20001)
    speed = 16.0 * phases**2 * (1.0 - phases) ** 2
    fast = phases[speed >= SHARE_OF_PEAK]
    assert fast[-1] - fast[0] == pytest.approx(CUT_SHARE, abs=2e-4)


def test_a_reach_at_rest_is_whole() -> None:
    rest = ReachProblem.at_rest([0.2, 0.1, 0.3], [0.1, 1.0, 0.4], 1.2)
    assert from_rest(rest) is rest


@pytest.mark.parametrize("task", [3, 30, 77])
def test_weights_of_a_cut_reach_are_found_as_those_of_the_whole(task: int) -> None:
    """What is learnt means what it is used for: with factors of the part itself, weights are others."""
    rng = np.random.default_rng(task)
    solver = ReachSolver(ArmModel.of_body(convention=CONVENTION))
    problem = ReachProblem.at_rest(*design.tasks()[task][2:])
    alpha = rng.dirichlet(np.full(len(CHAPTER_3), 4.0))
    motion = solver.solve(problem, scaling_of(solver, problem).weights(alpha, CHAPTER_3))
    phases = np.linspace(0.0, 1.0, 401)
    speed = np.linalg.norm(np.gradient(motion.hand(phases, solver.arm), phases, axis=0), axis=1)
    fast = phases[speed >= SHARE_OF_PEAK * speed.max()]
    at = np.linspace(fast[0], fast[-1], 200)
    (q0, q1), (v0, v1), (a0, a1) = (motion.angles(at, order)[[0, -1]] for order in (0, 1, 2))
    seconds = float(fast[-1] - fast[0]) * motion.duration
    # Accelerations are known here: what is left to the optimum would be a matter of its own.
    seen = of_angles(ReachProblem(q0, q1, seconds, v0, v1, a0, a1), motion.angles(at), solver.arm)
    found = explain(solver, seen, CHAPTER_3)
    share = float(fast[-1] - fast[0])
    rest = scaling_of(solver, from_rest(seen.problem, share)).factors[CHOSEN]
    whole, _ = of_whole(
        found.alpha, np.zeros((len(CHAPTER_3), len(CHAPTER_3))), found.factors, rest
    )
    as_found, as_whole = (float(np.abs(each - alpha).max()) for each in (found.alpha, whole))
    assert as_whole < 0.05
    assert as_found > 1.5 * as_whole


@pytest.mark.parametrize("task", [3, 30, 77])
def test_what_a_cut_path_hides_is_told_by_where_it_rests(task: int) -> None:
    """The path of somebody's mean reach, from one crossing of the onset speed to the other."""
    rng = np.random.default_rng(task)
    arm = ArmModel.of_body(convention=CONVENTION)
    solver = ReachSolver(arm)
    problem = ReachProblem.at_rest(*design.tasks()[task][2:])
    alpha = rng.dirichlet(np.full(len(CHAPTER_2), 4.0))
    motion = solver.solve(problem, scaling_of(solver, problem).weights(alpha, CHAPTER_2))
    share = 0.9
    at = 0.05 + share * np.linspace(0.0, 1.0, 101)
    (q0, q1), (v0, v1) = (motion.angles(at[[0, -1]], order) for order in (0, 1))
    cut = of_angles(
        ReachProblem.moving(q0, q1, share * problem.duration, v0, v1), motion.angles(at), arm
    )
    whole = as_whole(cut, share, ANATOMICAL)
    assert whole.problem.duration == pytest.approx(problem.duration)
    for found, true in (
        (whole.problem.q_start, problem.q_start),
        (whole.problem.q_end, problem.q_end),
    ):
        assert np.abs(found - true).max() < np.radians(0.3)
    as_cut, as_rested = (
        float(np.abs(explain(solver, seen).alpha - alpha).max()) for seen in (cut, whole)
    )
    assert as_rested < 0.1
    assert as_cut > 1.5 * as_rested
