"""Which published plan the controller is on, and where on it the robot will be at a hand-over."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hri_planner.ptomp.plan import JointPlan
from hri_prediction.ros.messages import ControllerState
from hri_prediction.ros.time import NANO, to_ns

LEAD_IN_S = 0.3
"""How much of the plan before is kept in front of a plan [s]."""
MAX_LATENESS_NS = 20_000_000
"""A controller that has not taken a plan so long after its first point was due never will [ns]."""
_SAME_RAD = 1e-6
_SAME_NS = 1000  # stamps of one trajectory agree to rounding


@dataclass(frozen=True)
class Published:
    """A plan that was sent.

    Attributes:
        due_ns: ROS time of its first point [ns].
        start_s: Plan time of its first point [s].
        plan: The plan, with what the robot was on before it.
        snapshot: The planner's state with it.
        earlier: Whether it was sent for an earlier motion.
    """

    due_ns: int
    start_s: float
    plan: JointPlan
    snapshot: Any
    earlier: bool = False


@dataclass(frozen=True)
class Progress:
    """Where the controller will be at a hand-over.

    Attributes:
        published: The plan that it follows.
        plan_time_s: Time of that plan at the hand-over, on the plan clock [s].
        rate: Rate at which it is followed, 0...1.
        newest: Whether it is the plan that was sent last.
        refused: Whether the plan that was sent last is long due, but not followed: refused or lost.
    """

    published: Published
    plan_time_s: float
    rate: float
    newest: bool
    refused: bool


class PlanTracker:
    """The last plans that were sent."""

    def __init__(self) -> None:
        self._published: deque[Published] = deque(maxlen=8)

    def clear(self) -> None:
        """Forget all, as a stop asks for."""
        self._published.clear()

    def rebase(self, seconds: float) -> None:
        """Go over to a plan clock that shows so much less [s], as a new motion begins in flight."""
        moved = [
            replace(p, start_s=p.start_s - seconds, plan=p.plan.shifted(-seconds), earlier=True)
            for p in self._published
        ]
        self._published.clear()
        self._published.extend(moved)

    def add(self, published: Published) -> None:
        """Note a plan that is being sent."""
        self._published.append(published)

    def with_lead_in(self, before: JointPlan | None, plan: JointPlan) -> JointPlan:
        """A plan with the end of what came before it put in front.

        A controller that was held up may at the hand-over still be on its way to the first point.

        Args:
            before: The plan that it was made from, on the same plan clock.
            plan: The plan.
        """
        newest = self.newest
        if newest is not None:
            gap = np.abs(newest.plan.sample(plan.start_s)[0] - plan.q[0]).max()
            # Where the newest goes over into this one, it knows more of the past.
            before = newest.plan if gap < _SAME_RAD else before
        if before is None:
            return plan
        tail = before.remaining(plan.start_s - LEAD_IN_S)
        early = tail.time_s < plan.start_s - 1e-6
        return JointPlan(
            np.concatenate((tail.time_s[early], plan.time_s)),
            np.concatenate((tail.q[early], plan.q)),
            np.concatenate((tail.qd[early], plan.qd)),
            np.concatenate((tail.qdd[early], plan.qdd)),
        )

    @property
    def newest(self) -> Published | None:
        """The plan that was sent last."""
        return self._published[-1] if self._published else None

    def progress(
        self, reference: ControllerState | None, handover_ns: int, arrival_ns: int
    ) -> Progress | None:
        """Where the controller will be; none when it follows no plan of ours.

        Until a trajectory sent now arrives, the old one advances at the present rate; from then to the
        hand-over both advance alike, so the old one advances by what is left on the new one's clock.

        Args:
            reference: What the controller said last.
            handover_ns: Time of the hand-over [ns].
            arrival_ns: When the next trajectory will arrive [ns].
        """
        if reference is None or reference.state == ControllerState.IDLE:
            return None
        stamp_ns = to_ns(reference.trajectory)
        found = next((p for p in self._published if abs(p.due_ns - stamp_ns) < _SAME_NS), None)
        if found is None:
            return None
        said_ns = to_ns(reference.header.stamp)
        rate = float(reference.speed_scale)
        ahead = rate * (arrival_ns - said_ns) + (handover_ns - arrival_ns)
        newest = found is self._published[-1]
        said_s = found.start_s + reference.time_in_trajectory
        return Progress(
            published=found,
            plan_time_s=said_s + ahead / NANO,
            rate=rate,
            newest=newest,
            refused=not newest and said_ns > self._published[-1].due_ns + MAX_LATENESS_NS,
        )
