"""Reaches for tests: of the thesis' design, as optima of weights that are known."""

from __future__ import annotations

import numpy as np

from hri_prediction.motor_control import design
from hri_prediction.motor_control.costs import CHAPTER_2
from hri_prediction.motor_control.observed import ObservedReach, of_angles
from hri_prediction.motor_control.ocp import Motion, ReachSolver
from hri_prediction.motor_control.problem import ReachProblem
from hri_prediction.motor_control.scaling import scaling_of

TASKS = design.tasks()
RATE_HZ = 250.0


def problem(number: int) -> ReachProblem:
    """The reach of a task of the design, at rest at both ends."""
    _, _, q_start, q_end, duration = TASKS[number % len(TASKS)]
    return ReachProblem.at_rest(q_start, q_end, duration)


def optimum(
    solver: ReachSolver, task: ReachProblem, alpha: np.ndarray, names: tuple[str, ...] = CHAPTER_2
) -> tuple[Motion, np.ndarray]:
    """The optimum of some weights, and the weights of all seven costs that it is one of."""
    weights = scaling_of(solver, task).weights(alpha, names)
    return solver.solve(task, weights), weights


def observed(
    solver: ReachSolver, task: ReachProblem, alpha: np.ndarray, names: tuple[str, ...] = CHAPTER_2
) -> ObservedReach:
    """What is seen of it, without noise."""
    motion, _ = optimum(solver, task, alpha, names)
    phases = np.linspace(0.0, 1.0, round(task.duration * RATE_HZ) + 1)
    return of_angles(task, motion.angles(phases), solver.arm)


def state(rng: np.random.Generator) -> np.ndarray:
    """Joint angles, velocities, accelerations and jerks (12,) of an arm in motion."""
    spreads = ((1.0, 2.0, 8.0, 50.0)[k // 3] for k in range(12))
    return np.array([rng.normal(0.0, spread) for spread in spreads])
