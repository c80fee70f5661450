"""The cost of trajectories for one replan: robot, person, table and goal bound to the kernel."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hri_planner.ptomp import kernel
from hri_planner.ptomp.config import PtompConfig
from hri_planner.ptomp.forecast import HumanForecast, pack_forecasts
from hri_planner.robot.model import RobotModel

FloatArray = NDArray[np.float64]

NO_TABLE = -1e3


@dataclass(frozen=True)
class TableBox:
    """A table; the planner keeps the robot above the plane of its top.

    Attributes:
        center: Centre (3,) [m], base frame.
        size: Full lengths (3,) [m].
    """

    center: tuple[float, float, float]
    size: tuple[float, float, float]

    @property
    def top(self) -> float:
        """Height of the top [m]."""
        return self.center[2] + 0.5 * self.size[2]


class CostModel:
    """Costs of trajectories (n, 7, P) on one grid of times.

    Args:
        robot: The robot.
        config: Weights and margins.
        table: The table, if any.
    """

    def __init__(self, robot: RobotModel, config: PtompConfig, table: TableBox | None) -> None:
        self._robot = robot
        self._kappa = config.kappa
        self._workspace = np.zeros(kernel.WORKSPACE_ROWS * kernel.ROW)
        self._parameters = np.zeros(kernel.PARAMETER_COUNT)
        height = NO_TABLE if table is None else table.top + config.table_margin
        for position, value in {
            kernel.P_MARGIN: config.margin,
            kernel.P_KAPPA: config.kappa,
            kernel.P_COLLISION: config.collision_weight,
            kernel.P_CONTACT_MARGIN: config.contact_margin,
            kernel.P_CONTACT: config.contact_weight,
            kernel.P_EFFORT: config.effort_weight,
            kernel.P_JERK: config.jerk_weight,
            kernel.P_LIMITS: config.joint_limit_weight,
            kernel.P_LIMIT_SCALE: config.joint_limit_scale,
            kernel.P_SPEED: config.speed_weight,
            kernel.P_SPEED_SHARE: config.speed_share,
            kernel.P_ACCELERATION: config.acceleration_weight,
            kernel.P_ACCELERATION_LIMIT: config.acceleration_limit,
            kernel.P_TABLE: config.table_weight,
            kernel.P_TABLE_HEIGHT: height,
            kernel.P_GOAL: config.goal_weight,
            kernel.P_CONTROL: config.control_weight,
        }.items():
            self._parameters[position] = value
        self._terms = np.empty((0, kernel.TERM_COUNT))
        self._nearest = np.empty(0)
        self.columns = 0
        self.step = 0.0
        self.arguments: tuple[FloatArray, ...] = ()

    def bind(
        self,
        times_s: FloatArray,
        goal: FloatArray,
        forecasts: Sequence[HumanForecast],
        margin: float,
        kappa: float | None = None,
    ) -> None:
        """Set the problem of a replan.

        Args:
            times_s: Uniform times of the columns (P,), two of the past first [s].
            goal: Tool goal (3,) [m].
            forecasts: People.
            margin: Margin in force [m].
            kappa: Standard deviations added to it; the configured ones when not given.
        """
        self.columns = len(times_s)
        self.step = float(times_s[1] - times_s[0])
        self._parameters[kernel.P_MARGIN] = margin
        self._parameters[kernel.P_KAPPA] = self._kappa if kappa is None else kappa
        self._parameters[kernel.P_GOAL_X : kernel.P_GOAL_X + 3] = goal
        humans, radii = pack_forecasts(forecasts, times_s)
        robot = self._robot
        self.arguments = (
            robot.lengths,
            robot.part_masses,
            robot.capsule_radii,
            robot.lower,
            robot.upper,
            robot.velocity,
            humans,
            radii,
            self._parameters,
            self._workspace,
        )

    def evaluate(self, trajectories: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Costs of trajectories (n, 7, P), P at least the number of columns.

        Returns:
            Total (n,), terms (n, TERM_COUNT) and smallest predicted clearance (n,) [m]; the last
            two are views that the next call overwrites.
        """
        count = len(trajectories)
        if count > len(self._terms):
            self._terms = np.empty((count, kernel.TERM_COUNT))
            self._nearest = np.empty(count)
        terms, nearest = self._terms[:count], self._nearest[:count]
        kernel.many_costs(trajectories, self.columns, self.step, *self.arguments, terms, nearest)
        return terms.sum(axis=1), terms, nearest

    def clearance_profile(self, trajectory: FloatArray) -> FloatArray:
        """Predicted clearance of one trajectory (7, P) at each column (P,) [m]."""
        terms, nearest = np.empty((1, kernel.TERM_COUNT)), np.empty(1)
        kernel.many_costs(
            trajectory[None], self.columns, self.step, *self.arguments, terms, nearest
        )
        return kernel.clearance_row(self._workspace)[: self.columns].copy()
