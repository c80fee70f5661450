"""Moves the tool along the ways of a policy of movement primitives."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hri_planner.dmp import drive
from hri_planner.dmp.drive import Drive
from hri_planner.dmp.policy import DURATIONS_S, DmpPolicy
from hri_planner.dmp.potential_field import FieldConfig
from hri_planner.policy.hand import HandState, hand_at
from hri_planner.policy.partner import Partner
from hri_planner.policy.stretch import Limits, Moved, stretch
from hri_planner.policy.tool_velocity import ToolVelocity
from hri_prediction.errors import DataError, PlanningError

FloatArray = NDArray[np.float64]


class DmpRunner:
    """One motion after the other.

    Args:
        policy: The ways.
        field: Parameters of the potential field.
        limits: What the tool keeps to.
        period: Control period [s].
    """

    recurrent = False

    def __init__(
        self, policy: DmpPolicy, field: FieldConfig, limits: Limits, period: float
    ) -> None:
        self.policy = policy
        self._field, self._limits, self._period = field, limits, period
        self._weights = np.zeros((3, 3))
        self._duration = policy.duration
        self._drive: Drive | None = None

    @property
    def posture(self) -> FloatArray:
        """Joint angles (7,) [rad] that free joints keep to."""
        return self.policy.posture

    def set_out(self, tool: FloatArray, goal: FloatArray, duration: float) -> None:
        """Begin a motion from where the tool is (3,) to a goal of the policy (3,) [m].

        Args:
            tool: Where it begins.
            goal: Where it ends.
            duration: How long it takes [s]; 0: as long as the policy says.

        Raises:
            PlanningError: when the policy knows no such goal, or the duration is none.
        """
        low, high = DURATIONS_S
        if duration and not low <= duration <= high:
            raise PlanningError(
                f"duration {duration} s", expected=f"{low} to {high} s, or 0: the policy's"
            )
        name = self.policy.name_of(goal)
        self._weights = self.policy.weights_from(tool, name)
        self._duration = duration or self.policy.duration
        self._drive = None

    def begin(
        self, position: ArrayLike, velocity: ArrayLike = (0.0, 0.0, 0.0), *,
        memory: FloatArray | None = None,
    ) -> HandState:  # fmt: skip
        """The tool somewhere (3,) [m], in the phase that it remembers; none: a motion begins.

        Raises:
            DataError: when position or velocity is not finite.
        """
        at = np.array(position, dtype=float)
        return hand_at(at, velocity, drive.begin(at) if memory is None else memory)

    def settled(self, goal: FloatArray) -> FloatArray:
        """Memory of a motion that is over, at its goal (3,) [m]."""
        return drive.settled(goal)

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
        """As many control steps as asked for; see :class:`hri_planner.policy.mover.Mover`."""
        if not np.isfinite(goal).all():
            raise DataError(f"goal {goal}", expected="three finite coordinates in m")
        for partner in partners:
            partner.check()
        if self._drive is None or not np.array_equal(self._drive.goal, goal):
            self._drive = Drive.of(goal, self._duration, self._weights, self._field)
        moved = stretch(
            hand.position, hand.velocity, self._drive, q, qd, partners, most, self._period,
            self._limits, inverse, hand.memory,
        )  # fmt: skip
        return moved, [
            HandState(
                position=moved.position[index],
                velocity=moved.velocity[index],
                acceleration=moved.acceleration[index],
                filtered=bool(moved.filtered[index]),
                memory=moved.memory[index],
                wanted=moved.acceleration[index],
                count=0,
            )
            for index in range(most)
        ]
