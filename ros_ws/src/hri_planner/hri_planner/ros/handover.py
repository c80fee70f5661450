"""Where a replan begins: the state that the robot will have when the new plan takes effect."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Generic, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from hri_planner.ptomp.plan import JointPlan
from hri_planner.ros.inputs import RobotInputs
from hri_planner.ros.tracker import MAX_LATENESS_NS, PlanTracker, Progress, Published
from hri_planner.supervision.freshness import STANDING_RATE
from hri_prediction.ros.messages import ControllerState
from hri_prediction.ros.time import NANO, seconds_to_ns, to_ns

FloatArray = NDArray[np.float64]

CONTROLLER_STEP_NS = 4_000_000
"""Step of the trajectory controller [ns]."""
OFF_PATH_RAD = 5e-4
"""A plan that begins farther than this from where the robot will be is not sent [rad]."""
_SAME = 1e-6
"""Angles [rad] and speeds [rad/s] of one state agree to this."""
_SAME_NS = 1000
"""Times that differ by less are one, but for rounding [ns]."""


class LivePlanner(Protocol):
    """What a planner must be able to do for the robot to be led by its plans.

    Attributes:
        plan: The newest; none before the first motion.
    """

    plan: JointPlan | None

    def resync(self, q: FloatArray, qd: FloatArray, time_s: float) -> None:
        """Go on from joint angles and speeds (7,), (7,) at a time of the plan clock."""

    def follow(self, plan: JointPlan) -> None:
        """The robot is on this plan of the present motion."""

    def snapshot(self) -> Any:
        """What the next replan starts from; has the ``plan`` too."""

    def restore(self, snapshot: Any) -> None:
        """Go back to an earlier state."""


PlannerT = TypeVar("PlannerT", bound=LivePlanner)


@dataclass(frozen=True)
class Joint:
    """Where a plan joins what the robot is on.

    Attributes:
        follows: The plan that the controller is on.
        plan_time_s: Where on it the new one begins, on its plan clock [s].
    """

    follows: Published
    plan_time_s: float


class Handover(Generic[PlannerT]):
    """Keeps the planner's idea of the motion and the controller's together.

    Args:
        planner: The first planner; used between two replans only.
        inputs: What the node has heard.
        arrival_ns: Time from the start of a cycle until its plan reaches the controller [ns].
        interval_ns: Time from the start of a cycle to its hand-over [ns].
        lockstep: Whether plans arrive at once, and take effect as of the controller's last step.

    Attributes:
        planner: The planner of the present motion.
        origin_ns: Zero of the plan clock on the ROS clock [ns].
        not_followed: Plans that the controller was to follow and did not: refused, or lost.
        off_path: Plans that were not sent, because they begin where the robot will not be.
    """

    def __init__(
        self,
        planner: PlannerT,
        inputs: RobotInputs,
        *,
        arrival_ns: int,
        interval_ns: int,
        lockstep: bool,
        now_ns: Callable[[], int],
    ) -> None:
        self.planner = planner
        self._inputs = inputs
        self._arrival_ns = arrival_ns
        self._interval_ns = interval_ns
        self._lockstep = lockstep
        self._now_ns = now_ns
        self._sent = PlanTracker()
        self.origin_ns = 0
        self.not_followed = self.off_path = 0
        self._missing: Published | None = None

    def begin(self, origin_ns: int) -> None:
        """Begin a motion, on which the planner is, with a plan clock that is zero at ``origin_ns``.

        The controller may be on a plan of the motion before, and stays there if the next is lost.
        """
        self._sent.rebase(self.plan_time_s(origin_ns))
        self.origin_ns = origin_ns

    def forget(self) -> None:
        """The controller was told to drop what it is on."""
        self._sent.clear()

    def plan_time_s(self, time_ns: int) -> float:
        """A time on the plan clock [s]."""
        return (time_ns - self.origin_ns) / NANO

    @property
    def follows_a_plan(self) -> bool:
        """Whether the controller is on a plan that was sent since the last stop, and none is under way."""
        progress = self._sent.progress(self._inputs.reference, 0, 0)
        return progress is not None and (progress.newest or progress.refused)

    def state_at(self, time_ns: int) -> tuple[FloatArray, FloatArray, FloatArray] | None:
        """State on the path that the controller will have then; none when it follows no plan."""
        progress = self._progress(time_ns)
        return None if progress is None else progress.published.plan.sample(progress.plan_time_s)

    def align(self, handover_ns: int) -> Joint | None:
        """Let the planner go on from where the robot will be.

        That is elsewhere than the newest plan says when speed scaling has held the robot back, when
        it was stopped, or when the newest plan did not get through.

        Args:
            handover_ns: When the plan to come takes effect [ns].

        Returns:
            Where the plan to come joins; none when that is not on a plan that the controller is known to
            be on: from rest, or while the newest plan is on its way.
        """
        reference = self._inputs.reference
        progress = self._progress(handover_ns)
        if reference is None or handover_ns == self.origin_ns:
            return None  # the motion begins
        if progress is None:
            if reference.state == ControllerState.IDLE and not self._on_its_way(reference):
                self._from_rest(reference, handover_ns)
            return None
        if progress.rate < STANDING_RATE and not self._on_its_way(reference):
            self._from_rest(reference, handover_ns)
            return None
        joint = Joint(progress.published, progress.plan_time_s)
        lag_s = self.plan_time_s(handover_ns) - progress.plan_time_s
        if not progress.newest and not progress.refused:
            return None
        if progress.refused and self._sent.newest is not self._missing:
            self.not_followed += 1
            self._missing = self._sent.newest
        if progress.published.earlier:
            # Nothing of this motion has got through yet: it begins anew from where the robot will be.
            q, qd, _ = progress.published.plan.sample(progress.plan_time_s)
            self.planner.resync(q, qd, self.plan_time_s(handover_ns))
            return joint
        if progress.refused:
            self.planner.restore(progress.published.snapshot)
        elif progress.rate > 0.999 and lag_s < 1e-6:
            return joint  # as planned
        self.planner.follow(progress.published.plan.shifted(lag_s))
        return joint

    def due_ns(self, handover_ns: int, joint: Joint | None, begin: FloatArray) -> int | None:
        """When the first point of a plan is due, if it is sent now [ns]; none when it must not be sent.

        At full speed that is the hand-over that it was made for. While the controller is slower, the time
        at which it will be where the plan begins depends on when the plan arrives. Controllers take plans
        in between two of their steps, as of the last one: that is on average half a step ago, in lock-step
        a whole one.

        Where the controller is on another path than the plan was made for, since the plan before did not
        get through, or its speed changed, following the plan would be a jump.

        Args:
            handover_ns: The hand-over that it was made for [ns].
            joint: Where it joins, by :meth:`align`.
            begin: Its first point (7,) [rad].
        """
        reference = self._inputs.reference
        if reference is None:
            return handover_ns
        step_ns = CONTROLLER_STEP_NS if self._lockstep else CONTROLLER_STEP_NS // 2
        taken_ns = self._now_ns() - step_ns
        progress = self._sent.progress(reference, taken_ns, taken_ns)
        if progress is not None and joint is not None and progress.published is joint.follows:
            due_ns = taken_ns + seconds_to_ns(joint.plan_time_s - progress.plan_time_s)
            return handover_ns if abs(due_ns - handover_ns) < _SAME_NS else due_ns
        there = np.array(reference.reference_position)
        if progress is not None and progress.rate >= STANDING_RATE:
            ahead_s = (handover_ns - taken_ns) / NANO
            there = progress.published.plan.sample(progress.plan_time_s + ahead_s)[0]
        if np.abs(there - begin).max() <= OFF_PATH_RAD:
            return handover_ns
        self.off_path += 1
        return None

    def sent(self, due_ns: int, before: JointPlan | None, plan: JointPlan) -> None:
        """Note a plan that is being sent.

        Args:
            due_ns: When its first point is due [ns].
            before: The plan that it was made from.
            plan: The plan.
        """
        path = self._sent.with_lead_in(before, plan)
        self._sent.add(Published(due_ns, plan.start_s, path, self.planner.snapshot()))

    def _progress(self, handover_ns: int) -> Progress | None:
        arrival_ns = handover_ns - self._interval_ns + self._arrival_ns
        return self._sent.progress(self._inputs.reference, handover_ns, arrival_ns)

    def _on_its_way(self, reference: ControllerState) -> bool:
        """Whether the newest plan may have arrived since the controller spoke, or may yet."""
        newest = self._sent.newest
        said_ns = to_ns(reference.header.stamp)
        return newest is not None and said_ns <= newest.due_ns + MAX_LATENESS_NS

    def _from_rest(self, reference: ControllerState, handover_ns: int) -> None:
        """The robot stands, and will until the next plan."""
        if self.planner.plan is None:
            return
        stands_at = np.array(reference.reference_position)
        handover_s = self.plan_time_s(handover_ns)
        q, qd, _ = self.planner.plan.sample(handover_s)
        if max(np.abs(q - stands_at).max(), np.abs(qd).max()) > _SAME:
            self.planner.resync(stands_at, np.zeros(7), handover_s)
