"""Adaptation of a live planner: asked once, when a motion starts."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from hri_planner.adaptation.first_look import FirstLook
from hri_planner.adaptation.grid import Cell, Selection, with_cell
from hri_planner.ptomp.config import PtompConfig
from hri_planner.ptomp.costs import TableBox
from hri_planner.ptomp.forecast import HumanForecast
from hri_planner.ptomp.planner import PtompPlanner
from hri_planner.robot.model import RobotModel

FloatArray = NDArray[np.float64]

KEPT = 8
"""Planners of so many sizes are kept for motions to come."""


class OnlineAdaptation:
    """Makes planners of the size that suits the situation.

    What it adds to the start of a motion are a planner's buffers, about 3.5 ms on the reference machine
    where the size was not met before; looking, choosing and taking over take a third of a millisecond.

    Args:
        selection: Chooses time steps and roll-outs.
        robot: The robot.
        config: Of the planners, but for these two.
        rng: Source of all their randomness.
        table: Table to stay above, if any.
    """

    def __init__(
        self,
        selection: Selection,
        robot: RobotModel,
        config: PtompConfig,
        rng: np.random.Generator,
        table: TableBox | None,
    ) -> None:
        self._selection = selection
        self._robot = robot
        self._config = config
        self._rng = rng
        self._table = table
        self._first = PtompPlanner(robot, config, rng, table)
        self._look = FirstLook(robot, config, table)
        self._made: OrderedDict[Cell, PtompPlanner] = OrderedDict()

    def start(
        self,
        present: PtompPlanner,
        state: tuple[FloatArray, FloatArray],
        goal: FloatArray,
        duration_s: float,
        forecasts: Sequence[HumanForecast],
        *,
        uncertainties: Sequence[float],
        errors: Sequence[float],
        distance: float,
    ) -> PtompPlanner:
        """A planner that has started a motion at time 0 of the plan clock.

        Args:
            present: The planner of the motion before; it goes on if its size fits.
            state: Joint angles [rad] and velocities [rad/s], (7,) each.
            goal: Of the tool (3,) [m].
            duration_s: Duration that the motion is to have [s].
            forecasts: People, on the plan's clock.
            uncertainties: Of the prediction of each arm [m].
            errors: Of the predictions of each arm [m].
            distance: Smallest surface distance robot-person now [m].

        Raises:
            PlanningError: when there is no way to the goal; the present planner is as it was.
        """
        plan = self._first.start(*state, goal, duration_s, 0.0)
        seen = self._look.situation(
            plan,
            goal,
            duration_s,
            forecasts,
            uncertainties=uncertainties,
            errors=errors,
            distance=distance,
        )
        planner = self._of(self._selection.choose(seen), present)
        planner.take_over(self._first)
        return planner

    def _of(self, cell: Cell, present: PtompPlanner) -> PtompPlanner:
        """A planner of a size: the present one, one of those kept, or a new one."""
        config = with_cell(self._config, cell)
        if config == present.config:
            return present
        planner = self._made.pop(cell, None)
        if planner is None:
            planner = PtompPlanner(self._robot, config, self._rng, self._table)
        self._made[cell] = planner
        if len(self._made) > KEPT:
            self._made.popitem(last=False)
        return planner
