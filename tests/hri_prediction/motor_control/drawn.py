"""Reaches for tests: of the thesis' design, as optima of weights that are known."""

from __future__ import annotations

import numpy as np

from hri_prediction.motor_control import design
from hri_prediction.motor_control.costs import CHAPTER_2
from hri_prediction.motor_control.kinematics import elbow_and_wrist
from hri_prediction.motor_control.observed import ObservedReach, of_angles
from hri_prediction.motor_control.ocp import Motion, ReachSolver
from hri_prediction.motor_control.problem import ReachProblem
from hri_prediction.motor_control.scaling import scaling_of
from hri_prediction.motor_control.seen import to_recording
from hri_prediction.tracks.track import ArmTrack

TASKS = design.tasks()
RATE_HZ = 250.0
REST_S = 0.4
"""Before and after a recorded reach."""
ALPHA = np.array([0.3, 0.4, 0.1, 0.2])


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


def recorded(
    solver: ReachSolver,
    number: int,
    rng: np.random.Generator,
    *,
    noise: float = 0.0,
    side: str = "right",
    facing: float = 0.5 * np.pi,
    trial: int = 0,
    task: str = "",
) -> tuple[ArmTrack, float, float]:
    """A recording of a simulated reach, with rest before and after it, and when it begins and ends."""
    reach = problem(number)
    motion, _ = optimum(solver, reach, ALPHA)
    time_s = np.arange(round((reach.duration + 2 * REST_S) * RATE_HZ)) / RATE_HZ
    phases = np.clip((time_s - REST_S) / reach.duration, 0.0, 1.0)
    elbow, wrist = elbow_and_wrist(motion.angles(phases), solver.arm)
    points = np.zeros((len(time_s), 4, 3))
    points[:, 1], points[:, 2] = elbow, wrist
    points[:, 3] = wrist + 0.08 * (wrist - elbow) / solver.arm.forearm_m
    points = to_recording(points, facing, side) + np.array([0.3, -0.2, 1.1])
    points += rng.normal(0.0, noise, points.shape) if noise else 0.0
    track = ArmTrack(
        time_s, points, side=side, subject="ann", task=task or f"task{number}", trial=trial
    )
    return track, REST_S, REST_S + reach.duration
