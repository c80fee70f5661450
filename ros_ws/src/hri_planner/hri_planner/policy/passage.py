"""The hand along a plan, found again by a robot that goes along it later or more slowly."""

from __future__ import annotations

from dataclasses import dataclass, replace

from hri_planner.policy.hand import HandState

_SAME_S = 1e-6
"""Times that differ by less are one."""
_MOST_BEFORE = 2.0
"""Control steps before the hand-over from which the hand's place is still known."""


@dataclass(frozen=True, eq=False)
class Passage:
    """The hand along a plan.

    What the network remembers, and when it is asked next, goes by where on its plans the robot is: a
    robot whose speed is scaled down asks it as often on its way as one that is not, and so takes the
    same way.

    Attributes:
        hands: At the hand-over, and after each control step from there on.
        period: Control period [s].
        before_end_s: The hand-over, before the plan's end [s].
        ahead: Share of a control step by which the hand is ahead of what its count says. Without it
            a robot that moves by less than half a control step a cycle would never ask again.
    """

    hands: tuple[HandState, ...]
    period: float
    before_end_s: float
    ahead: float = 0.0

    def at(self, left_s: float) -> tuple[HandState, float]:
        """The hand before the plan's end.

        Args:
            left_s: Time until then [s].

        Returns:
            The hand, and :attr:`ahead` from there on.

        Raises:
            LookupError: when the robot is not near that part of the plan: not there yet, or coming to
                rest.
        """
        steps = (self.before_end_s - left_s) / self.period
        asked = round(steps + self.ahead)
        if steps < -_MOST_BEFORE or not asked < len(self.hands):
            raise LookupError(f"{steps:.1f} control steps after the hand-over")
        hand = self.hands[max(asked, 0)]
        place = min(max(round(steps), 0), len(self.hands) - 1)
        off_s = (steps - place) * self.period
        if abs(off_s) > _SAME_S or place != asked:
            # Between control steps the acceleration is that which is held until the later one.
            later = self.hands[min(place + (off_s > 0.0), len(self.hands) - 1)]
            at = self.hands[place]
            hand = replace(
                hand,
                position=at.position + off_s * at.velocity + 0.5 * off_s**2 * later.acceleration,
                velocity=at.velocity + off_s * later.acceleration,
                acceleration=later.acceleration,
                filtered=later.filtered,
            )
        return hand, steps + self.ahead - max(asked, 0)
