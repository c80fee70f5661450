"""What training makes small."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor

from hri_planner.rnn.features import FeatureConfig
from hri_planner.rnn.scales import Scales
from hri_planner.rnn.training.batches import Bucket, Course
from hri_planner.rnn.training.torch_network import TorchNetwork


@dataclass(frozen=True, eq=False)
class Switches:
    """Goals that change in mid-flight, of all motions of a batch.

    Attributes:
        step: From which step on (batch,); beyond the end where the goal stays.
        goal: Where it is from then on (batch, 3) [m].
    """

    step: Tensor
    goal: Tensor


def imitation_loss(network: TorchNetwork, data: Sequence[Bucket]) -> Tensor:
    """Mean squared error of accelerations along the recorded hands (eq. 5.12), normalised units."""
    total = torch.zeros((), dtype=data[0].inputs.dtype)
    for bucket in data:
        error = (network.sequence(bucket.inputs) - bucket.labels) * bucket.mask
        total = total + error.square().sum()
    return total / sum(float(bucket.mask.sum()) for bucket in data)


def closed_loop(
    network: TorchNetwork,
    data: Course,
    scales: Scales,
    config: FeatureConfig,
    dt: float,
    *,
    steps: int,
    noise: Tensor | None = None,
    switches: Switches | None = None,
) -> Tensor:
    """Hands that the network moves itself (steps + 1, batch, 3) [m], differentiable.

    Args:
        network: The policy's.
        data: Where hands begin, where they are to go, and what the partners do.
        scales: Of the features.
        config: Parameters of the features.
        dt: Time step [s].
        steps: How many.
        noise: Added to goal and partner (steps, 2, batch, 3) [m]; none: exact.
        switches: Goals that change; none: all stay.
    """
    hand, speed = data.hand[0], data.velocity
    states = network.initial_states(len(hand), hand.dtype)
    inputs = torch.tensor(scales.inputs, dtype=hand.dtype)
    found = [hand]
    for step in range(steps):
        goal, partner = data.goal, data.partner[step]
        if switches is not None:
            goal = torch.where((step >= switches.step)[:, None], switches.goal, goal)
        if noise is not None:
            goal, partner = goal + noise[step, 0], partner + noise[step, 1]
        offset = partner - hand
        distance = offset.square().sum(dim=1, keepdim=True).clamp_min(1e-18).sqrt()
        felt = (1.0 / distance - 1.0 / config.influence).clamp(0.0, config.longest_push)
        seen = torch.cat((goal - hand, -(felt / distance) * offset), dim=1) / inputs
        way = seen[:, :3].square().sum(dim=1, keepdim=True)
        cut = config.longest_way * way.clamp_min(config.longest_way**2).rsqrt()
        seen = torch.cat((seen[:, :3] * cut, seen[:, 3:]), dim=1)
        told, states = network.step(seen, states)
        speed = speed + told * (scales.acceleration * dt)
        hand = hand + speed * dt
        found.append(hand)
    return torch.stack(found)
