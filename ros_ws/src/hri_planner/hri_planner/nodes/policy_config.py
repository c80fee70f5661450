"""Parameters of the policy node that are not the policy planner's."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hri_planner.nodes.motion_config import MotionConfig
from hri_planner.policy.planner import CONTROL_PERIOD_S
from hri_prediction.config import parameter
from hri_prediction.errors import ConfigError

FloatArray = NDArray[np.float64]

DEFAULT_POLICY = "rnn_gru_9x9_d1"


@dataclass(frozen=True)
class PolicyNodeConfig(MotionConfig):
    """How the node meets the graph."""

    policy: str = parameter(
        DEFAULT_POLICY,
        "What to execute: a .npz file of train_rnn.py or adapt_policy.py, or a policy that ships",
    )
    replan_interval: float = parameter(
        0.032, "Time between hand-overs, a multiple of 0.004; shorter reacts faster", unit="s",
        low=0.012, high=0.2,
    )  # fmt: skip
    horizon: float = parameter(
        0.064,
        "For how long a plan goes on beyond its hand-over before it comes to rest: so long no newer "
        "one is missed",
        unit="s",
        low=0.012,
        high=1.0,
    )
    max_goal_age: float = parameter(
        0.5, "Places on policy/goal that are older are not taken", unit="s", low=0.01, high=60.0
    )

    max_future: float = parameter(
        0.05, "A stamp of people further ahead of the clock than this is refused", unit="s", low=0.0
    )
    box_centers: tuple[float, ...] = parameter(
        (), "Centres of boxes that the tool stays out of, three numbers each", unit="m"
    )
    box_sizes: tuple[float, ...] = parameter(
        (), "Their full edge lengths, three numbers each, along the axes", unit="m"
    )

    def __post_init__(self) -> None:
        """Check ranges and that times fit together."""
        super().__post_init__()
        if len(self.box_centers) % 3 or len(self.box_sizes) != len(self.box_centers):
            raise ConfigError(
                f"box_centers has {len(self.box_centers)} and box_sizes {len(self.box_sizes)} numbers",
                expected="three each for every box",
            )
        steps = self.replan_interval / CONTROL_PERIOD_S
        if abs(steps - round(steps)) > 1e-6:
            raise ConfigError(
                f"replan_interval = {self.replan_interval}",
                expected=f"a multiple of {CONTROL_PERIOD_S} s, the control period",
            )
        if self.horizon < self.replan_interval:
            raise ConfigError(
                f"horizon = {self.horizon}",
                expected=f"at least replan_interval = {self.replan_interval}",
            )

    @property
    def boxes(self) -> FloatArray:
        """Centre and half the size of each (k, 2, 3) [m]."""
        centers = np.reshape(self.box_centers, (-1, 3))
        return np.stack((centers, 0.5 * np.reshape(self.box_sizes, (-1, 3))), axis=1)
