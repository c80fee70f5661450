"""Stops of the controller, and whether they have come to rest."""

from __future__ import annotations

from hri_planner.supervision.freshness import STANDING_RATE, Controller

STOPPED_RATE = 0.7
"""A stop that has slowed the robot below this share of full speed ends at rest."""
SETTLE_NS = 100_000_000
"""How long the controller may take to come to rest before it is told again [ns]."""


class Stop:
    """Since when, and why, the controller has been told to drop what it follows; if it has.

    Attributes:
        since_ns: When it was told last [ns]; none when it was not, or has come to rest since.
    """

    def __init__(self) -> None:
        self.since_ns: int | None = None
        self._why = ""

    def tell(self, now_ns: int, why: str) -> None:
        """It is told now."""
        self.since_ns, self._why = now_ns, why

    def over(self) -> None:
        """The robot stands, or nothing needs to be stopped any more."""
        self.since_ns = None

    def is_due_again(self, now_ns: int) -> bool:
        """Whether it has been told, and long enough ago to be told again."""
        return self.since_ns is not None and now_ns - self.since_ns > SETTLE_NS

    def is_due(self, now_ns: int, controller: Controller | None, *, heartbeat: bool) -> bool:
        """Whether the controller is to be told during a pause.

        Args:
            now_ns: The time [ns].
            controller: What it said last.
            heartbeat: Whether a speed scale of 0 stops the robot already; if so, only once it is slow.
        """
        if controller is None or not controller.active:
            return False
        if self.since_ns is not None:
            return self.is_due_again(now_ns)
        return not heartbeat or controller.rate < STOPPED_RATE

    def unrest(self, controller: Controller | None) -> str:
        """Why the robot must come to rest first; empty when it stands or moves freely.

        A stop that has begun to bite ends at rest, whatever its cause: where a robot that is being
        slowed and quickened again will be at a hand-over, nobody knows well enough.
        """
        if controller is None or not controller.active:
            return ""
        if self.since_ns is not None:
            return self._why
        if controller.stopping and STANDING_RATE < controller.rate < STOPPED_RATE:
            return controller.reason or "the controller is stopping"
        return ""
