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

from hri_planner.ptomp.config import PtompConfig, dtype_of
from hri_planner.ptomp.costs import CostModel
from hri_planner.ptomp.iteration import JOINTS, MIN_WINDOW, iterate
from hri_planner.ptomp.layout import FIRST_FREE, ROW, TERM_COUNT
from hri_planner.ptomp.smoothing import smoothing_factors

FloatArray = NDArray[np.float64]

_POOL = 1 << 17
_SD_RANGE = (0.01, 0.8)
_PROGRESS = 1e-4  # share of the cost that counts as success
_PATIENCE = 12  # iterations without success after which more are a waste


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
        dtype = dtype_of(config)
        self._config = config
        self._rng = rng
        need = config.num_rollouts * (JOINTS * (ROW + 1) + 2)
        self._normals = rng.standard_normal(_POOL + need).astype(dtype)
        band, scale = smoothing_factors()
        self._band, self._scale = band.astype(dtype), scale.astype(dtype)
        self._rollouts = np.zeros((config.num_rollouts, 7, ROW), dtype)
        self._costs = np.zeros(config.num_rollouts, dtype)
        self._elites = np.zeros((config.num_elites, 7, ROW), dtype)
        self._elite_costs = np.zeros(config.num_elites, dtype)
        self._mean = np.zeros((7, ROW), dtype)
        self._terms = np.zeros(TERM_COUNT, dtype)

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
            model: Bound cost model, of the same configuration.
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
        if free_until - FIRST_FREE < MIN_WINDOW:
            return Optimised(trajectory.copy(), cost, 0)
        incumbent = model.pad(trajectory[None])[0]
        self._elite_costs[:] = np.inf
        fixed = (config.exponentiated_cost_sensitivity, self._normals)
        buffers = (
            self._rollouts, self._costs, self._elites, self._elite_costs, self._mean, self._terms,
        )  # fmt: skip
        places = self._rng.integers(_POOL, size=iterations)
        done, failures = 0, 0
        while done < iterations and failures < _PATIENCE:
            if deadline is not None and deadline():
                break
            after = iterate(
                incumbent, cost, columns, free_until, free_end, sd, *fixed, places[done],
                self._band, self._scale, *model.problem, *buffers,
            )  # fmt: skip
            success = after < cost - _PROGRESS * abs(cost)
            cost = after
            failures = 0 if success else failures + 1
            factor = config.noise_growth if success else config.noise_decay
            sd = min(max(sd * factor, _SD_RANGE[0]), _SD_RANGE[1])
            done += 1
        return Optimised(incumbent[:, :columns].astype(np.float64), cost, done)
