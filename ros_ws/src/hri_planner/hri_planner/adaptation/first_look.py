"""The situation at the start of a motion: its first plan held against what people are expected to do."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from hri_planner.ptomp.config import PtompConfig
from hri_planner.ptomp.costs import CostModel, TableBox
from hri_planner.ptomp.forecast import HumanForecast
from hri_planner.ptomp.plan import JointPlan
from hri_planner.ptomp.situation import Situation
from hri_planner.robot.model import RobotModel

FloatArray = NDArray[np.float64]

_STEPS = 42
"""Time steps of the look, always the same: it must not depend on what is chosen after it."""
_PAST = 2  # columns before the start


class FirstLook:
    """Examines first plans; works in buffers of its own, one thread at a time.

    Args:
        robot: The robot.
        config: Weights and margins.
        table: The table, if any.
    """

    def __init__(self, robot: RobotModel, config: PtompConfig, table: TableBox | None) -> None:
        self._margin = config.margin
        self._costs = CostModel(robot, config, table)

    def situation(
        self,
        plan: JointPlan,
        goal: FloatArray,
        duration_s: float,
        forecasts: Sequence[HumanForecast],
        *,
        uncertainties: Sequence[float],
        errors: Sequence[float],
        distance: float,
    ) -> Situation:
        """The five inputs at the start of a motion.

        Args:
            plan: The first plan, which knows of nobody.
            goal: Of the tool (3,) [m].
            duration_s: Duration that the motion is to have [s].
            forecasts: People, on the plan's clock.
            uncertainties: Of the prediction of each arm [m].
            errors: Of the predictions of each arm [m].
            distance: Smallest surface distance robot-person now [m].
        """
        step = max(plan.end_s - plan.start_s, 1e-3) / _STEPS
        times = np.asarray(plan.start_s + step * np.arange(-_PAST, _STEPS + 1), dtype=np.float64)
        q, qd, _ = plan.sample(np.maximum(times, plan.start_s))
        q[:_PAST] += (times[:_PAST, None] - plan.start_s) * qd[:_PAST]
        columns = np.ascontiguousarray(q.T)[None]
        self._costs.bind(times, goal, forecasts, self._margin)
        collision = float(self._costs.evaluate(columns)[1][0, 0])
        contact = self._costs.clearances(columns)[0, _PAST:] < 0.0
        left_s = int(np.argmax(contact)) * step if contact.any() else duration_s
        return Situation(
            uncertainty=max(uncertainties, default=0.0),
            error=max(errors, default=0.0),
            distance=distance,
            time_to_collision=left_s,
            collision_cost=collision,
        )
