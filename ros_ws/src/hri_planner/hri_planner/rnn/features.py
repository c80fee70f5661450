"""What a policy sees: the way to its goal, and a push away from the partner's hand (eq. 5.13, 5.14).

With s the learner's hand, g its goal, p the partner's hand, d = |p - s|:

    f_H2G = g - s
    f_H2H = S (p - s) for d < d*, else 0,   S = (1/d* - 1/d) / d.

S is negative, so that f_H2H points away from the partner; its length 1/d - 1/d* has no bound and is
cut. (The thesis prints d > d*, with which only far partners would be seen.)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hri_prediction.config import parameter, validate

FloatArray = NDArray[np.float64]

INPUTS = ("goal_x", "goal_y", "goal_z", "partner_x", "partner_y", "partner_z")
"""The columns of features: f_H2G [m] and f_H2H [1/m]."""


@dataclass(frozen=True)
class FeatureConfig:
    """Parameters of the features.

    Attributes:
        influence: d*.
        longest_push: Length at which f_H2H is cut.
        longest_way: Length at which f_H2G is cut once it is normalised.

    Raises:
        ConfigError: when a value is out of range.
    """

    influence: float = parameter(
        0.4, "distance from which on the partner's hand is not felt (d*)", unit="m", low=0.05
    )
    longest_push: float = parameter(
        17.5,
        "length at which the push away from the partner is cut; 17.5 is 5 cm from the hand",
        unit="1/m",
        low=0.1,
    )
    longest_way: float = parameter(
        1.2,
        "normalised length at which the way to the goal is cut: what a network does with ways longer "
        "than the recorded ones was never learnt",
        low=1.0,
    )

    def __post_init__(self) -> None:
        """Check the values."""
        validate(self)


def push(offset: ArrayLike, config: FeatureConfig) -> FloatArray:
    """f_H2H of the partner's hand seen from the learner's, p - s (..., 3) [m]: (..., 3) [1/m].

    Zero where the hands coincide: nothing says which way is away.
    """
    away = np.asarray(offset, dtype=float)
    distance = np.sqrt(np.einsum("...i,...i->...", away, away))
    safe = np.maximum(distance, 1e-9)
    length = np.clip(1.0 / safe - 1.0 / config.influence, 0.0, config.longest_push)
    return -(length / safe)[..., None] * away


def features(
    hand: ArrayLike, goal: ArrayLike, partner: ArrayLike, config: FeatureConfig
) -> FloatArray:
    """Both features.

    Args:
        hand: Learner's hand (..., 3) [m].
        goal: Where it is to go (..., 3) [m], same frame.
        partner: Partner's hand (..., 3) [m], same frame.
        config: Parameters.

    Returns:
        Shape (..., 6), columns as in :data:`INPUTS`.
    """
    own = np.asarray(hand, dtype=float)
    to_goal = np.asarray(goal, dtype=float) - own
    pushed = push(np.asarray(partner, dtype=float) - own, config)
    shape = np.broadcast_shapes(to_goal.shape, pushed.shape)
    return np.concatenate(
        (np.broadcast_to(to_goal, shape), np.broadcast_to(pushed, shape)), axis=-1
    )
