"""What goes into a decision of the supervisor, and what comes out of it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum, IntEnum

import numpy as np
from numpy.typing import NDArray

from hri_planner.supervision.freshness import Heard

FloatArray = NDArray[np.float64]


class Stage(IntEnum):
    """What the robot does; as in hri_msgs/PlannerStatus."""

    IDLE = 0
    MOVING = 1
    WAITING = 2
    STOPPING = 3
    HOLDING = 4


class Outcome(IntEnum):
    """How a motion ends; as in hri_msgs/action/ReachTarget."""

    REACHED = 0
    CANCELLED = 1
    UNREACHABLE = 2
    BLOCKED = 3
    LOST_INPUT = 4
    REJECTED = 5
    PREEMPTED = 6
    FAILED = 7


@dataclass(frozen=True, eq=False)
class Goal:
    """Where to.

    Attributes:
        target: Tool position (3,) [m].
        duration_s: Wanted duration [s].
    """

    target: FloatArray
    duration_s: float


@dataclass(frozen=True)
class Seen:
    """What is known at a tick.

    Attributes:
        now_ns: The time [ns].
        heard: What was heard last.
        speed: Speed of the fastest joint [rad/s].
        distance: Of the tool to the goal [m].
        separation: Smallest surface distance robot-person [m]; infinite when nobody is seen.
        busy: Whether a replan is under way.
        plan_over: Whether the newest plan of the present motion has ended at the goal.
        on_plan: Whether at the next hand-over the robot will be on a plan of ours.
    """

    now_ns: int
    heard: Heard
    speed: float = 0.0
    distance: float = math.inf
    separation: float = math.inf
    busy: bool = False
    plan_over: bool = False
    on_plan: bool = False


@dataclass(frozen=True)
class Interval:
    """One replan to be made.

    Attributes:
        begin_ns: When the interval begins [ns].
        handover_ns: When it ends and its plan takes effect [ns].
        number: Motion that the plan is for; the newest one while its goal is held.
        start: Goal of a motion that begins with this plan; none when it is under way.
        ahead: Whether this is the time that a planner which plans once has before the robot sets off.
    """

    begin_ns: int
    handover_ns: int
    number: int
    start: Goal | None = None
    ahead: bool = False


@dataclass(frozen=True)
class Ending:
    """How a motion has ended.

    Attributes:
        number: The motion.
        outcome: How.
        reason: Why, in plain words.
        duration_s: From acceptance to the end [s].
        min_separation: Smallest on the way [m]; infinite when nobody was seen.
        replans: Plans that it followed.
        costs: Of the last plan, by name.
        target: Its goal (3,) [m]; none when that could not be understood.
    """

    number: int
    outcome: Outcome
    reason: str
    duration_s: float
    min_separation: float
    replans: int
    costs: Mapping[str, float]
    target: FloatArray | None


@dataclass(frozen=True)
class Report:
    """What the status says.

    Attributes:
        stage: What the robot does.
        reason: Why; empty when there is nothing to say.
        speed_scale: Asked of the controller, 0...1.
        number: Motion, or the newest one when there is none now.
        replans: Of that motion.
        misses: Intervals of that motion that brought no new plan.
        target: Goal (3,) [m]; none without a motion.
    """

    stage: Stage
    reason: str
    speed_scale: float
    number: int
    replans: int = 0
    misses: int = 0
    target: FloatArray | None = None


@dataclass(frozen=True)
class Decision:
    """What is to be done, in this order.

    Attributes:
        faults: To be said: kind and text.
        drop: Whether the controller is to stop along its path and drop it.
        endings: Motions that have ended.
        reports: For the status.
        interval: The replan to begin.
    """

    faults: tuple[tuple[str, str], ...] = ()
    drop: bool = False
    endings: tuple[Ending, ...] = ()
    reports: tuple[Report, ...] = ()
    interval: Interval | None = None


@dataclass
class Orders:
    """A decision in the making."""

    faults: list[tuple[str, str]] = field(default_factory=list)
    drop: bool = False
    endings: list[Ending] = field(default_factory=list)
    reports: list[Report] = field(default_factory=list)
    interval: Interval | None = None

    def decision(self) -> Decision:
        """The decision."""
        return Decision(
            tuple(self.faults), self.drop, tuple(self.endings), tuple(self.reports), self.interval
        )


@dataclass(frozen=True)
class ReadyPlan:
    """A plan that has just been made.

    Attributes:
        number: Motion that it was made for.
        handover_ns: When it takes effect [ns].
        due_ns: When the controller will be where it begins [ns]; none: it will not.
        waits: Whether it stays off the goal, as there is no safe way now.
        reason: What it says of itself.
        costs: By name.
    """

    number: int
    handover_ns: int
    due_ns: int | None
    waits: bool = False
    reason: str = ""
    costs: Mapping[str, float] = field(default_factory=dict)


class Verdict(Enum):
    """What becomes of a plan."""

    PUBLISH = "publish"
    DROP = "drop"
    """It comes too late, or the robot is being stopped: the robot stays on the plan before."""
    FORGET = "forget"
    """What it was made for has ended."""
