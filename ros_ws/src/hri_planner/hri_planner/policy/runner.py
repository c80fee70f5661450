"""A policy at any control rate: the network's steps, and the smooth motion between them.

The network was taught with s_{t+1} = s_t + v_{t+1} dt. Its positions are the control points of a
quadratic B-spline: halfway between them the curve is at (s_t + s_{t+1}) / 2 with velocity v_{t+1},
and its acceleration around s_t is a_t, constant for one step. So the network is asked halfway: with
the hand at x and its velocity v, the control point ahead is s = x + v dt / 2, and the acceleration
that it gives is held for dt. Between the network's steps any number of control steps integrate
exactly, and where nothing interferes the hand follows the curve that the network was taught.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hri_planner.policy.hand import HandState, hand_at
from hri_planner.policy.partner import Partner
from hri_planner.policy.separation import (
    NOWHERE,
    SeparationConfig,
    keep_separation,
    together,
)
from hri_planner.policy.stretch import Limits, Moved, stretch
from hri_planner.policy.tool_velocity import ToolVelocity
from hri_planner.rnn.model import PolicyModel
from hri_prediction.errors import DataError

FloatArray = NDArray[np.float64]

FAR_M = np.array((0.0, 0.0, 1e3))
"""Where a partner is put that nobody sees."""
_SETTLING_STEPS = 200
"""Of the network: as many as a roll-out has."""


class PolicyRunner:
    """Moves hands; it remembers nothing itself.

    Args:
        model: The policy.
        separation: Parameters of the filter; none: without it.
        control_period: Of calls of :meth:`step`; a whole number of them makes a step of the network
            [s].
        floor: Height that the hand stays above [m]; none: any.
        limits: What :meth:`move` keeps to besides, and how far that is from people; none: only these.

    Raises:
        DataError: when the period does not fit into the network's.
    """

    recurrent = True
    posture = None

    def __init__(
        self,
        model: PolicyModel,
        separation: SeparationConfig | None,
        control_period: float,
        floor: float | None = None,
        *,
        limits: Limits | None = None,
    ) -> None:
        per_step = model.dt / control_period
        if per_step < 1.0 - 1e-9 or abs(per_step - round(per_step)) > 1e-6:
            raise DataError(
                f"control period {control_period} s",
                expected=f"the policy's time step {model.dt} s, or a whole part of it",
            )
        self.model = model
        self.period = control_period
        self._separation = separation
        self._per_step = round(per_step)
        self._floor = floor
        self._limits = separation or SeparationConfig()
        self._kept_to = limits or Limits(self._limits, separation is not None, floor)
        self._settled: FloatArray | None = None

    def begin(
        self, position: ArrayLike, velocity: ArrayLike = (0.0, 0.0, 0.0), *,
        memory: FloatArray | None = None,
    ) -> HandState:  # fmt: skip
        """A hand somewhere, whose policy is asked at the next step.

        Args:
            position: Shape (3,) [m].
            velocity: Shape (3,) [m/s].
            memory: What the network remembers; none: nothing.

        Raises:
            DataError: when position or velocity is not finite.
        """
        if memory is None:
            memory = self.model.network.initial_state()
        return hand_at(position, velocity, memory)

    def set_out(self, tool: FloatArray, goal: FloatArray, duration: float) -> None:
        """Networks know a way to any goal, and take the time that they have learnt."""

    def settled(self, goal: FloatArray) -> FloatArray:
        """What the network remembers that has been at rest at its goal for long, with nobody near."""
        if self._settled is None:
            self._settled = self._rested()
        return self._settled

    def _rested(self) -> FloatArray:
        place = np.zeros(3)
        memory = self.model.network.initial_state()
        for _ in range(_SETTLING_STEPS):
            _, memory = self.model.accelerate(place, place, FAR_M, memory)
        return memory

    def step(self, now: HandState, goal: FloatArray, partners: Sequence[Partner]) -> HandState:
        """One control period on.

        Args:
            now: The hand.
            goal: Where it is to go (3,) [m]; it may move, and jump.
            partners: What is known of others. The network sees the nearest hand, the filter whole
                arms.

        Raises:
            DataError: when goal or a partner is not finite.
        """
        wanted, memory = self.asked(now, goal, partners)
        acceleration, filtered = self._kept(now, wanted, partners)
        h = self.period
        return HandState(
            position=now.position + now.velocity * h + acceleration * (0.5 * h * h),
            velocity=now.velocity + acceleration * h,
            acceleration=acceleration,
            filtered=filtered,
            memory=memory,
            wanted=wanted,
            count=(now.count + 1) % self._per_step,
        )

    def asked(
        self, now: HandState, goal: FloatArray, partners: Sequence[Partner]
    ) -> tuple[FloatArray, FloatArray]:
        """What the network wants of a hand (3,) [m/s²], and its memory; it is asked when that is due.

        Raises:
            DataError: when goal or a partner is not finite.
        """
        if not np.isfinite(goal).all():
            raise DataError(f"goal {goal}", expected="three finite coordinates in m")
        for partner in partners:
            partner.check()
        if now.count:
            return now.wanted, now.memory
        # Where all will be half a step later, as the control point is.
        half_s = 0.5 * self.model.dt
        ahead = now.position + now.velocity * half_s
        others = [partner.position + partner.velocity * half_s for partner in partners]
        other = min(others, key=lambda p: float(np.sum((p - ahead) ** 2)), default=FAR_M)
        return self.model.accelerate(ahead, goal, other, now.memory)

    def move(
        self,
        hand: HandState,
        goal: FloatArray,
        partners: Sequence[Partner],
        q: FloatArray,
        qd: FloatArray,
        most: int,
        inverse: ToolVelocity,
    ) -> tuple[Moved, list[HandState]]:
        """Control steps until the network is asked again; see :class:`hri_planner.policy.mover.Mover`."""
        wanted, memory = self.asked(hand, goal, partners)
        moved = stretch(
            hand.position, hand.velocity, wanted, q, qd, partners,
            min(self._per_step - hand.count, most), self.period, self._kept_to, inverse,
        )  # fmt: skip
        return moved, self.after(hand, moved, wanted, memory)

    def after(
        self, hand: HandState, moved: Moved, wanted: FloatArray, memory: FloatArray
    ) -> list[HandState]:
        """The hand after each of some steps, during which the network was asked at most at the first."""
        return [
            HandState(
                position=moved.position[index],
                velocity=moved.velocity[index],
                acceleration=moved.acceleration[index],
                filtered=bool(moved.filtered[index]),
                memory=memory,
                wanted=wanted,
                count=(hand.count + index + 1) % self._per_step,
            )
            for index in range(len(moved.filtered))
        ]

    def _kept(
        self, now: HandState, wanted: FloatArray, partners: Sequence[Partner]
    ) -> tuple[FloatArray, bool]:
        """What the filters make of an acceleration, and whether they changed it."""
        if self._separation is None and self._floor is None:
            return wanted, False
        places = NOWHERE
        if self._separation is not None and partners:
            places = together([partner.places(now.position) for partner in partners])
        kept = keep_separation(
            wanted, now.position, now.velocity, places, self.period, self._limits, floor=self._floor
        )
        return kept.acceleration, kept.changed
