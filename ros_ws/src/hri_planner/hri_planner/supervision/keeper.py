"""The present motion, what is held, and what the status says of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from hri_planner.supervision.decision import Decision, Goal, Orders, Outcome, Report, Stage
from hri_planner.supervision.motion import Motion

FloatArray = NDArray[np.float64]


class Keeper:
    """Takes goals, one after the other, and ends each motion once.

    Attributes:
        motion: The present one.
        holding: Whether the goal of a motion that has reached it is kept, clear of people.
        stage: What the robot does.
        reason: Why.
        scale: Speed scale asked of the controller, 0...1.
    """

    def __init__(self) -> None:
        self.motion: Motion | None = None
        self.holding = False
        self.stage = Stage.IDLE
        self.reason = ""
        self.scale = 1.0
        self._count = 0

    @property
    def active(self) -> bool:
        """Whether the robot is to move, or might have to."""
        return self.motion is not None or self.holding

    def accept(self, goal: Goal, now_ns: int) -> tuple[int, Decision]:
        """A new goal takes the place of the present one. Returns its number too."""
        orders = Orders()
        self._count += 1
        if self.motion is not None and self.motion.cancelling:
            self._end(self.motion, Outcome.CANCELLED, "cancelled, and a newer goal", now_ns, orders)
        elif self.motion is not None:
            self._end(self.motion, Outcome.PREEMPTED, "a newer goal took over", now_ns, orders)
        self.motion = Motion(self._count, now_ns, goal)
        return self._count, orders.decision()

    def refuse(self, reason: str, now_ns: int) -> tuple[int, Decision]:
        """A goal that cannot be understood ends at once; the present one goes on."""
        orders = Orders()
        self._count += 1
        motion = Motion(self._count, now_ns, None)
        self._end(motion, Outcome.REJECTED, reason, now_ns, orders)
        return self._count, orders.decision()

    def cancel(self, number: int) -> bool:
        """Ask for the end of a motion; false when it is not the present one."""
        if self.motion is None or self.motion.number != number:
            return False
        self.motion.cancelling = True
        return True

    def begins(self) -> Report:
        """What the status says of a motion that has been accepted and not begun."""
        if self.stage in (Stage.IDLE, Stage.HOLDING):
            self.stage, self.reason = Stage.WAITING, "the motion is about to begin"
        return self._report(self.motion)

    def retarget(self, target: FloatArray) -> bool:
        """The goal of the present motion is elsewhere from now on (3,) [m]; false: there is no motion."""
        if self.motion is None or self.motion.goal is None or self.motion.cancelling:
            return False
        self.motion.goal = replace(self.motion.goal, target=target)
        self.motion.over_since_ns = None
        return True

    def release(self, why: str) -> Decision:
        """What is held is let go."""
        self.holding = False
        if self.motion is None:
            self.stage, self.reason = Stage.IDLE, why
        return Decision(reports=(self._report(self.motion),))

    def give_way(self, why: str, now_ns: int) -> Decision:
        """Others lead the robot: what goes on or is held ends here, and is not stopped, as it is theirs."""
        if self.motion is None:
            return self.release(why)
        orders = Orders()
        self.holding = False
        self._end(self.motion, Outcome.REJECTED, why, now_ns, orders)
        return orders.decision()

    def _concerns_us(self, number: int) -> bool:
        motion = self.motion
        if motion is None:
            return self.holding
        return motion.number == number and motion.started and not motion.cancelling

    def _halt(self, orders: Orders) -> None:
        """Stop, and hold nothing."""
        orders.drop = True
        self.holding = False

    def _end(
        self, motion: Motion, outcome: Outcome, reason: str, now_ns: int, orders: Orders
    ) -> None:
        """End a motion, once."""
        if motion.ended:
            return
        orders.endings.append(motion.end(outcome, reason, now_ns))
        if self.motion is motion:
            self.motion = None
            self.stage = Stage.HOLDING if self.holding else Stage.IDLE
            self.reason = reason
            orders.reports.append(self._report(motion))

    def _report(self, motion: Motion | None) -> Report:
        if motion is None:
            return Report(self.stage, self.reason, self.scale, self._count)
        return motion.report(self.stage, self.reason, self.scale)
