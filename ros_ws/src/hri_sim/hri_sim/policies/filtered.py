"""Many hands at once, each moved by a policy and kept clear of its partner.

The same as :mod:`hri_planner.policy.runner`, which moves one hand of a robot, to the last digits; tests
hold both against each other.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hri_planner.policy.separation import SeparationConfig, keep_separations
from hri_planner.rnn.model import PolicyModel

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

BRAKING_M_S2 = 4.0
"""Of a hand that is not to go anywhere yet."""


@dataclass(frozen=True)
class GoalNoise:
    """What a tracking system adds to what a policy sees.

    Attributes:
        sigma: Standard deviation for each axis of goal and partner, drawn at each of the policy's
            steps [m].
        seed: Of what is drawn.
    """

    sigma: float
    seed: int


class Hands:
    """n hands.

    Args:
        model: The policy of all of them.
        separation: Parameters of the filter; none: without it.
        start: Where they are, at rest (n, 3) [m].
        goal: Where they are to go (n, 3) [m].
        control_period: A whole part of the policy's time step [s].
        noise: Of what the policy sees; the filter sees everything as it is.
    """

    def __init__(
        self,
        model: PolicyModel,
        separation: SeparationConfig | None,
        start: FloatArray,
        goal: FloatArray,
        control_period: float,
        noise: GoalNoise | None = None,
    ) -> None:
        self._model, self._separation, self._goal = model, separation, goal
        self._period = control_period
        self._per_step = round(model.dt / control_period)
        self._noise = noise
        self._rng = np.random.default_rng(0 if noise is None else noise.seed)
        self.position, self.velocity = start.copy(), np.zeros_like(start)
        self.filtered = np.zeros(len(start), dtype=bool)
        self._memory = model.network.initial_state(len(start))
        self._wanted = np.zeros_like(start)
        self._count = 0

    def step(self, joints: FloatArray, speeds: FloatArray, going: BoolArray) -> None:
        """One control period on.

        Args:
            joints: Of the partners' arms, the hand last, or their hands alone (n, m, 3) [m].
            speeds: Of them (n, m, 3) [m/s].
            going: Which hands are on their way (n,); the others come to rest, and their networks wait.
                It is asked at each step of the policy.
        """
        if self._count % self._per_step == 0:
            self._going = going[:, None]
            self._ask(joints[:, -1], speeds[:, -1])
        self._count += 1
        wanted = np.where(self._going, self._wanted, self._braking())
        self.filtered[:] = False
        if self._separation is not None:
            wanted, self.filtered = keep_separations(
                wanted,
                self.position,
                self.velocity,
                joints,
                speeds,
                self._period,
                self._separation,
            )
        h = self._period
        self.position = self.position + self.velocity * h + wanted * (0.5 * h * h)
        self.velocity = self.velocity + wanted * h

    def _ask(self, partner: FloatArray, partner_velocity: FloatArray) -> None:
        # Where all will be half a step later.
        half_s = 0.5 * self._model.dt
        ahead = self.position + self.velocity * half_s
        partner = partner + partner_velocity * half_s
        goal = self._goal
        if self._noise is not None:
            goal = goal + self._noise.sigma * self._rng.standard_normal(goal.shape)
            partner = partner + self._noise.sigma * self._rng.standard_normal(goal.shape)
        self._wanted, memory = self._model.accelerate(ahead, goal, partner, self._memory)
        self._memory = np.where(self._going, memory, self._memory)

    def _braking(self) -> FloatArray:
        speed = np.linalg.norm(self.velocity, axis=1, keepdims=True)
        braking: FloatArray = (
            -self.velocity
            / np.maximum(speed, 1e-12)
            * np.minimum(BRAKING_M_S2, speed / self._period)
        )
        return braking
