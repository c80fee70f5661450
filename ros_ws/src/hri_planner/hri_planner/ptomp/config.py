"""All weights, margins and settings of the planner; ``config/ptomp.yaml`` states the defaults."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from importlib import resources

import numpy as np
import yaml
from numpy.typing import DTypeLike

from hri_planner.ptomp.interaction import check_interaction
from hri_prediction.config import from_mapping, parameter, validate
from hri_prediction.errors import ConfigError

LOOK_S = 2.2
"""Alternatives may arrive so late; with the tail, the longest horizon there is."""


@dataclass(frozen=True)
class PtompConfig:
    """Parameters of :class:`hri_planner.ptomp.planner.PtompPlanner`.

    Cost weights multiply costs integrated over time, so they do not change with the number of
    time steps.
    """

    num_timesteps: int = parameter(
        42, "Time steps of a whole motion (TS); fewer react coarser", low=10, high=80
    )
    num_rollouts: int = parameter(
        30, "Noisy trajectories an iteration (NT); more search wider but cost time", low=5, high=200
    )
    iterations: int = parameter(
        40,
        "Optimisation steps of a replan unless a deadline or caller says less",
        low=0,
        high=5000,
    )
    precision: str = parameter(
        "double", "Numbers of the optimiser; single is faster and rounds to micrometres",
        choices=("double", "single"),
    )  # fmt: skip
    interleaved: bool = parameter(
        True, "Replan while moving; false: optimise once, before the motion, as STOMP does"
    )
    weights: str = parameter(
        "total", "Roll-outs are weighted by their total cost, or at each time step by the cost there",
        choices=("total", "per_step"),
    )  # fmt: skip
    update_smoothing: bool = parameter(
        False, "Smooth updates by STOMP's matrix M; needs weights per_step"
    )
    accept_worse: bool = parameter(
        False, "Go on from every update, as STOMP does; false: only from those that cost less"
    )
    exponentiated_cost_sensitivity: float = parameter(
        10.0, "Sharpness of the weights of roll-outs by total cost", low=0.1, high=100.0
    )
    noise_sd: float = parameter(
        0.35, "Standard deviation of the noise where it is widest, at the start", unit="rad",
        low=0.001, high=2.0,
    )  # fmt: skip
    noise_exponent: float = parameter(
        1.5, "Noise shrinks with (remaining / all time steps) to this power", low=0.0, high=4.0
    )
    noise_growth: float = parameter(
        1.15, "Factor on the noise after an improvement", low=1.0, high=2.0
    )
    noise_decay: float = parameter(
        0.85, "Factor on the noise after a step without one", low=0.1, high=1.0
    )
    patience: int = parameter(
        12, "Iterations without improvement after which a start is given up (0: none)", low=0
    )
    num_elites: int = parameter(4, "Best roll-outs kept for the next iteration", low=0, high=32)
    collision_weight: float = parameter(20.0, "Weight of the collision cost", low=0.0)
    margin: float = parameter(
        0.07, "Clearance below which collision costs begin", unit="m", low=0.0, high=0.5
    )
    margin_growth: float = parameter(
        0.0, "The margin grows so much with each second ahead; needs kappa above 0", unit="m/s",
        low=0.0, high=2.0,
    )  # fmt: skip
    collision_cost: str = parameter(
        "margin", "By how deep the margin is entered, or by the place along the arm (eq. 6.10)",
        choices=("margin", "literal"),
    )  # fmt: skip
    margin_min: float = parameter(
        0.03, "The margin shrinks to this when the arrival is overdue", unit="m", low=0.0, high=0.5
    )
    margin_patience: float = parameter(
        1.5, "Overdue time over which the margin shrinks", unit="s", low=0.01, high=60.0
    )
    kappa: float = parameter(
        0.5, "Standard deviations of the prediction added to the margin", low=0.0, high=5.0
    )
    kappa_min: float = parameter(
        0.1, "kappa shrinks to this when the arrival is overdue", low=0.0, high=5.0
    )
    contact_weight: float = parameter(20.0, "Weight of clearance below contact_margin", low=0.0)
    contact_margin: float = parameter(
        0.02, "Clearance below which the contact cost begins", unit="m", low=0.0, high=0.2
    )
    interaction_costs: str = parameter(
        "", "Learnt costs of being near people, by name: case_1 to case_20; empty: none"
    )
    interaction_file: str = parameter(
        "", "Where they are: a costs.json of scripts/learn_costs.py; empty: those that ship"
    )
    interaction_weight: float = parameter(
        3.0, "Weight of learnt costs: what a second with everything at no distance costs", low=0.0,
        high=1000.0,
    )  # fmt: skip
    effort_weight: float = parameter(0.002, "Weight of kinetic and potential energy", low=0.0)
    gravity: float = parameter(
        9.81, "Gravity of the potential energy; 0.5 gives eq. 6.5 as it was printed", unit="m/s^2",
        low=0.0, high=20.0,
    )  # fmt: skip
    jerk_weight: float = parameter(1e-5, "Weight of the squared jerk of the tool", low=0.0)
    control_weight: float = parameter(0.01, "Weight of squared joint accelerations", low=0.0)
    joint_limit_weight: float = parameter(20.0, "Joint limit cost K1 at the limit", low=0.0)
    joint_limit_scale: float = parameter(
        0.03, "Distance over which it falls by e (1 / K2)", unit="rad", low=0.001, high=1.0
    )
    speed_weight: float = parameter(50.0, "Weight of speeds above speed_share", low=0.0)
    speed_share: float = parameter(
        0.95, "Share of the speed limits from which speed costs", low=0.1, high=1.0
    )
    acceleration_weight: float = parameter(
        5.0, "Weight of accelerations above acceleration_limit", low=0.0
    )
    acceleration_limit: float = parameter(
        12.0, "Joint acceleration from which it costs", unit="rad/s^2", low=0.1, high=200.0
    )
    table_weight: float = parameter(20.0, "Weight of coming too near to the table", low=0.0)
    table_margin: float = parameter(
        0.01, "Clearance to keep from the table", unit="m", low=0.0, high=0.2
    )
    goal_weight: float = parameter(
        1.0, "Cost of each metre and second away from the goal; higher waits less", low=0.0
    )
    late_weight: float = parameter(
        0.5, "Cost of each second until the arrival, by which motions are compared", low=0.0
    )
    wait_cost: float = parameter(
        1.5, "Cost of not arriving, by which they are compared; above 2.2 s of late_weight", low=0.0
    )
    trouble_cost: float = parameter(
        0.02, "Collision and contact cost from which other motions are looked at", low=0.0
    )
    motion_gain: float = parameter(
        0.05, "Share of the cost that another motion must save", low=0.0, high=1.0
    )
    posture_candidates: int = parameter(
        16, "Final postures tried at each replan (0: keep the first)", low=0, high=200
    )
    posture_gain: float = parameter(
        0.1, "Share of the cost that a new final posture must save", low=0.0, high=1.0
    )
    posture_hold: float = parameter(
        0.15, "Time after a change of posture in which the gain must be double", unit="s", low=0.0,
        high=10.0,
    )  # fmt: skip
    time_scaling: bool = parameter(
        True, "Slow down, wait, retreat or set out anew where there is no safe way now"
    )
    ways_around: bool = parameter(
        True, "Where the plan is blocked, try bent paths and go on with the best one"
    )
    hold_horizon: float = parameter(
        0.5, "Time beyond the arrival that is looked at", unit="s", low=0.1, high=3.0
    )

    def __post_init__(self) -> None:
        """Check ranges."""
        validate(self)
        if self.margin_min > self.margin:
            raise ConfigError(
                f"margin_min = {self.margin_min}", expected=f"at most margin = {self.margin}"
            )
        if self.kappa_min > self.kappa:
            raise ConfigError(
                f"kappa_min = {self.kappa_min}", expected=f"at most kappa = {self.kappa}"
            )
        if self.wait_cost < LOOK_S * self.late_weight:
            raise ConfigError(
                f"wait_cost = {self.wait_cost} with late_weight = {self.late_weight}",
                expected=f"at least {LOOK_S * self.late_weight:g}: waiting must not be cheaper than a "
                "late arrival",
            )
        if self.margin_growth > 0.0 and self.kappa_min <= 0.0:
            raise ConfigError(
                f"margin_growth = {self.margin_growth} with kappa_min = {self.kappa_min}",
                expected="kappa and kappa_min above 0, through which the margin grows",
            )
        check_interaction(self.interaction_costs, self.interaction_file)
        if self.update_smoothing and self.weights != "per_step":
            raise ConfigError(
                f"update_smoothing with weights = {self.weights}", expected="weights per_step"
            )


def dtype_of(config: PtompConfig) -> DTypeLike:
    """The type of number that a configuration asks the optimiser to compute in."""
    return np.float32 if config.precision == "single" else np.float64


def parameter_file_text() -> str:
    """Text of the parameter file that ships with the package."""
    return resources.files("hri_planner.config").joinpath("ptomp.yaml").read_text()


@cache
def load_default_config() -> PtompConfig:
    """The configuration of the parameter file that ships with the package."""
    return from_mapping(PtompConfig, yaml.safe_load(parameter_file_text()))
