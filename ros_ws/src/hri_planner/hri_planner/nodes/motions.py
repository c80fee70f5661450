"""What a node that moves the robot must bring: replans, and what is said of them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, Generic, Protocol, TypeVar

from numpy import float64
from numpy.typing import NDArray

from hri_planner.ptomp.plan import JointPlan
from hri_planner.ros.handover import Handover, Joint
from hri_planner.ros.worker import Worker
from hri_planner.supervision.decision import Goal, Interval, ReadyPlan, Report

FloatArray = NDArray[float64]


@dataclass(frozen=True)
class Failed:
    """A replan that brought no plan: the motion, and why."""

    number: int
    text: str


class Planned(Protocol):
    """What a planner made of a replan."""

    @property
    def plan(self) -> JointPlan:
        """The plan."""


BeforeT = TypeVar("BeforeT")
ResultT = TypeVar("ResultT", bound=Planned)


@dataclass(frozen=True)
class MadePlan(ABC, Generic[BeforeT, ResultT]):
    """A plan, and what it was made from and for.

    Attributes:
        interval: When, and for which motion.
        newest_sample_ns: Newest human sample that it used [ns].
        joint: Where it meets the plan before.
        before: The planner as it was, for when the plan is dropped.
        result: The plan and how it came about.
        compute_s: What it took [s].
    """

    interval: Interval
    newest_sample_ns: int
    joint: Joint | None
    before: BeforeT
    result: ResultT
    compute_s: float

    @property
    def plan(self) -> JointPlan:
        """The plan."""
        return self.result.plan

    @abstractmethod
    def ready(self, due_ns: int | None) -> ReadyPlan:
        """The plan, when its first point is due [ns]; none: the robot will not be there."""

    @abstractmethod
    def is_over_for(self, number: int, plan_time_s: float) -> bool:
        """Whether it has brought the tool to the goal of a motion by that time [s]."""


class Replans(Protocol):
    """Makes plans beside the executor.

    Attributes:
        handover: Keeps the planner's idea of the motion and the controller's together.
        worker: Where plans are made.
    """

    handover: Handover[Any]
    worker: Worker[Any]

    def start(self, goal: Goal, handover_ns: int) -> None:
        """Set the planner on a new goal, from rest or in flight; PlanningError: there is no way."""

    def submit(self, interval: Interval) -> bool:
        """Begin a replan with the newest inputs; whether it has begun."""

    def take(self, now_ns: int) -> Any:
        """The plan that has become ready, once, or why there is none (:class:`Failed`)."""

    def abandon(self, number: int) -> None:
        """A motion is over."""


class Reports(Protocol):
    """Says what the node does."""

    def restart(self, now_ns: int) -> None:
        """The clock went back to a time [ns]."""

    def distance(self, target: FloatArray) -> float:
        """Of the tool to a position (3,) [m]."""

    def made(self, made: Any, now_ns: int) -> None:
        """A replan for something that goes on is ready."""

    def say(self, now_ns: int, report: Report, duration_s: float | None) -> None:
        """Publish a status; ``duration_s`` [s] is that of the present motion's goal, if it has one."""

    def say_plan(
        self,
        now_ns: int,
        report: Report,
        duration_s: float | None,
        made: Any,
        *,
        due_ns: int,
        due_s: float,
    ) -> None:
        """Publish the status of a plan that was sent, due at ``due_ns`` [ns], plan clock ``due_s`` [s]."""

    def figures(self) -> dict[str, Any]:
        """For /diagnostics."""
