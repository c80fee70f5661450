"""A policy's motions with all that goes on inside."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hri_planner.rnn.features import features
from hri_planner.rnn.model import PolicyModel
from hri_sim.policies.evaluation import STEPS, Situations

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Watched:
    """n motions of some steps.

    Attributes:
        positions: Of the hands (n, steps, 3) [m].
        velocities: Shape (n, steps, 3) [m/s].
        accelerations: That the policy asked for (n, steps, 3) [m/s²].
        inputs: Features (n, steps, 6).
        outputs: Of each layer of cells, (n, steps, units).
    """

    positions: FloatArray
    velocities: FloatArray
    accelerations: FloatArray
    inputs: FloatArray
    outputs: list[FloatArray]


def watch(model: PolicyModel, found: Situations, noise: float, rng: np.random.Generator) -> Watched:
    """As :func:`hri_planner.rnn.rollout.roll_out` moves them, noise and all."""
    n = len(found.start)
    shape = (n, STEPS, 3)
    goals = np.broadcast_to(found.goal[:, None], shape) + noise * rng.standard_normal(shape)
    others = found.partner + noise * rng.standard_normal(shape)
    hand, speed = found.start, found.velocity / model.dt
    state = model.network.initial_state(n)
    kept: dict[str, list[FloatArray]] = {name: [] for name in "sva"}
    seen, states = [], []
    for step in range(STEPS):
        seen.append(features(hand, goals[:, step], others[:, step], model.features))
        told, state = model.accelerate(hand, goals[:, step], others[:, step], state)
        for name, value in (("s", hand), ("v", speed), ("a", told)):
            kept[name].append(value)
        states.append(state)
        speed = speed + told * model.dt
        hand = hand + speed * model.dt
    whole = np.stack(states, axis=1)
    outputs, begin = [], 0
    for layer in model.network.layers:
        outputs.append(whole[..., begin : begin + layer.units])
        begin += layer.state_size
    return Watched(
        np.stack(kept["s"], axis=1),
        np.stack(kept["v"], axis=1),
        np.stack(kept["a"], axis=1),
        np.stack(seen, axis=1),
        outputs,
    )
