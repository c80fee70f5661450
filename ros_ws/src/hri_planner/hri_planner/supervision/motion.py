"""One motion: the goal, and what has happened since."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from hri_planner.supervision.decision import (
    Ending,
    Goal,
    Interval,
    Outcome,
    Report,
    Seen,
    Stage,
)
from hri_planner.supervision.freshness import NANO
from hri_planner.supervision.rules import Rules

STUCK_NS = 2_000_000_000
"""How long the tool may stay off the goal once its plan has ended there [ns]."""
STOOD_NS = 1_000_000_000
"""A node that was not run for so long is why a motion was given up, not the way to the goal [ns]."""


@dataclass
class Motion:
    """A goal under way.

    Attributes:
        number: Motions since the start, from 1.
        accepted_ns: When it was accepted [ns].
        goal: Where to; none when that could not be understood.
        started: Whether the planner is on it.
        cancelling: Whether it was asked to end.
        cancelled_ns: Since when the robot is told to stop for that [ns].
        ended: Whether it is over.
        replans: Plans that were published.
        misses: Intervals that brought none.
        min_separation: Smallest so far [m].
        lost_since_ns: Since when it is paused [ns]; none while it is not.
        looked_ns: When it was looked after last [ns]; none before the first time.
        stood_ns: The longest time in which it was not, as the node was not run [ns].
        over_since_ns: Since when the tool should have been at the goal [ns]; none before.
        costs: Of the newest plan, by name.
    """

    number: int
    accepted_ns: int
    goal: Goal | None
    started: bool = False
    cancelling: bool = False
    cancelled_ns: int | None = None
    ended: bool = False
    replans: int = 0
    misses: int = 0
    min_separation: float = math.inf
    lost_since_ns: int | None = None
    looked_ns: int | None = None
    stood_ns: int = 0
    over_since_ns: int | None = None
    costs: dict[str, float] = field(default_factory=dict)

    def look(self, now_ns: int) -> None:
        """It is looked after now [ns]."""
        if self.looked_ns is not None:
            self.stood_ns = max(self.stood_ns, now_ns - self.looked_ns)
        self.looked_ns = now_ns

    def plans_ahead(self, rules: Rules) -> bool:
        """Whether the next replan is the one that a planner which plans once makes before it sets off."""
        return rules.plans_once and self.goal is not None and self.replans == 0

    def next_interval(self, begin_ns: int, rules: Rules) -> Interval:
        """Its next replan, if that begins now [ns]."""
        length_ns, ahead = rules.interval_ns, self.plans_ahead(rules)
        if ahead and self.goal is not None:
            length_ns = max(length_ns, round(self.goal.duration_s * NANO))
        start = None if self.started else self.goal
        return Interval(begin_ns, begin_ns + length_ns, self.number, start, ahead)

    def report(self, stage: Stage, reason: str, scale: float) -> Report:
        """What the status says of it."""
        target = None if self.goal is None else self.goal.target
        return Report(stage, reason, scale, self.number, self.replans, self.misses, target)

    def verdict(self, seen: Seen, rules: Rules, reason: str) -> tuple[Outcome, str] | None:
        """Whether and how the motion ends by itself: reached, held up, or out of time.

        Args:
            seen: What is known now.
            rules: By what it is judged.
            reason: What the newest plan says of itself.
        """
        if (seen.now_ns - self.accepted_ns) / NANO > rules.max_duration_s:
            why = reason or "no way to the goal was found in time"
            if self.stood_ns >= STOOD_NS:
                why = f"this node was not run for {self.stood_ns / NANO:.1f} s"
            return Outcome.BLOCKED, f"gave up {seen.distance:.2f} m away: {why}"
        if not self.started:
            return None
        near = seen.distance <= rules.goal_tolerance
        if seen.plan_over and near and seen.speed < rules.rest_speed:
            return Outcome.REACHED, f"reached, {seen.distance * 1e3:.1f} mm off"
        if self._is_held_up(seen):
            return Outcome.BLOCKED, held_up(seen.distance, rules.knows_table)
        return None

    def _is_held_up(self, seen: Seen) -> bool:
        """Whether the tool is off the goal for too long after its plan was over."""
        if not seen.plan_over:
            self.over_since_ns = None
            return False
        if self.over_since_ns is None:
            self.over_since_ns = seen.now_ns
        return seen.now_ns - self.over_since_ns > STUCK_NS

    def end(self, outcome: Outcome, reason: str, now_ns: int) -> Ending:
        """Mark the motion as over and say how."""
        self.ended = True
        return Ending(
            number=self.number,
            outcome=outcome,
            reason=reason,
            duration_s=max(now_ns - self.accepted_ns, 0) / NANO,
            min_separation=self.min_separation,
            replans=self.replans,
            costs=dict(self.costs),
            target=None if self.goal is None else self.goal.target,
        )


def planning(failure: str) -> str:
    """What is said of a robot that has not set off, and of why the last try failed, if one did."""
    last = f"; the last try failed: {failure}" if failure else ""
    return f"planning: this planner plans once, before it sets off{last}"


def held_up(distance: float, knows_table: bool) -> str:
    """What is said of a robot that does not get to where its plan ends, ``distance`` [m] off."""
    unseen = "" if knows_table else ", which was given no table"
    return (
        f"the plan has ended at the goal, but the robot is held up {distance:.3f} m away: "
        f"something is in the way that the planner does not know{unseen}"
    )
