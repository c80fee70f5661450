"""A hand on a robot that rests: whether it is held there."""

from __future__ import annotations

from hri_planner.supervision.decision import Seen

TOUCH_M = 0.01
"""Arms that are nearer than this may be touched, as far as motion capture tells [m]."""
LET_GO_M, LET_GO_NS = 0.02, 200_000_000
"""Arms that are farther for so long have let go."""
TOUCHED = "somebody touches the robot, which rests: it goes on once it is let go"
STOPS = "the robot comes to rest"
"""Said of one that is told to drop what it follows for that: if it does not, it is something else."""


class Touch:
    """Whether a robot that was stopped stays at rest, though nothing else is wrong, as it is touched.

    Whoever has put a hand on it is to be neither pushed nor rubbed along. A robot that moves is the
    planner's business, as is one that sets out for a new goal.
    """

    def __init__(self) -> None:
        self._last_ns: int | None = None

    def over(self) -> None:
        """The robot moves, or may."""
        self._last_ns = None

    def holds(self, seen: Seen, scale: float, *, begun: bool) -> bool:
        """Whether it stays at rest.

        Args:
            seen: What is known now.
            scale: Of its speed, as we have it.
            begun: Whether the motion has begun, or a goal is held.
        """
        controller = seen.heard.controller
        stands = scale == 0.0 or (controller is not None and controller.stands)
        if not (stands and begun):
            self._last_ns = None
            return False
        if seen.separation <= (TOUCH_M if self._last_ns is None else LET_GO_M):
            self._last_ns = seen.now_ns
        return self._last_ns is not None and seen.now_ns - self._last_ns <= LET_GO_NS
