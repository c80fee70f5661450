"""A supervisor on a clock of its own, fed with facts that tests change."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from hri_planner.supervision.decision import (
    Decision,
    Ending,
    Goal,
    Interval,
    ReadyPlan,
    Report,
    Seen,
    Verdict,
)
from hri_planner.supervision.freshness import Controller, Heard, HeardPerson, Limits
from hri_planner.supervision.rules import Rules
from hri_planner.supervision.supervisor import Supervisor

MS = 1_000_000
TICK_NS = 4 * MS
LIMITS = Limits(max_joint_age_s=0.1, max_sample_age_s=0.085, require_tracking=True)
RULES = Rules(
    interval_ns=36 * MS,
    transport_ns=5 * MS,
    late_timeout_s=0.12,
    lost_timeout_s=2.0,
    max_duration_s=20.0,
    goal_tolerance=0.005,
    rest_speed=0.02,
    heartbeat=True,
    plans_once=False,
    knows_table=True,
)
GOAL = Goal(np.array([0.5, 0.2, 0.3]), 1.5)


@dataclass(frozen=True)
class Facts:
    """What is seen, with ages [s] in the place of stamps; none: never heard."""

    joints_age: float | None = 0.0
    controller_age: float | None = 0.0
    active: bool = True
    stopping: bool = False
    rate: float = 1.0
    controller_reason: str = ""
    controller_fault: str = ""
    tracked: tuple[str, ...] | None = ("p1",)
    unlisted: str = ""
    prediction_age: float | None = 0.02
    invalid: str = ""
    speed: float = 0.5
    distance: float = 0.3
    separation: float = 0.4
    busy: bool = False
    plan_over: bool = False
    on_plan: bool = True

    def seen(self, now_ns: int) -> Seen:
        """As the supervisor is told it."""

        def stamp(age: float | None) -> int | None:
            return None if age is None else now_ns - round(age * 1e9)

        said, made = stamp(self.controller_age), stamp(self.prediction_age)
        controller = None
        if said is not None:
            controller = Controller(
                said, self.active, self.stopping, self.rate, self.controller_reason
            )
        predictions = {}
        if made is not None:
            predictions["p1"] = HeardPerson(made, bool(self.invalid), self.invalid)
        heard = Heard(
            stamp(self.joints_age),
            controller,
            self.controller_fault,
            self.tracked,
            predictions,
            unlisted=self.unlisted,
        )
        return Seen(
            now_ns,
            heard,
            speed=self.speed,
            distance=self.distance,
            separation=self.separation,
            busy=self.busy,
            plan_over=self.plan_over,
            on_plan=self.on_plan,
        )


@dataclass
class Run:
    """A supervisor and everything that it has said."""

    rules: Rules = RULES
    facts: Facts = Facts()
    plans: bool = True
    """Whether each replan brings a plan, in time."""
    waits: str = ""
    """Why the plans stay off the goal, if they do."""
    begins: bool = True
    """Whether the planner can begin the goals that it gets."""
    now_ns: int = 10_000 * MS
    faults: list[tuple[str, str]] = field(default_factory=list)
    drops: int = 0
    endings: list[Ending] = field(default_factory=list)
    reports: list[Report] = field(default_factory=list)
    intervals: list[Interval] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.supervisor = Supervisor(self.rules, LIMITS)

    def change(self, **facts: object) -> None:
        """See something else from now on."""
        self.facts = replace(self.facts, **facts)  # type: ignore[arg-type]

    def take(self, decision: Decision) -> Decision:
        """Note a decision, and let the planner do its part."""
        self.faults += decision.faults
        self.drops += decision.drop
        self.endings += decision.endings
        self.reports += decision.reports
        interval = decision.interval
        if interval is not None:
            self.intervals.append(interval)
            self._replan(interval)
        return decision

    def _replan(self, interval: Interval) -> None:
        if interval.start is not None:
            if not self.begins:
                self.take(self.supervisor.unreachable("too far", self.facts.seen(self.now_ns)))
                return
            self.supervisor.begun(interval)
        if self.plans:
            self.ready(interval)

    def ready(self, interval: Interval, early_ns: int = 20 * MS) -> Verdict:
        """A plan of an interval is ready, so long before its hand-over."""
        plan = ReadyPlan(
            interval.number,
            interval.handover_ns,
            interval.handover_ns,
            waits=bool(self.waits),
            reason=self.waits,
            costs={"collision": 2.0},
        )
        now_ns = interval.handover_ns - early_ns
        verdict = self.supervisor.judge(plan, now_ns)
        if verdict == Verdict.PUBLISH:
            self.reports.append(self.supervisor.published(plan, now_ns))
        return verdict

    def go(self, goal: Goal = GOAL) -> int:
        """A goal comes."""
        number, decision = self.supervisor.accept(goal, self.now_ns)
        self.take(decision)
        return number

    def tick(self) -> Decision:
        """One tick, and what was decided."""
        self.now_ns += TICK_NS
        if self.supervisor.clock_went_back(self.now_ns):
            self.take(self.supervisor.restart(self.now_ns))
        return self.take(self.supervisor.tick(self.facts.seen(self.now_ns)))

    def run(self, seconds: float, until: Callable[[], bool] = lambda: False) -> None:
        """Tick for a time [s], or until something holds."""
        for _ in range(round(seconds * 1e9 / TICK_NS)):
            self.tick()
            if until():
                return

    def end(self, seconds: float) -> Ending:
        """Tick until the motion ends; fails when it has not within a time [s]."""
        self.run(seconds, lambda: bool(self.endings))
        assert self.endings, f"no end: stage {self.supervisor.stage}, {self.supervisor.reason}"
        return self.endings[-1]


def moving(**facts: object) -> Run:
    """A run in mid-motion; facts change then."""
    run = Run(facts=Facts(active=False, speed=0.0))
    run.go()
    run.run(0.1)
    run.facts = Facts()
    run.run(0.2)
    run.change(**facts)
    return run
