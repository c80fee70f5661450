"""Which decisions are still good when they are to be said: nobody knows at what time those were made.

The controller counts its ``heartbeat_timeout`` from when it hears a speed scale, which has no stamp. A
decision that is said late, by a monitor that was held up in the middle of its work, would keep the robot
going for that long once more, on what was seen before.
"""

from __future__ import annotations

MOST_HELD_S = 0.004
"""From reading the time to saying what was decided with it, at most [s]; ``reaction_time`` covers it."""
TRANSPORT_S = 0.012
"""From what a monitor says to what the controller does with it, at most [s]."""


def is_timely(scale: float, held_s: float) -> bool:
    """Whether a decision is to be said.

    One that is late is not, and the one before, which was said in time, runs out in the controller. A stop
    is never too late.

    Args:
        scale: Speed scale that was decided on, 0...1.
        held_s: How long ago the time was read that it was decided with [s].
    """
    return scale == 0.0 or held_s <= MOST_HELD_S
