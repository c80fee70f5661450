"""A section of the report: what it measures, and how that is written down."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from hri_sim.benchmark.conditions import CONDITIONS_A_TASK
from hri_sim.benchmark.execution import PAPER
from hri_sim.benchmark.planners import PlannerSetup
from hri_sim.benchmark.rows import Done, Unit
from hri_sim.benchmark.run import SMOKE_TASKS, Plan
from hri_sim.benchmark.variation import AS_DRAWN, Variation

SPLIT = "test"
FEW = 3
"""Conditions of each task where many planners are compared with one seed."""


@dataclass(frozen=True)
class Scope:
    """How much is measured.

    Attributes:
        seeds: Of noise.
        smoke: Whether everything is as small as it can be.
    """

    seeds: tuple[int, ...]
    smoke: bool = False

    @property
    def first(self) -> Scope:
        """The same with its first seed alone."""
        return Scope(self.seeds[:1], self.smoke)

    def plan(
        self,
        planners: tuple[PlannerSetup, ...],
        slowdown: float,
        *,
        conditions: int = CONDITIONS_A_TASK,
        variation: Variation = AS_DRAWN,
        execution: str = PAPER,
    ) -> Plan:
        """Planners in all test tasks; arguments as of :class:`.Plan`."""
        if self.smoke:
            return Plan(
                planners, SPLIT, slowdown, self.seeds[:1], SMOKE_TASKS, 1, variation, execution
            )
        return Plan(
            planners,
            SPLIT,
            slowdown,
            self.seeds,
            conditions=conditions,
            variation=variation,
            execution=execution,
        )


@dataclass(frozen=True)
class Measured:
    """What became of a plan.

    Attributes:
        plan: What was measured.
        done: All units of work.
        results: Their figures, see :func:`hri_sim.benchmark.summary.summarise`.
    """

    plan: Plan
    done: Mapping[Unit, Done]
    results: dict[str, Any]


def extent(measured: Mapping[str, Measured]) -> str:
    """How much was measured, in words; equal for all plans of a section."""
    plan = next(iter(measured.values())).plan
    many = f"first {plan.conditions} conditions" if plan.conditions > 1 else "first condition"
    seeds = "the first seed" if len(plan.seeds) == 1 else f"{len(plan.seeds)} seeds"
    return f"The {many} of each of {len(plan.tasks)} tasks, {seeds}"


@dataclass(frozen=True)
class Section:
    """A part of the report that follows from plans of the benchmark.

    Attributes:
        name: Of its results in ``ptomp.json``.
        title: Of its text.
        plans: What is measured, by names of its own.
        lines: Its text in Markdown, from what was measured by these names.
    """

    name: str
    title: str
    plans: Callable[[Scope], dict[str, Plan]]
    lines: Callable[[Mapping[str, Measured]], list[str]]
