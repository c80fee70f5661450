"""Second stage: hands that the policy moves itself, compared with recorded ones.

Accelerations that are right on the recorded path lead to its end but for centimetres: errors add up,
and nothing has taught the network to correct them. Here gradients go through the integrator, over a
horizon that grows. From scratch this fails; after the first stage it brings the hand to the goal.

A share of the goals is changed to another one in mid-flight, or after the first was reached. Nothing is
recorded of such reaches: only that the hand is to be at the new goal in time is asked for.
"""

from __future__ import annotations

import math

import numpy as np
import torch
from torch import Tensor

from hri_planner.rnn.features import FeatureConfig
from hri_planner.rnn.model import STEP_S
from hri_planner.rnn.scales import Scales
from hri_planner.rnn.training.adam import adam_round
from hri_planner.rnn.training.batches import Course
from hri_planner.rnn.training.config import TrainingConfig
from hri_planner.rnn.training.flat import FloatArray
from hri_planner.rnn.training.losses import Switches, closed_loop
from hri_planner.rnn.training.torch_network import TorchNetwork

_NEAR_M = 0.002
"""Distances to the goal much longer than this weigh in proportion, shorter ones with their square."""

_LATE = 40
"""Steps at the end of a whole run in which the hand is to be at the goal."""

_LAST_RATE = 0.02

_EARLIEST = 3
"""Step of the earliest change of goal."""

_ASIDE_M = 0.12
"""New goals are those of others, and so much aside of them in each coordinate [m]."""

_TIME_TO_REACH = 50
"""Steps after a change of goal from which on the hand is to be at the new one."""


def horizon(round_: int, config: TrainingConfig) -> int:
    """Steps of a round: grows with the square of the share of the stage that is done.

    A reach takes some sixty steps, and there most is learnt; later ones teach to stay at the goal.
    """
    share = (round_ / max(config.closed_rounds - 1, 1)) ** 2
    return round(config.first_horizon + share * (config.last_horizon - config.first_horizon))


def rates(round_: int, config: TrainingConfig) -> FloatArray:
    """Step sizes of a round's iterations: half a cosine over the whole stage."""
    count = config.closed_iterations
    done = (round_ * count + np.arange(count)) / max(config.closed_rounds * count, 1)
    fall = 0.5 * (1.0 + np.cos(math.pi * done))
    found: FloatArray = config.closed_rate * (_LAST_RATE + (1.0 - _LAST_RATE) * fall)
    return found


def course_loss(
    moved: Tensor, data: Course, terminal_weight: float, switches: Switches | None = None
) -> Tensor:
    """How far hands are from the recorded ones, and late in the run from the goal.

    Args:
        moved: Positions (steps + 1, batch, 3) [m].
        data: Of the recording.
        terminal_weight: Of the distance to the goal.
        switches: Goals that change; the record counts until then.

    Returns:
        Mean squared distance to the record [dm²], and weighted mean distance to the goal [cm].
    """
    steps = moved.shape[0] - 1
    squares = (moved - data.hand[: steps + 1]).square().sum(dim=2)
    late_from = max(steps + 1 - _LATE, 0)
    resting = (data.hand[late_from : steps + 1] - data.goal).square().sum(dim=2) < 1e-4
    goal = data.goal
    if switches is None:
        path = 100.0 * squares.mean()
    else:
        index = torch.arange(steps + 1)[:, None]
        recorded = index <= switches.step
        path = 100.0 * (squares * recorded).sum() / recorded.sum()
        switched = switches.step <= steps
        goal = torch.where(switched[:, None], switches.goal, goal)
        resting = torch.where(
            switched, index[late_from:] >= switches.step + _TIME_TO_REACH, resting
        )
    away = (moved[late_from:] - goal).square().sum(dim=2)
    late = 100.0 * ((away + _NEAR_M**2).sqrt() - _NEAR_M) * resting
    return path + terminal_weight * late.sum() / resting.sum().clamp_min(1)


def draw_switches(goal: Tensor, steps: int, share: float, rng: np.random.Generator) -> Switches:
    """Change a share of the goals (batch, 3) to those of others, where there is time left to get there."""
    size = len(goal)
    latest = steps - _TIME_TO_REACH - _LATE // 2
    step = np.full(size, steps + 1)
    chosen = rng.random(size) < share
    if latest > _EARLIEST:
        step[chosen] = rng.integers(_EARLIEST, latest, int(chosen.sum()))
    others = goal[torch.from_numpy(rng.permutation(size))]
    aside = torch.from_numpy(rng.uniform(-_ASIDE_M, _ASIDE_M, (size, 3)))
    return Switches(torch.from_numpy(step), others + aside)


def closed_round(
    network: TorchNetwork,
    memory: dict[str, FloatArray],
    data: Course,
    scales: Scales,
    features: FeatureConfig,
    config: TrainingConfig,
    round_: int,
    rng: np.random.Generator,
) -> tuple[float, dict[str, FloatArray]]:
    """Some iterations, each with a part of the data drawn at random, half of it with noise.

    Returns:
        Mean loss, and what the optimiser is to remember.
    """
    steps = horizon(round_, config)

    def loss(_: int) -> Tensor:
        size = min(config.batch, data.goal.shape[0])
        rows = torch.from_numpy(rng.choice(data.goal.shape[0], size, replace=False))
        part = Course(
            data.hand[:, rows], data.partner[:, rows], data.goal[rows], data.velocity[rows]
        )
        noise = config.noise * torch.from_numpy(rng.standard_normal((steps, 2, size, 3)))
        noise[:, :, : size // 2] = 0.0
        switches = draw_switches(part.goal, steps, config.switched, rng)
        moved = closed_loop(
            network, part, scales, features, STEP_S, steps=steps, noise=noise, switches=switches
        )
        return course_loss(moved, part, config.terminal_weight, switches)

    return adam_round(network.weights, memory, loss, rates(round_, config), config.clip)
