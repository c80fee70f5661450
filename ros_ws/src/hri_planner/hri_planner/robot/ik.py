"""Inverse kinematics to a tool position; posture and orientation stay free.

Six joints move the tool and three numbers are asked for, so a goal leaves three dimensions of
redundancy. Each solution comes from Newton steps of least joint motion (damped least squares,
Nakamura & Hanafusa 1986) in which joints at a limit are held when the step would push them out.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from hri_planner.robot.kinematics import tool_jacobian
from hri_planner.robot.model import RobotModel
from hri_prediction.compiled import njit
from hri_prediction.errors import PlanningError

FloatArray = NDArray[np.float64]

_NEWTON_STEPS = 60
_DISTINCT = 0.1  # rad (norm over joints 1-6) by which two solutions count as different


@njit
def _solve_spd3(a: FloatArray, b: FloatArray, x: FloatArray) -> None:
    """Solve a x = b for a symmetric positive definite 3 x 3 matrix, by Cholesky."""
    l00 = math.sqrt(a[0, 0])
    l10 = a[1, 0] / l00
    l20 = a[2, 0] / l00
    l11 = math.sqrt(a[1, 1] - l10 * l10)
    l21 = (a[2, 1] - l20 * l10) / l11
    l22 = math.sqrt(a[2, 2] - l20 * l20 - l21 * l21)
    y0 = b[0] / l00
    y1 = (b[1] - l10 * y0) / l11
    y2 = (b[2] - l20 * y0 - l21 * y1) / l22
    x[2] = y2 / l22
    x[1] = (y1 - l21 * x[2]) / l11
    x[0] = (y0 - l10 * x[1] - l20 * x[2]) / l00


@njit
def newton_to_position(
    q: FloatArray,
    position: FloatArray,
    lengths: FloatArray,
    lower: FloatArray,
    upper: FloatArray,
    tolerance: float,
) -> float:
    """Move q (7,), in place, to the nearest configuration whose tool is at a position (3,).

    Returns:
        The remaining distance [m]; above ``tolerance`` when the steps did not converge.
    """
    jac = np.empty((3, 7))
    tool = np.empty(3)
    error = np.empty(3)
    weights = np.empty(3)
    normal = np.empty((3, 3))
    distance = math.inf
    for _ in range(_NEWTON_STEPS):
        tool_jacobian(q, lengths, tool, jac)
        squared = 0.0
        for i in range(3):
            error[i] = position[i] - tool[i]
            squared += error[i] * error[i]
        distance = math.sqrt(squared)
        if distance <= tolerance:
            return distance
        # Damping that fades with the error keeps convergence quadratic.
        damping = 1e-3 * squared + 1e-12
        for _repeat in range(6):
            for i in range(3):
                for j in range(i + 1):
                    total = damping if i == j else 0.0
                    for k in range(7):
                        total += jac[i, k] * jac[j, k]
                    normal[i, j] = total
                    normal[j, i] = total
            _solve_spd3(normal, error, weights)
            held = False
            for k in range(6):
                step = jac[0, k] * weights[0] + jac[1, k] * weights[1] + jac[2, k] * weights[2]
                if (q[k] <= lower[k] and step < 0.0) or (q[k] >= upper[k] and step > 0.0):
                    jac[:, k] = 0.0
                    held = True
            if not held:
                break
        largest = 0.0
        for k in range(6):
            step = jac[0, k] * weights[0] + jac[1, k] * weights[1] + jac[2, k] * weights[2]
            largest = max(largest, abs(step))
        scale = min(1.0, 0.5 / max(largest, 1e-12))
        for k in range(6):
            step = jac[0, k] * weights[0] + jac[1, k] * weights[1] + jac[2, k] * weights[2]
            q[k] = min(max(q[k] + scale * step, lower[k]), upper[k])
    return distance


@njit
def _newton_all(
    seeds: FloatArray,
    position: FloatArray,
    lengths: FloatArray,
    lower: FloatArray,
    upper: FloatArray,
    tolerance: float,
    distances: FloatArray,
) -> None:
    for index in range(seeds.shape[0]):
        distances[index] = newton_to_position(
            seeds[index], position, lengths, lower, upper, tolerance
        )


def _starts(
    robot: RobotModel, q_seed: FloatArray, rng: np.random.Generator, count: int
) -> FloatArray:
    """Starting configurations (count, 7): the seed, ever wider around it, and all over."""
    scales = np.linspace(0.1, 1.2, count)[:, None]
    starts = q_seed + scales * rng.standard_normal((count, 7))
    starts[3::4] = rng.uniform(robot.lower, robot.upper, (len(starts[3::4]), 7))
    starts[0] = q_seed
    starts[:, 6] = q_seed[6]
    return np.clip(starts, robot.lower, robot.upper)


def ik_candidates(
    robot: RobotModel,
    position: FloatArray,
    q_seed: FloatArray,
    rng: np.random.Generator,
    *,
    count: int = 16,
    tolerance: float = 1e-7,
) -> FloatArray:
    """Different configurations with the tool at one position, nearest to a seed first.

    Args:
        robot: The robot.
        position: Tool position (3,) [m], base frame.
        q_seed: Configuration (7,) [rad] to stay near to; joint 7 is kept.
        rng: Draws the starting points.
        count: How many starting points; at most so many candidates come back.
        tolerance: Largest distance of the tool from the position [m].

    Returns:
        (n, 7) [rad] within the joint limits, n >= 1, pairwise at least 0.1 rad apart.

    Raises:
        PlanningError: when no starting point leads there, naming the distance that is missing.
    """
    target = np.ascontiguousarray(position, dtype=float)
    seed = np.asarray(q_seed, dtype=float)
    if target.shape != (3,) or not np.all(np.isfinite(target)):
        raise PlanningError(f"tool position {position!r}", expected="three finite numbers")
    if seed.shape != (7,) or not np.all(np.isfinite(seed)):
        raise PlanningError(f"IK seed {q_seed!r}", expected="seven finite joint angles")
    beyond = float(np.linalg.norm(target - robot.shoulder)) - robot.reach
    if beyond > 0.0:
        raise _unreachable(target, beyond)
    solutions = _starts(robot, seed, rng, count)
    distances = np.empty(count)
    _newton_all(solutions, target, robot.lengths, robot.lower, robot.upper, tolerance, distances)
    reached = solutions[distances <= tolerance]
    if not len(reached):
        raise _unreachable(target, float(distances.min()))
    order = np.argsort(np.linalg.norm(reached - seed, axis=1), kind="stable")
    chosen: list[FloatArray] = []
    for q in reached[order]:
        if all(np.linalg.norm((q - other)[:6]) > _DISTINCT for other in chosen):
            chosen.append(q)
    return np.array(chosen)


def solve_ik(
    robot: RobotModel,
    position: FloatArray,
    q_seed: FloatArray,
    rng: np.random.Generator,
    *,
    count: int = 16,
    tolerance: float = 1e-7,
) -> FloatArray:
    """The configuration (7,) nearest to a seed; arguments and errors as :func:`ik_candidates`."""
    nearest: FloatArray = ik_candidates(
        robot, position, q_seed, rng, count=count, tolerance=tolerance
    )[0]
    return nearest


def _unreachable(position: FloatArray, missing: float) -> PlanningError:
    at = ", ".join(f"{value:.3f}" for value in position)
    return PlanningError(
        f"tool position ({at}) m is out of reach by {1000.0 * missing:.1f} mm",
        hint="choose a goal nearer to the robot's shoulder (0, 0, 0.31), yet not in its base",
    )
