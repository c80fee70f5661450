"""Figures of a benchmark, with intervals that respect that conditions of a task are alike."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from hri_planner.adaptation.origin import trained_for_another
from hri_prediction.arm.geometry import FloatArray
from hri_sim.benchmark.conditions import CONDITION_RULES, TASK_RULES, task_conditions
from hri_sim.benchmark.execution import PAPER
from hri_sim.benchmark.intervals import (
    mean_interval,
    mean_of,
    share_difference_interval,
    share_interval,
)
from hri_sim.benchmark.outcome import CLEARANCES_M, Outcome
from hri_sim.benchmark.planners import ORACLE
from hri_sim.benchmark.rows import Done, Unit
from hri_sim.benchmark.run import Plan

Figure = Callable[[Outcome], float | None]

SHARES: dict[str, Figure] = {
    "ok": lambda outcome: float(outcome.ok),
    "strict": lambda outcome: float(outcome.strict),
    "clearance_2cm": lambda outcome: float(outcome.clear(CLEARANCES_M[0])),
    "clearance_5cm": lambda outcome: float(outcome.clear(CLEARANCES_M[1])),
}
"""Shares of all conditions."""
MEANS: dict[str, Figure] = {
    "accel_cost": lambda outcome: None if outcome.time_to_goal is None else outcome.accel_cost,
    "time_to_goal_s": lambda outcome: outcome.time_to_goal,
    "clearance_m": lambda outcome: outcome.clearance,
    "time_to_collision_s": lambda outcome: outcome.time_to_collision,
    "iterations": lambda outcome: outcome.iterations,
}
"""Means over the conditions that have such a figure: accelerations and time of motions that arrive."""


def task_means(outcomes: Mapping[int, Sequence[Outcome]], figure: Figure) -> FloatArray:
    """Sum and number of a figure's values in each task (tasks, 2)."""
    rows = []
    for found in outcomes.values():
        values = [value for outcome in found if (value := figure(outcome)) is not None]
        rows.append((float(np.sum(values)), float(len(values))))
    return np.array(rows)


def paired_differences(
    ours: Mapping[int, Sequence[Outcome]],
    theirs: Mapping[int, Sequence[Outcome]],
    figure: Figure,
) -> FloatArray:
    """Sum and number of the differences in each task (tasks, 2), of motions that have both values.

    Motions are compared one by one: same condition, same seed.
    """
    rows = []
    for task, found in ours.items():
        pairs = [
            (figure(mine), figure(other)) for mine, other in zip(found, theirs[task], strict=True)
        ]
        values = [a - b for a, b in pairs if a is not None and b is not None]
        rows.append((float(np.sum(values)), float(len(values))))
    return np.array(rows)


def compare(
    ours: Mapping[int, Sequence[Outcome]], theirs: Mapping[int, Sequence[Outcome]]
) -> dict[str, Any]:
    """How much larger our figures are than another planner's, in the same motions, with intervals.

    Means are over the motions that have a figure with both planners: times and accelerations of those
    that arrive with both.
    """
    found: dict[str, Any] = {"ci95": {}}
    for name, figure in SHARES.items():
        mine, other = task_means(ours, figure), task_means(theirs, figure)
        found[name] = (mean_of(mine) or 0.0) - (mean_of(other) or 0.0)
        found["ci95"][name] = share_difference_interval(mine, other)
    for name, figure in MEANS.items():
        less = paired_differences(ours, theirs, figure)
        found[name], found["ci95"][name] = mean_of(less), mean_interval(less)
    return found


def figures(outcomes: Mapping[int, Sequence[Outcome]]) -> dict[str, Any]:
    """All figures of one planner from its outcomes by task, with intervals."""
    shares = {name: task_means(outcomes, figure) for name, figure in SHARES.items()}
    means = {name: task_means(outcomes, figure) for name, figure in MEANS.items()}
    return {
        **{name: mean_of(values) for name, values in {**shares, **means}.items()},
        "ci95": {
            **{name: share_interval(values) for name, values in shares.items()},
            **{name: mean_interval(values) for name, values in means.items()},
        },
        # The plain bootstrap beside it: of 30 tasks it covers too little where nearly all succeed.
        "ci95_bootstrap": {name: mean_interval(values) for name, values in shares.items()},
    }


def by_task(
    done: Mapping[Unit, Done], planner: str, only: Mapping[int, Sequence[int]] | None = None
) -> dict[int, list[Outcome]]:
    """Outcomes of one planner by task, in the order of the units.

    Args:
        done: All units.
        planner: Its name.
        only: Numbers of the conditions that count, by task; none: all do.
    """
    found: dict[int, list[Outcome]] = {}
    for unit, result in done.items():
        if unit.planner != planner:
            continue
        chosen = range(len(result.outcomes)) if only is None else only.get(unit.task, ())
        if chosen:
            found.setdefault(unit.task, []).extend(result.outcomes[i] for i in chosen)
    return found


def summarise(plan: Plan, done: Mapping[Unit, Done]) -> dict[str, Any]:
    """The content of ``results.json``: equal for equal plans, whoever did the work, and when."""
    drawn = [task_conditions(plan.split, number) for number in plan.tasks]
    used = {found.task.number: found.conditions[: plan.conditions] for found in drawn}
    hard: dict[str, dict[int, list[int]]] = {
        "ambiguous": {t: [c.number for c in cs if c.task.ambiguous] for t, cs in used.items()},
        "person_must_move": {
            t: [c.number for c in cs if c.staying_clearance > 0.0] for t, cs in used.items()
        },
    }
    planners = {}
    for setup in plan.planners:
        planners[setup.name] = {**figures(by_task(done, setup.name)), "text": setup.text}
        for kind, only in hard.items():
            some = by_task(done, setup.name, only)
            planners[setup.name][kind] = figures(some) if some else None
        if plan.execution != PAPER:
            found = by_task(done, setup.name).values()
            errors = [outcome.tracking_error for outcomes in found for outcome in outcomes]
            planners[setup.name]["tracking_error_rad"] = max(errors)
    first, *others = [by_task(done, setup.name) for setup in plan.planners]
    names = [setup.name for setup in plan.planners]
    feasible = task_means(by_task(done, ORACLE), SHARES["ok"])
    count = sum(map(len, used.values()))
    return {
        "split": plan.split,
        "budget": plan.slowdown,
        "seeds": list(plan.seeds),
        "variation": plan.variation.text,
        "execution": plan.execution,
        "tasks": len(plan.tasks),
        "conditions": count,
        "shares": {kind: sum(map(len, only.values())) / count for kind, only in hard.items()},
        "clusters": {kind: sum(map(bool, only.values())) for kind, only in hard.items()},
        "planners": planners,
        "differences": {
            f"{names[0]} - {name}": compare(first, other)
            for name, other in zip(names[1:], others, strict=True)
        },
        "oracle_feasible": mean_of(feasible),
        "trained_for_another_planner": trained_for_another(
            [setup.adaptation for setup in plan.planners if setup.adaptation is not None]
        ),
        "generator": _generator(
            sum((found.drawn for found in drawn), Counter()),
            sum((found.rejected for found in drawn), Counter()),
        ),
    }


def _generator(drawn: Counter[str], rejected: Counter[str]) -> dict[str, Any]:
    """How many tasks and conditions were drawn, and what each rule turned down."""
    return {
        "tasks_drawn": drawn["tasks"],
        "tasks_rejected": {rule: rejected[rule] for rule in TASK_RULES},
        "conditions_drawn": drawn["conditions"],
        "conditions_rejected": {rule: rejected[rule] for rule in CONDITION_RULES},
    }
