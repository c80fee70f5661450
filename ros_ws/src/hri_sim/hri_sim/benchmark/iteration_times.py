"""What single optimisation steps of a planner take by the clock of this machine."""

from __future__ import annotations

import time

import numpy as np
from numpy.typing import NDArray

from hri_planner.ptomp import HumanForecast, PtompPlanner
from hri_planner.ptomp.costs import CostModel
from hri_planner.ptomp.horizon import replan_grid
from hri_planner.ptomp.motion import from_plan
from hri_planner.ptomp.optimizer import Optimizer

FloatArray = NDArray[np.float64]

PAST_COLUMNS = 2
STEPS = 20
"""Steps that are timed at each replan, at most."""


class IterationTimer:
    """Times optimisation steps on what is left of a planner's plan, beside its replans.

    The optimiser polls a deadline before each step and does nothing else in between, so the polls of a
    run of it alone tell what each step took; within a replan other work lies between some of them.

    Args:
        planner: The planner; only its plan is read.
        goal: Tool goal (3,) [m].
        rng: Of the noise of these steps.
    """

    def __init__(self, planner: PtompPlanner, goal: FloatArray, rng: np.random.Generator) -> None:
        self._planner = planner
        self._goal = goal
        self._costs = CostModel(planner.robot, planner.config, planner.table)
        self._optimizer = Optimizer(planner.config, rng)

    def times(self, handover_s: float, known: list[HumanForecast]) -> list[float]:
        """What each of some steps of the replan that comes next takes [s]; none where little is left."""
        config, snapshot = self._planner.config, self._planner.snapshot()
        plan = snapshot.plan
        if plan is None or not snapshot.arrives:
            return []
        horizon_s = max(plan.end_s - handover_s, 0.2) + config.hold_horizon
        grid = replan_grid(plan, handover_s, self._planner.time_step, horizon_s)
        self._costs.bind(grid.columns_s, self._goal, known, config.margin, config.kappa)
        motion = from_plan(plan, grid, arrives=True)
        columns = motion.columns(grid)
        assert motion.arrival is not None
        stamps: list[float] = []

        def note() -> bool:
            stamps.append(time.perf_counter())
            return False

        done = self._optimizer.run(
            self._costs,
            columns,
            float(self._costs.evaluate(columns[None])[0][0]),
            free_until=PAST_COLUMNS + motion.arrival,
            free_end=False,
            sd=config.noise_sd,
            iterations=STEPS,
            deadline=note,
        )
        stamps.append(time.perf_counter())
        taken: list[float] = np.diff(stamps)[: done.iterations].tolist()
        return taken
