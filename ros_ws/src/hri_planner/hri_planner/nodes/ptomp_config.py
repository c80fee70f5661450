"""Parameters of the ptomp node that are not the planner core's."""

from __future__ import annotations

from dataclasses import dataclass

from hri_planner.nodes.motion_config import MotionConfig
from hri_planner.ptomp.variants import variants
from hri_prediction.config import parameter


@dataclass(frozen=True)
class PtompNodeConfig(MotionConfig):
    """How the node meets the graph."""

    seed: int = parameter(0, "Seed of the optimiser's noise", low=0)
    variant: str = parameter(
        "ptomp",
        "Which planner: its settings are the defaults of the planner.* parameters. stomp plans "
        "once, for as long as the motion is to take, before it sets off; itomp is meant for a predictor "
        "without a library",
        choices=tuple(variants()),
    )
    compute_share: float = parameter(
        0.5,
        "Share of the interval that the optimiser may take; the rest is slack, and not saved up",
        low=0.05,
        high=0.9,
    )
    slowdown: float = parameter(
        1.0,
        "Lock-step only: how many times slower than the reference machine; where an interval is too short "
        "for a replan, time is saved up, and late_timeout stops the robot meanwhile",
        low=0.01,
    )
    default_duration: float = parameter(
        1.5, "Duration of a motion whose goal names none", unit="s", low=0.2, high=60.0
    )
    adaptation_model: str = parameter(
        "",
        "Model that chooses planner.num_timesteps and num_rollouts when a motion starts: a .npz file, or "
        "the name of one that ships, as success_f8; empty: they stay as they are",
    )
