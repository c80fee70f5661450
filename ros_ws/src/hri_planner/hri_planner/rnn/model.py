"""A policy as it was learnt: a network with all that gives its numbers a meaning."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hri_planner.rnn.features import FeatureConfig, features
from hri_planner.rnn.network import Network
from hri_planner.rnn.scales import Scales
from hri_prediction.errors import DataError

FloatArray = NDArray[np.float64]

STEP_S = 0.032
"""Time step of policies: every eighth sample of 250 Hz [s]."""


@dataclass(frozen=True, eq=False)
class PolicyModel:
    """A learnt policy.

    Attributes:
        network: From normalised features to normalised accelerations.
        scales: What 1 stands for.
        features: Parameters of the features.
        dt: Time step that it was learnt with [s].

    Raises:
        DataError: when the time step is not positive.
    """

    network: Network
    scales: Scales
    features: FeatureConfig
    dt: float = STEP_S

    def __post_init__(self) -> None:
        """Check the values."""
        if not (np.isfinite(self.dt) and self.dt > 0.0):
            raise DataError(f"time step {self.dt!r} s", expected="a positive time")

    def accelerate(
        self, hand: FloatArray, goal: FloatArray, partner: FloatArray, state: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """What the hand does next.

        Args:
            hand: Where it is (..., 3) [m].
            goal: Where it is to go (..., 3) [m], same frame.
            partner: The partner's hand (..., 3) [m], same frame.
            state: What the network remembers (..., network.state_size).

        Returns:
            Acceleration (..., 3) [m/s²], and the new state.
        """
        seen = features(hand, goal, partner, self.features) / self.scales.inputs
        way = np.sqrt(np.einsum("...i,...i->...", seen[..., :3], seen[..., :3]))[..., None]
        longest = self.features.longest_way
        seen[..., :3] *= longest / np.maximum(way, longest)
        told, state = self.network.step(seen, state)
        return told * self.scales.acceleration, state
