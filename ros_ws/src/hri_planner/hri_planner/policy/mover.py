"""What the policy planner asks of a policy, whatever its kind."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hri_planner.policy.hand import HandState
from hri_planner.policy.partner import Partner
from hri_planner.policy.stretch import Moved
from hri_planner.policy.tool_velocity import ToolVelocity

FloatArray = NDArray[np.float64]


class Mover(Protocol):
    """Moves the tool as a policy says."""

    @property
    def recurrent(self) -> bool:
        """Whether a motion in flight goes on with what the policy remembers of the one before."""

    @property
    def posture(self) -> FloatArray | None:
        """Joint angles (7,) [rad] that free joints keep to; none: the middle of their ranges."""

    def set_out(self, tool: FloatArray, goal: FloatArray, duration: float) -> None:
        """A motion begins, from where the tool is (3,) to a goal (3,) [m].

        Args:
            tool: Where it begins.
            goal: Where it ends.
            duration: How long it is to take [s]; 0: as the policy has it.

        Raises:
            PlanningError: when the policy knows no way to that goal.
        """

    def begin(
        self, position: ArrayLike, velocity: ArrayLike = (0.0, 0.0, 0.0), *,
        memory: FloatArray | None = None,
    ) -> HandState:  # fmt: skip
        """A hand somewhere (3,) [m], with a velocity (3,) [m/s]; without memory a motion begins."""

    def settled(self, goal: FloatArray) -> FloatArray:
        """What a hand remembers that rests at its goal (3,) [m]."""

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
        """Some control steps on.

        Args:
            hand: Where it is.
            goal: Where it is to go (3,) [m].
            partners: What is known of others at the first step.
            q: Joint angles (7,) [rad].
            qd: Joint speeds (7,) [rad/s].
            most: At most so many steps; at least one.
            inverse: Joint speeds of the robot.

        Returns:
            Hand and joints, and the hand after each step.

        Raises:
            DataError: when goal or a partner is not finite.
        """
