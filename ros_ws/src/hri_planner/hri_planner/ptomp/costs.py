"""The cost of trajectories for one replan: robot, person, table and goal bound to the kernel."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hri_planner.ptomp import kernel, layout
from hri_planner.ptomp.clearance import many_clearances
from hri_planner.ptomp.config import PtompConfig, dtype_of
from hri_planner.ptomp.forecast import HumanForecast, pack_forecasts
from hri_planner.ptomp.interaction import find_nearness
from hri_planner.robot.model import RobotModel
from hri_prediction.errors import ConfigError

FloatArray = NDArray[np.float64]
Array = NDArray[Any]

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
        config: Weights and margins, and the type of number to compute in.
        table: The table, if any.
    """

    def __init__(self, robot: RobotModel, config: PtompConfig, table: TableBox | None) -> None:
        self.dtype = np.dtype(dtype_of(config))
        self._kappa = config.kappa
        self._growth = config.margin_growth
        self._body = pack_robot(robot).astype(self.dtype)
        self._workspace = np.zeros(layout.WORKSPACE_ROWS * layout.ROW, self.dtype)
        self._parameters = np.zeros(layout.PARAMETER_COUNT, self.dtype)
        height = NO_TABLE if table is None else table.top + config.table_margin
        for position, value in {
            layout.P_MARGIN: config.margin,
            layout.P_KAPPA: config.kappa,
            layout.P_COLLISION: config.collision_weight,
            layout.P_CONTACT_MARGIN: config.contact_margin,
            layout.P_CONTACT: config.contact_weight,
            layout.P_EFFORT: config.effort_weight,
            layout.P_JERK: config.jerk_weight,
            layout.P_LIMITS: config.joint_limit_weight,
            layout.P_LIMIT_SCALE: config.joint_limit_scale,
            layout.P_SPEED: config.speed_weight,
            layout.P_SPEED_SHARE: config.speed_share,
            layout.P_ACCELERATION: config.acceleration_weight,
            layout.P_ACCELERATION_LIMIT: config.acceleration_limit,
            layout.P_TABLE: config.table_weight,
            layout.P_TABLE_HEIGHT: height,
            layout.P_GOAL: config.goal_weight,
            layout.P_CONTROL: config.control_weight,
            layout.P_PARALLEL: 50.0 * np.finfo(self.dtype).eps,
            layout.P_GRAVITY: config.gravity,
            layout.P_LITERAL: float(config.collision_cost == "literal"),
        }.items():
            self._parameters[position] = value
        if config.interaction_costs:
            learnt = find_nearness(config.interaction_costs, config.interaction_file)
            self._parameters[layout.P_LEARNT] = config.interaction_weight
            self._parameters[layout.P_LEARNT_STEEP] = 1.0 / learnt.length
            self._parameters[layout.P_NEARNESS :] = learnt.weights
        self._terms = np.empty((0, layout.TERM_COUNT), self.dtype)
        self._nearest = np.empty(0, self.dtype)
        self.columns = 0
        self.problem: tuple[Array, ...] = ()

    def bind(
        self,
        times_s: FloatArray,
        goal: FloatArray,
        forecasts: Sequence[HumanForecast],
        margin: float,
        kappa: float | None = None,
        growth: float | None = None,
    ) -> None:
        """Set the problem of a replan.

        Args:
            times_s: Uniform times of the columns (P,), two of the past first [s].
            goal: Tool goal (3,) [m].
            forecasts: People.
            margin: Margin in force [m].
            kappa: Standard deviations added to it; the configured ones when not given.
            growth: What it grows by with each second ahead; as configured when not given [m/s].

        Raises:
            ConfigError: when there are more columns than the kernels have room for.
        """
        if len(times_s) > layout.MAX_COLUMNS:
            raise ConfigError(f"{len(times_s)} columns", expected=f"at most {layout.MAX_COLUMNS}")
        self.columns = len(times_s)
        self._parameters[layout.P_STEP] = times_s[1] - times_s[0]
        self._parameters[layout.P_MARGIN] = margin
        kappa = self._kappa if kappa is None else kappa
        self._parameters[layout.P_KAPPA] = kappa
        self._parameters[layout.P_GOAL_X : layout.P_GOAL_X + 3] = goal
        humans, radii = pack_forecasts(forecasts, times_s)
        growth = self._growth if growth is None else growth
        if growth > 0.0:
            # The kernels add kappa times the standard deviations, so the growth goes in by that.
            ahead = np.maximum(times_s - times_s[2], 0.0) * (growth / kappa)
            deviations = humans.reshape(-1, layout.ARM_ROWS, layout.ROW)
            deviations[:, layout.ARM_SIGMA : layout.ARM_RISE, : self.columns] += ahead
        self.problem = (
            self._body,
            humans.astype(self.dtype, copy=False),
            radii.astype(self.dtype, copy=False),
            self._parameters,
            self._workspace,
        )

    def evaluate(self, trajectories: FloatArray) -> tuple[Array, Array, Array]:
        """Costs of trajectories (n, 7, P), P the number of columns.

        Returns:
            Total (n,), terms (n, TERM_COUNT) and smallest predicted clearance (n,) [m]; the last
            two are views that the next call overwrites.
        """
        count = len(trajectories)
        if count > len(self._terms):
            self._terms = np.empty((count, layout.TERM_COUNT), self.dtype)
            self._nearest = np.empty(count, self.dtype)
        terms, nearest = self._terms[:count], self._nearest[:count]
        kernel.many_costs(self.pad(trajectories), self.columns, *self.problem, terms, nearest)
        return terms.sum(axis=1), terms, nearest

    def clearances(self, trajectories: FloatArray) -> Array:
        """Predicted clearance of trajectories (n, 7, P) at each column (n, P) [m]."""
        result = np.empty((len(trajectories), self.columns), self.dtype)
        many_clearances(self.pad(trajectories), self.columns, *self.problem, result)
        return result

    def pad(self, trajectories: FloatArray) -> Array:
        """Trajectories (n, 7, P) in the layout and type of the kernels (n, 7, ROW); P as bound."""
        padded = np.empty((len(trajectories), 7, layout.ROW), self.dtype)
        padded[:, :, : self.columns] = trajectories
        padded[:, :, self.columns :] = padded[:, :, self.columns - 1, None]
        return padded


def pack_robot(robot: RobotModel) -> FloatArray:
    """The robot as the kernels take it (BODY_SIZE,), see the layout."""
    return np.concatenate(
        (
            robot.lengths, robot.part_masses, robot.capsule_radii,
            robot.lower, robot.upper, robot.velocity,
        )
    )  # fmt: skip
