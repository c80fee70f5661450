"""The stochastic optimiser core of all planners: smooth noise, weights by cost.

By default, after STOMP (Kalakrishnan et al. 2011) but with total-cost weights instead of a weight per
time step: roll-outs and the elites of earlier iterations are averaged with weights
exp(-h (J - J_min) / (J_max - J_min)); the average or the best roll-out replaces the incumbent if it
costs less. Noise widens after a success and narrows after a failure. STOMP's own update, with weights
at each time step and smoothing by M, and its going on from every update, are options.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hri_planner.ptomp.config import PtompConfig, dtype_of
from hri_planner.ptomp.costs import CostModel
from hri_planner.ptomp.iteration import JOINTS, MIN_WINDOW, iterate
from hri_planner.ptomp.layout import FIRST_FREE, ROW, TERM_COUNT
from hri_planner.ptomp.smoothing import smoothing_factors
from hri_planner.ptomp.stepwise import iterate_stepwise, update_smoother

FloatArray = NDArray[np.float64]
Array = NDArray[Any]

_POOL = 1 << 17
_SD_RANGE = (0.01, 0.8)
_PROGRESS = 1e-4  # share of the cost that counts as success


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
        # Roll-outs, then elites.
        count = config.num_rollouts + config.num_elites
        self._trajectories = np.zeros((count, 7, ROW), dtype)
        self._totals = np.zeros(count, dtype)
        stepwise = config.weights == "per_step"
        self._column_costs = np.zeros((count if stepwise else 0, ROW), dtype)
        self._raw = np.zeros((7, ROW), dtype)
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
        self._totals[:] = np.inf
        iteration = self._iteration(model, free_until, free_end)
        best, best_cost = incumbent, cost
        if config.accept_worse:
            best = incumbent.copy()
        places = self._rng.integers(_POOL, size=iterations)
        done, failures = 0, 0
        patience = config.patience or iterations
        while done < iterations and failures < patience:
            if deadline is not None and deadline():
                break
            from_cost = np.inf if config.accept_worse else best_cost
            after = iteration(incumbent, from_cost, sd, places[done])
            success = after < best_cost - _PROGRESS * abs(best_cost)
            if after < best_cost:
                best_cost = after
                if best is not incumbent:
                    best[:] = incumbent
            failures = 0 if success else failures + 1
            factor = config.noise_growth if success else config.noise_decay
            sd = min(max(sd * factor, _SD_RANGE[0]), _SD_RANGE[1])
            done += 1
        return Optimised(best[:, :columns].astype(np.float64), float(best_cost), done)

    def _iteration(
        self, model: CostModel, free_until: int, free_end: bool
    ) -> Callable[[Array, float, float, int], float]:
        """One iteration as a function of incumbent, its cost, noise level and place in the normals."""
        config, columns = self._config, model.columns
        count = config.num_rollouts
        noise = (config.exponentiated_cost_sensitivity, self._normals)
        factors = (self._band, self._scale)
        split = (
            self._trajectories[:count], self._totals[:count],
            self._trajectories[count:], self._totals[count:],
        )  # fmt: skip
        ends = (self._mean, self._terms)
        # Where the end moves too, no time step alone says what it costs.
        if config.weights == "total" or free_end:

            def by_total(incumbent: Array, cost: float, sd: float, place: int) -> float:
                return float(
                    iterate(
                        incumbent, cost, columns, free_until, free_end, sd, *noise, place, *factors,
                        *model.problem, *split, *ends,
                    )
                )  # fmt: skip

            return by_total
        size = free_until - FIRST_FREE if config.update_smoothing else 0
        smoother = update_smoother(size)
        whole = (self._trajectories, self._totals, self._column_costs)

        def by_step(incumbent: Array, cost: float, sd: float, place: int) -> float:
            return float(
                iterate_stepwise(
                    incumbent, cost, columns, free_until, sd, *noise, place, *factors, smoother,
                    *model.problem, *whole, count, self._raw, *ends,
                )
            )  # fmt: skip

        return by_step
