"""Hands that a policy moves, step by step in closed loop: many at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hri_planner.rnn.model import PolicyModel
from hri_prediction.errors import DataError

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Rollout:
    """What came of it.

    Attributes:
        positions: Of the hands (batch, steps + 1, 3) [m].
        accelerations: That the policy asked for (batch, steps, 3) [m/s²].
    """

    positions: FloatArray
    accelerations: FloatArray


def roll_out(
    model: PolicyModel,
    start: ArrayLike,
    goal: ArrayLike,
    partner: ArrayLike,
    *,
    velocity: ArrayLike | None = None,
    noise: float = 0.0,
    rng: np.random.Generator | None = None,
) -> Rollout:
    """Let a policy move hands towards goals while partners move as recorded.

    Args:
        model: The policy.
        start: First positions (batch, 3) [m].
        goal: Where they are to go (batch, steps, 3), or (batch, 3) for goals that rest [m].
        partner: Partners' hands (batch, steps, 3) [m].
        velocity: First velocities (batch, 3) [m/s]; none: at rest.
        noise: Standard deviation that is added to goal and partner, drawn for each axis and step [m].
        rng: Draws the noise.

    Raises:
        DataError: when shapes do not fit, a value is not finite, or there is noise without ``rng``.
    """
    others = np.asarray(partner, dtype=float)
    hand = np.array(start, dtype=float)
    if others.ndim != 3 or others.shape[2] != 3 or hand.shape != (len(others), 3):
        raise DataError(
            f"hands {hand.shape}, partners {others.shape}", expected="(batch, 3), (batch, steps, 3)"
        )
    goals = np.asarray(goal, dtype=float)
    if goals.shape == hand.shape:
        goals = np.broadcast_to(goals[:, None], others.shape)
    speed = np.zeros_like(hand) if velocity is None else np.array(velocity, dtype=float)
    if goals.shape != others.shape or speed.shape != hand.shape:
        raise DataError(
            f"goals {goals.shape}, velocities {speed.shape}",
            expected=f"{others.shape}, {hand.shape}",
        )
    if not all(np.isfinite(given).all() for given in (hand, goals, others, speed)):
        raise DataError("a position or velocity is not finite", expected="metres and seconds")
    if noise > 0.0:
        if rng is None:
            raise DataError(f"noise of {noise} m without a generator", expected="rng")
        goals = goals + noise * rng.standard_normal(goals.shape)
        others = others + noise * rng.standard_normal(others.shape)
    steps = others.shape[1]
    positions = np.empty((len(hand), steps + 1, 3))
    asked = np.empty((len(hand), steps, 3))
    positions[:, 0] = hand
    state = model.network.initial_state(len(hand))
    for index in range(steps):
        told, state = model.accelerate(hand, goals[:, index], others[:, index], state)
        speed = speed + told * model.dt
        hand = hand + speed * model.dt
        asked[:, index] = told
        positions[:, index + 1] = hand
    return Rollout(positions, asked)
