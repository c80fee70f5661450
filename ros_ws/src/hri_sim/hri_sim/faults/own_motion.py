"""Whether a robot moves of its own, or is moved by somebody who leans on it, and whom it touches.

A robot at rest is no hazard, yet a person who does not see it may reach into it and push it: its joints
turn then although its controller holds still. So a robot comes to rest when neither its joints nor its
reference moves, and it stays at rest until the reference moves, or a joint does while nobody touches it
or has just let go of it. A robot that is pushed while it stops never has joints at rest: it rests when its
reference has done so for long enough that its joints would, too.
"""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from dataclasses import dataclass

REST = 0.02
"""Joint speed below which the robot is at rest [rad/s]."""
NEAR = 2
"""A touch belongs to so many joint states before and after it: not all is told at once."""

SWING_S = 0.2
"""So long may a robot swing back that somebody has let go of; what moves later moves of its own [s]."""
SETTLE_S = 0.02
"""So long after the reference rests the joints of a robot that nobody touches do [s]; within 4 ms in twelve
stops in lock-step."""

Timed = Sequence[tuple[float, float]]
"""Times [s], ascending, and values."""
Touches = Sequence[tuple[float, float, float]]
"""Times of states [s], ascending, how many contacts with people there are, and how fast the robot comes at
who is nearest [m/s]."""


@dataclass(frozen=True)
class OwnMotion:
    """How a robot moved in some time.

    Attributes:
        moves: Whether it moved of its own at the end.
        rest_s: Since when it has been at rest [s]; none: it moves, or has been at rest all the time.
        touched_moving: States in which somebody was touched while it moved of its own.
        touched_at_rest: States in which somebody was touched while it rested.
        came_at: How fast it came at whom it touched while it moved, at most [m/s]; 0: not at all.
    """

    moves: bool
    rest_s: float | None
    touched_moving: int
    touched_at_rest: int
    came_at: float


def own_motion(joints: Timed, references: Timed, touches: Touches, *, moving: bool) -> OwnMotion:
    """How a robot moved.

    Args:
        joints: Speed of its fastest joint [rad/s].
        references: The same of its reference [rad/s]; where there is none, joints alone tell.
        touches: Contacts with people, of all states of the simulation.
        moving: Whether it moved of its own before.
    """
    reference_times = [time_s for time_s, _ in references]
    touch_times = [time_s for time_s, count, _ in touches if count]
    state_times = [time_s for time_s, _, _ in touches]
    moves, rest_s = moving, None
    touched_s, asked_s = -math.inf, math.inf
    times: list[float] = []
    moved: list[bool] = []
    for time_s, speed in joints:
        newest = bisect_right(reference_times, time_s) - 1
        asked = references[newest][1] if newest >= 0 else 0.0
        near = bisect_left(state_times, time_s)
        about = state_times[max(near - NEAR, 0) : near + NEAR + 1]
        if about:
            first = bisect_left(touch_times, about[0])
            if first < len(touch_times) and touch_times[first] <= about[-1]:
                touched_s = time_s
        pushed = time_s - touched_s <= SWING_S
        # Since when the reference has been at rest; never, where there is none.
        asked_s = min(asked_s, time_s) if newest >= 0 and asked < REST else math.inf
        settled = pushed and time_s - asked_s >= SETTLE_S
        if moves and asked < REST and (speed < REST or settled):
            moves, rest_s = False, time_s
        elif not moves and (asked >= REST or (speed >= REST and not pushed)):
            moves, rest_s = True, None
        times.append(time_s)
        moved.append(moves)

    def moved_at(time_s: float) -> bool:
        index = bisect_right(times, time_s) - 1
        return moved[index] if index >= 0 else moving

    while_moving = [speed for time_s, count, speed in touches if count and moved_at(time_s)]
    at_rest = len(touch_times) - len(while_moving)
    return OwnMotion(moves, rest_s, len(while_moving), at_rest, max([0.0, *while_moving]))
