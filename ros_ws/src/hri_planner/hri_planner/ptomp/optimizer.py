"""The stochastic optimiser core: smooth noise, weights by total cost, accept only what is better.

After STOMP (Kalakrishnan et al. 2011), with total-cost weights instead of a weight per time step:
roll-outs and the elites of earlier iterations are averaged with weights
exp(-h (J - J_min) / (J_max - J_min)); the average or the best roll-out replaces the incumbent if it
costs less. Noise widens after a success and narrows after a failure.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hri_planner.ptomp.config import PtompConfig
from hri_planner.ptomp.costs import CostModel
from hri_planner.ptomp.kernel import FIRST_FREE, ROW
from hri_planner.ptomp.smoothing import back_substitute, smoothing_factors
from hri_prediction.compiled import njit

FloatArray = NDArray[np.float64]

_POOL = 1 << 17
_JOINTS = 6  # the seventh moves no capsule, so noise on it could only cost
_MIN_WINDOW = 6
_EASE = (0.4, 0.75, 0.95)
_SD_RANGE = (0.01, 0.8)
_PROGRESS = 1e-4  # share of the cost that counts as success
_PATIENCE = 12  # iterations without success after which more are a waste


@njit
def _disturb(
    trajectory: FloatArray,
    columns: int,
    free_until: int,
    free_end: bool,
    full: bool,
    sd: float,
    normals: FloatArray,
    place: int,
    band: FloatArray,
    scale: FloatArray,
) -> int:
    """Add noise in place; returns how many normals were used.

    ``full`` noise spans all free columns, otherwise a random part of them: whole-span noise hardly
    has short waves, but a person who comes late asks for them. With ``free_end`` the end of the
    trajectory moves too, by a smooth step.
    """
    room = free_until - FIRST_FREE
    first, size = FIRST_FREE, room
    used = 0
    if not full and room > 2 * _MIN_WINDOW:
        # Fractional parts of normals are near enough to uniform here.
        u = abs(normals[place]) * 7.0
        v = abs(normals[place + 1]) * 7.0
        used = 2
        size = _MIN_WINDOW + int((u - int(u)) * (room - _MIN_WINDOW))
        first = FIRST_FREE + int((v - int(v)) * (room - size + 1))
    spread = sd * scale[size] * (size / room)
    for joint in range(_JOINTS):
        start = place + used
        back_substitute(
            band, normals[start : start + size], size, spread, trajectory[joint, first:]
        )
        used += size
    if free_end:
        for joint in range(_JOINTS):
            shift = sd * normals[place + used]
            used += 1
            for i in range(first, columns):
                x = min((i - first + 1.0) / size, 1.0)
                trajectory[joint, i] += shift * x * x * x * (10.0 - 15.0 * x + 6.0 * x * x)
    return used


@njit
def _ease(rollout: FloatArray, incumbent: FloatArray, first: int, direction: int) -> None:
    """Damp the noise at the first columns of an end, where the acceleration is given.

    Noise starts like t^2, a jump in acceleration; damped so, it starts like t^3.
    """
    for joint in range(_JOINTS):
        for k in range(len(_EASE)):
            i = first + direction * k
            change = rollout[joint, i] - incumbent[joint, i]
            rollout[joint, i] = incumbent[joint, i] + _EASE[k] * change


@njit
def _copy(source: FloatArray, target: FloatArray, columns: int) -> None:
    for joint in range(7):
        for i in range(columns):
            target[joint, i] = source[joint, i]


@njit
def _add(target: FloatArray, source: FloatArray, weight: float, columns: int) -> None:
    for joint in range(7):
        for i in range(FIRST_FREE, columns):
            target[joint, i] += weight * source[joint, i]


@njit
def explore(
    incumbent: FloatArray,
    columns: int,
    free_until: int,
    free_end: bool,
    sd: float,
    rollouts: FloatArray,
    normals: FloatArray,
    place: int,
    band: FloatArray,
    scale: FloatArray,
) -> None:
    """Fill the roll-outs (NT, 7, ROW) with the incumbent (7, ROW) plus noise."""
    for index in range(rollouts.shape[0]):
        rollout = rollouts[index]
        _copy(incumbent, rollout, columns)
        place += _disturb(
            rollout, columns, free_until, free_end, index % 2 == 0, sd, normals, place, band, scale
        )
        _ease(rollout, incumbent, FIRST_FREE, 1)
        if not free_end:
            _ease(rollout, incumbent, free_until - 1, -1)


@njit
def average(
    incumbent: FloatArray,
    columns: int,
    free_until: int,
    sensitivity: float,
    rollouts: FloatArray,
    costs: FloatArray,
    elites: FloatArray,
    elite_costs: FloatArray,
    mean: FloatArray,
) -> None:
    """Weighted average of roll-outs and elites into mean (1, 7, ROW), then renew the elites.

    ``elites`` is (n, 7, ROW) with costs (n,), infinite where still empty. Columns from
    ``free_until`` on are those of the incumbent.
    """
    count, kept = rollouts.shape[0], elites.shape[0]
    lowest, worst = costs.min(), costs.max()
    for index in range(kept):
        lowest = min(lowest, elite_costs[index])
    width = max(worst - lowest, 1e-12)
    total = 0.0
    for joint in range(7):
        for i in range(columns):
            mean[0, joint, i] = 0.0
    for index in range(count):
        weight = np.exp(-sensitivity * (costs[index] - lowest) / width)
        total += weight
        _add(mean[0], rollouts[index], weight, columns)
    for index in range(kept):
        if elite_costs[index] < np.inf:
            weight = np.exp(-sensitivity * (elite_costs[index] - lowest) / width)
            total += weight
            _add(mean[0], elites[index], weight, columns)
    for joint in range(7):
        for i in range(columns):
            if FIRST_FREE <= i < free_until:
                mean[0, joint, i] /= total
            else:
                mean[0, joint, i] = incumbent[joint, i]
    for index in range(count):
        if kept == 0:
            break
        slot = np.argmax(elite_costs)
        if costs[index] < elite_costs[slot]:
            elite_costs[slot] = costs[index]
            _copy(rollouts[index], elites[slot], columns)


@dataclass
class Optimised:
    """Result of an optimisation.

    Attributes:
        trajectory: (7, P) [rad].
        cost: Its total cost.
        iterations: Iterations done.
    """

    trajectory: FloatArray
    cost: float
    iterations: int


class Optimizer:
    """Runs iterations on one cost model.

    Args:
        config: Numbers of roll-outs and elites, noise.
        rng: Fills the pool of normals and picks from it.
    """

    def __init__(self, config: PtompConfig, rng: np.random.Generator) -> None:
        self._config = config
        self._rng = rng
        need = config.num_rollouts * (_JOINTS * (ROW + 1) + 2)
        self._normals = rng.standard_normal(_POOL + need)
        self._band, self._scale = smoothing_factors()
        self._rollouts = np.zeros((config.num_rollouts, 7, ROW))
        self._elites = np.zeros((config.num_elites, 7, ROW))
        self._elite_costs = np.zeros(config.num_elites)
        self._mean = np.zeros((1, 7, ROW))

    def run(
        self,
        model: CostModel,
        trajectory: FloatArray,
        cost: float,
        *,
        free_until: int,
        free_end: bool,
        sd: float,
        iterations: int,
        deadline: Callable[[], bool] | None,
    ) -> Optimised:
        """Improve a trajectory.

        Args:
            model: Bound cost model.
            trajectory: Start (7, P) [rad]; not changed.
            cost: Its cost.
            free_until: First column that stays as it is (the arrival), P if none does.
            free_end: Whether the end posture may move too.
            sd: First noise level [rad].
            iterations: Largest number of iterations.
            deadline: Polled before each iteration; true stops.
        """
        config = self._config
        columns = model.columns
        best = np.zeros((7, ROW))
        best[:, :columns] = trajectory
        self._elite_costs[:] = np.inf
        done, failures = 0, 0
        if free_until - FIRST_FREE < _MIN_WINDOW:
            return Optimised(trajectory.copy(), cost, 0)
        averaged = columns if free_end else free_until
        while done < iterations and failures < _PATIENCE:
            if deadline is not None and deadline():
                break
            place = int(self._rng.integers(_POOL))
            explore(
                best, columns, free_until, free_end, sd, self._rollouts, self._normals, place,
                self._band, self._scale,
            )  # fmt: skip
            costs = model.evaluate(self._rollouts)[0]
            average(
                best, columns, averaged, config.exponentiated_cost_sensitivity, self._rollouts,
                costs, self._elites, self._elite_costs, self._mean,
            )  # fmt: skip
            after = float(model.evaluate(self._mean)[0][0])
            winner, lowest = self._mean[0], int(np.argmin(costs))
            if costs[lowest] < after:
                winner, after = self._rollouts[lowest], float(costs[lowest])
            success = after < cost - _PROGRESS * abs(cost)
            if after < cost:
                best[:] = winner
                cost = after
            failures = 0 if success else failures + 1
            factor = config.noise_growth if success else config.noise_decay
            sd = min(max(sd * factor, _SD_RANGE[0]), _SD_RANGE[1])
            done += 1
        return Optimised(np.ascontiguousarray(best[:, :columns]), cost, done)
