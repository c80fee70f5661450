"""The planning clock: when replans begin and are due, and which intervals brought no plan."""

from __future__ import annotations

from hri_planner.supervision.freshness import NANO


class Intervals:
    """Intervals follow each other without a gap; each is to bring one plan for its end.

    Args:
        interval_ns: From the start of a replan to its hand-over [ns].
        transport_ns: A plan must be ready so long before its hand-over [ns].
        late_timeout_s: A replan that is late by this much is overdue [s].

    Attributes:
        overdue: Whether no plan has come in time for too long; the first in time ends that.
        failure: Why the last replan failed; empty when one has succeeded since.
        plans: Plans that were made for something that goes on.
        misses: Intervals that brought no plan that could be used.
        failures: Replans that failed.
    """

    def __init__(self, interval_ns: int, transport_ns: int, late_timeout_s: float) -> None:
        self.interval_ns = interval_ns
        self._transport_ns = transport_ns
        self._late_timeout_s = late_timeout_s
        self._next_ns = 0
        self._last_plan_ns = 0
        self.overdue = False
        self.failure = ""
        self.plans = self.misses = self.failures = 0

    def restart(self, now_ns: int) -> None:
        """Begin anew, as of now; counts go on."""
        self.overdue, self.failure = False, ""
        self._last_plan_ns = self._next_ns = now_ns

    def resume(self, now_ns: int) -> None:
        """Go on after a pause: no replan was due in it, so the first one is not late."""
        self._last_plan_ns = max(self._last_plan_ns, now_ns)
        self._next_ns = max(self._next_ns, now_ns)

    def postpone(self, until_ns: int) -> None:
        """Begin no replan before then."""
        self._next_ns = until_ns

    def lateness(self, now_ns: int, *, due: bool) -> str:
        """What is said when no replan has come for too long; empty when all is well.

        Whether it still computes or failed again and again makes no difference to the robot: it is on
        a plan that knows nothing of what the person did since.

        Args:
            now_ns: The time [ns].
            due: Whether plans are due at all now.
        """
        late_s = (now_ns - self._last_plan_ns - self.interval_ns) / NANO
        if due and late_s > self._late_timeout_s:
            self.overdue = True
        if not self.overdue:
            return ""
        why = f": {self.failure}" if self.failure else ""
        return f"the replan is {late_s:.2f} s late{why}"

    def is_due(self, now_ns: int) -> bool:
        """Whether the next replan may begin."""
        return now_ns >= self._next_ns

    def next(self, now_ns: int) -> tuple[int, int]:
        """When the interval that is due begins [ns], and how many were missed before it.

        It begins with the last hand-over, not now: else each would be longer by part of a tick.
        """
        behind_ns = now_ns - self._next_ns
        if behind_ns > self.interval_ns // 4:
            return now_ns, behind_ns // self.interval_ns
        return self._next_ns, 0

    def begun(self, handover_ns: int) -> None:
        """A replan for that hand-over has begun."""
        self._next_ns = handover_ns

    def started(self, handover_ns: int) -> None:
        """A motion sets off at that hand-over, from which on plans are due."""
        self._last_plan_ns = handover_ns

    def is_late(self, now_ns: int, handover_ns: int, due_ns: int | None) -> bool:
        """Whether a plan comes too late to be followed; if not, replanning works (again).

        Args:
            now_ns: The time [ns].
            handover_ns: The hand-over that it was made for [ns].
            due_ns: When the controller is where it begins [ns]; in the past, or never, it is a jump.
        """
        self.plans += 1
        late = now_ns > handover_ns - self._transport_ns or due_ns is None or due_ns < now_ns
        if not late:
            self.overdue, self.failure = False, ""
        return late

    def published(self, now_ns: int) -> None:
        """A plan was sent."""
        self._last_plan_ns = now_ns

    def failed(self, text: str) -> None:
        """A replan failed: the robot stays on the plan before, until that is too old."""
        self.failures += 1
        self.failure = text
