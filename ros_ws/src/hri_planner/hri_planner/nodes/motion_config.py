"""Parameters that all nodes have which move the robot."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hri_planner.supervision.freshness import Limits
from hri_planner.supervision.rules import Rules
from hri_prediction.config import parameter, validate
from hri_prediction.errors import ConfigError
from hri_prediction.ros.time import seconds_to_ns

FloatArray = NDArray[np.float64]

TRANSPORT_NS = 5_000_000
"""A plan must be ready so long before its hand-over to reach the controller in time [ns]."""


@dataclass(frozen=True)
class MotionConfig:
    """How a node that moves the robot meets the graph."""

    target_names: tuple[str, ...] = parameter((), "Names of the targets that goals may name")
    target_positions: tuple[float, ...] = parameter(
        (), "Their tool positions, three numbers each", unit="m"
    )
    table_center: tuple[float, ...] = parameter(
        (), "Centre of the table; empty: no table", unit="m"
    )
    table_size: tuple[float, ...] = parameter((), "Full edge lengths of the table", unit="m")
    replan_interval: float = parameter(
        0.036, "Time between hand-overs; shorter reacts faster and plans less", unit="s",
        low=0.008, high=0.5,
    )  # fmt: skip
    max_duration: float = parameter(
        20.0, "A motion that takes longer ends as blocked", unit="s", low=1.0
    )
    goal_tolerance: float = parameter(
        0.005,
        "Distance of the tool at which the goal counts as reached",
        unit="m",
        low=1e-4,
        high=0.1,
    )
    rest_speed: float = parameter(
        0.02,
        "Joint speed below which the robot counts as at rest",
        unit="rad/s",
        low=1e-3,
        high=0.5,
    )
    max_joint_age: float = parameter(
        0.1, "Joint states older than this stop the robot", unit="s", low=0.01, high=2.0
    )
    max_sample_age: float = parameter(
        0.085, "Human samples older than this stop the robot", unit="s", low=0.02, high=2.0
    )
    lost_timeout: float = parameter(
        2.0, "A motion whose inputs stay away this long is given up", unit="s", low=0.0, high=60.0
    )
    late_timeout: float = parameter(
        0.12, "A replan that is late by this much stops the robot", unit="s", low=0.02, high=2.0
    )
    require_tracking: bool = parameter(
        True, "Do not move unless a source says who is tracked (an empty list is an answer)"
    )
    max_list_age: float = parameter(
        0.12,
        "A source that has not said who is tracked for so long is gone, or hangs: the robot is stopped",
        unit="s",
        low=0.02,
        high=10.0,
    )
    heartbeat: bool = parameter(
        True, "Supply /separation/speed_scale, until a separation monitor runs; false: never"
    )
    radius_upper_arm: float = parameter(
        0.05, "Radius of the upper arm", unit="m", low=0.0, high=0.3
    )
    radius_forearm: float = parameter(0.04, "Radius of the forearm", unit="m", low=0.0, high=0.3)
    radius_hand: float = parameter(0.05, "Radius of the hand", unit="m", low=0.0, high=0.3)

    def __post_init__(self) -> None:
        """Check ranges and that lists fit together."""
        validate(self)
        if len(self.target_positions) != 3 * len(self.target_names):
            raise ConfigError(
                f"target_positions has {len(self.target_positions)} numbers",
                expected=f"{3 * len(self.target_names)}: three for each of target_names",
            )
        if len(self.table_center) not in (0, 3) or len(self.table_center) != len(self.table_size):
            raise ConfigError(
                f"table_center has {len(self.table_center)} and table_size "
                f"{len(self.table_size)} numbers",
                expected="3 each, or none",
            )

    @property
    def table(self) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
        """Centre and full edge lengths of the table [m]; only when there is one."""
        (x, y, z), (a, b, c) = self.table_center, self.table_size
        return (x, y, z), (a, b, c)

    @property
    def targets(self) -> dict[str, FloatArray]:
        """Tool positions (3,) [m] by name."""
        positions = np.reshape(self.target_positions, (-1, 3))
        return dict(zip(self.target_names, positions, strict=True))

    @property
    def radii(self) -> FloatArray:
        """Of upper arm, forearm and hand (3,) [m]."""
        return np.array([self.radius_upper_arm, self.radius_forearm, self.radius_hand])

    @property
    def limits(self) -> Limits:
        """How old inputs may be."""
        return Limits(self.max_joint_age, self.max_sample_age, self.require_tracking)

    def rules(self, *, lockstep: bool, plans_once: bool) -> Rules:
        """By what motions are judged; in lock-step plans need no time to get through."""
        return Rules(
            interval_ns=seconds_to_ns(self.replan_interval),
            transport_ns=0 if lockstep else TRANSPORT_NS,
            late_timeout_s=self.late_timeout,
            lost_timeout_s=self.lost_timeout,
            max_duration_s=self.max_duration,
            goal_tolerance=self.goal_tolerance,
            rest_speed=self.rest_speed,
            heartbeat=self.heartbeat,
            plans_once=plans_once,
            knows_table=bool(self.table_center),
        )
