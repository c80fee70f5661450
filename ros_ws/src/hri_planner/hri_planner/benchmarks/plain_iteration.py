"""One iteration of the optimiser in NumPy, all roll-outs at once: what ours is measured against."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from hri_planner.benchmarks.plain_distances import row_gaps, row_points
from hri_planner.ptomp.config import PtompConfig
from hri_planner.ptomp.iteration import EASE, JOINTS
from hri_planner.ptomp.layout import FIRST_FREE, TERMS
from hri_planner.robot.model import RobotModel

Array = NDArray[np.float64]
Arm = tuple[Array, Array, Array]
"""Points (P, 4, 3) and standard deviations (P, 4) at the columns, radii (3,) [m]."""


class PlainCosts:
    """The planner's costs, with the distances that are fastest in NumPy.

    Args:
        robot: The robot.
        config: Weights and margins.
        goal: Of the tool (3,) [m].
        step: Time between columns [s].
        margin: Margin in force [m].
        table_top: Height of the table [m].
        arms: People.
    """

    def __init__(
        self,
        robot: RobotModel,
        config: PtompConfig,
        goal: Array,
        step: float,
        margin: float,
        table_top: float,
        arms: Sequence[Arm],
    ) -> None:
        self.robot, self.config, self.goal, self.step = robot, config, goal, step
        self.margin, self.table_top = margin, table_top
        self.arms = [
            (np.ascontiguousarray(points.transpose(1, 2, 0)), np.ascontiguousarray(sigma.T), radii)
            for points, sigma, radii in arms
        ]

    def terms(self, trajectories: Array) -> tuple[Array, Array]:
        """Weighted terms (n, TERM_COUNT) and smallest clearance (n,) of trajectories (n, 7, P)."""
        config, robot, step = self.config, self.robot, self.step
        count = len(trajectories)
        q = np.ascontiguousarray(trajectories.transpose(1, 0, 2))
        rows = row_points(list(q[:6]), robot.lengths.tolist(), np)
        points = np.array(rows)
        free = slice(FIRST_FREE, None)
        term = {name: np.zeros(count) for name in TERMS}
        nearest = np.full(count, np.inf)
        for arm, sigma, radii in self.arms:
            found = row_gaps(rows, robot.capsule_radii.tolist(), list(arm), radii.tolist(), np)
            for part in found:
                for limb, (gap, place) in enumerate(part):
                    spread = sigma[limb] + place * (sigma[limb + 1] - sigma[limb])
                    hinge = np.maximum(0.0, (self.margin + config.kappa * spread - gap) / 0.05)
                    touch = np.maximum(0.0, (config.contact_margin - gap) / 0.01)
                    term["collision"] += _squares(hinge[:, free])
                    term["contact"] += _squares(touch[:, free])
                    nearest = np.minimum(nearest, gap[:, 2:].min(axis=1))
        middle = 0.5 * (points[:-1] + points[1:])[..., 2:]
        speed = np.diff(middle, axis=-1) / step
        moving = np.einsum("kxni,kxni->kn", speed, speed)
        height = middle[:, 2, :, :-1].sum(axis=2)
        term["effort"] = robot.part_masses @ (0.5 * moving + 9.81 * height)
        tool = points[3]
        jerk = np.diff(tool, n=3, axis=-1) / step**3
        term["jerk"] = np.einsum("xni,xni->n", jerk, jerk)
        scale = config.joint_limit_scale
        limits = np.zeros(count)
        for joint in range(7):
            low, high = robot.lower[joint], robot.upper[joint]
            beyond = np.maximum(low - q[joint, :, free], q[joint, :, free] - high) / scale
            limits += np.where(beyond > -10.0, np.exp(np.minimum(beyond, 50.0)), 0.0).sum(axis=1)
        term["joint_limits"] = limits
        share = np.abs(np.diff(q[:, :, 1:], axis=2)) / (step * robot.velocity)[:, None, None]
        fast = np.maximum(0.0, (share - config.speed_share) * 20.0)
        bend = np.diff(q, n=2, axis=2) / step**2
        largest = config.acceleration_limit
        hard = np.maximum(0.0, (np.abs(bend) - largest) * (10.0 / largest))
        for name, values in (("speed", fast), ("acceleration", hard), ("control", bend)):
            term[name] = np.einsum("jni,jni->n", values, values)
        for point, radius in zip((1, 2, 3), robot.capsule_radii[[1, 1, 2]], strict=True):
            low = self.table_top + config.table_margin + radius - points[point, 2, :, free]
            term["table"] += _squares(np.maximum(0.0, low / 0.02))
        offset = tool[:, :, free] - self.goal[:, None, None]
        term["goal"] = np.sqrt((offset**2).sum(axis=0)).sum(axis=1)
        weights = {
            "collision": config.collision_weight, "contact": config.contact_weight,
            "effort": config.effort_weight, "jerk": config.jerk_weight,
            "joint_limits": config.joint_limit_weight, "speed": config.speed_weight,
            "acceleration": config.acceleration_weight, "table": config.table_weight,
            "goal": config.goal_weight, "control": 0.5 * config.control_weight,
            "interaction_learned": 0.0,  # is off unless a case is named, and no part of the comparison
        }  # fmt: skip
        return np.stack([step * weights[name] * term[name] for name in TERMS], axis=1), nearest


def _squares(values: Array) -> Array:
    """Sum of squares along the last axis."""
    total: Array = np.einsum("ni,ni->n", values, values)
    return total


class PlainOptimizer:
    """Iterations as ours, except that all noise spans the whole trajectory (ours: every second one).

    Args:
        costs: The costs.
        config: Numbers of roll-outs and elites.
        rng: Of the noise.
        trajectory: First incumbent (7, P) [rad]; the last column stays.
    """

    def __init__(
        self, costs: PlainCosts, config: PtompConfig, rng: np.random.Generator, trajectory: Array
    ) -> None:
        self.costs, self.config = costs, config
        self.incumbent = trajectory.copy()
        self.cost = float(costs.terms(trajectory[None])[0].sum())
        room = trajectory.shape[1] - 1 - FIRST_FREE
        self._pool = rng.standard_normal(1 << 17)
        self._rng = rng
        self._smooth = smoothing_matrix(room)
        ease = np.ones(room)
        ease[: len(EASE)] *= EASE
        ease[room - len(EASE) :] *= EASE[::-1]
        self._smooth = self._smooth * ease
        self._elites = np.empty((0, *trajectory.shape))
        self._elite_costs = np.empty(0)

    def iterate(self, sd: float) -> float:
        """One iteration; the incumbent's cost afterwards."""
        config = self.config
        room = len(self._smooth)
        need = config.num_rollouts * JOINTS * room
        place = int(self._rng.integers(len(self._pool) - need))
        noise = self._pool[place : place + need].reshape(-1, room) @ (sd * self._smooth)
        rollouts = np.repeat(self.incumbent[None], config.num_rollouts, axis=0)
        free = slice(FIRST_FREE, FIRST_FREE + room)
        rollouts[:, :JOINTS, free] += noise.reshape(config.num_rollouts, JOINTS, room)
        costs = self.costs.terms(rollouts)[0].sum(axis=1)
        everything = np.concatenate((rollouts, self._elites))
        every_cost = np.concatenate((costs, self._elite_costs))
        lowest = every_cost.min()
        width = max(float(costs.max() - lowest), 1e-12)
        weights = np.exp(-config.exponentiated_cost_sensitivity * (every_cost - lowest) / width)
        mean = self.incumbent.copy()
        mean[:, free] = np.tensordot(weights / weights.sum(), everything[:, :, free], 1)
        kept = np.argsort(every_cost)[: config.num_elites]
        self._elites, self._elite_costs = everything[kept], every_cost[kept]
        after = float(self.costs.terms(mean[None])[0].sum())
        best = int(np.argmin(costs))
        if costs[best] < min(after, self.cost):
            self.incumbent, self.cost = rollouts[best], float(costs[best])
        elif after < self.cost:
            self.incumbent, self.cost = mean, after
        return self.cost


def smoothing_matrix(size: int) -> Array:
    """M (size, size): z M has covariance R^-1 for standard normals z, largest deviation 1.

    R = A'A of the second difference of a sequence that is zero outside; see ptomp/smoothing.py.
    """
    difference = np.zeros((size + 2, size))
    for i in range(size):
        difference[i : i + 3, i] = (1.0, -2.0, 1.0)
    factor = np.linalg.cholesky(difference.T @ difference)
    matrix: Array = np.linalg.inv(factor)
    deviation = np.sqrt((matrix**2).sum(axis=0))
    return np.asarray(matrix / deviation[size // 2])
