"""The scenes of the pictures, by rules that are stated beside them."""

from __future__ import annotations

from collections.abc import Iterator

from hri_sim.benchmark.conditions import Condition, task_conditions
from hri_sim.benchmark.run import Plan
from hri_sim.reproduction.bars import ITOMP, OURS
from hri_sim.reproduction.section import SPLIT, Measured

STAYING_CLEAR_M = 0.03
FIRST_MOVING = (
    "the first test condition in which only the movement of the person makes the nominal motion collide "
    f"(by {100.0 * STAYING_CLEAR_M:g} cm and more clear if the hand stayed), with a single target"
)


def in_order(plan: Plan) -> Iterator[Condition]:
    """The conditions of a plan, the first of each task, then the second, and so on."""
    for number in range(plan.conditions):
        for task in plan.tasks:
            yield task_conditions(plan.split, task).conditions[number]


def first_moving() -> Condition:
    """The scene of `FIRST_MOVING`."""
    task = 0
    while True:
        for condition in task_conditions(SPLIT, task).conditions:
            if condition.staying_clearance >= STAYING_CLEAR_M and not condition.task.ambiguous:
                return condition
        task += 1


def compared(measured: Measured) -> tuple[Condition, str]:
    """A scene in which prediction makes the difference, and the rule that chose it.

    The first in which ours is a strict success and the opponent is not even ok; the very first
    where there is none.
    """
    seed = measured.plan.seeds[0]
    found = {
        (unit.planner, unit.task): result.outcomes
        for unit, result in measured.done.items()
        if unit.seed == seed
    }
    wins, losses = [], 0
    conditions = list(in_order(measured.plan))
    for condition in conditions:
        ours = found[OURS, condition.task.number][condition.number]
        theirs = found[ITOMP, condition.task.number][condition.number]
        if ours.strict and not theirs.ok:
            wins.append(condition)
        losses += theirs.strict and not ours.ok
    balance = (
        f"{len(wins)} of {len(conditions)} conditions are such (seed {seed}, F = 1), {losses} are the "
        "other way round"
    )
    if not wins:
        return conditions[0], f"the first condition; none is won against `{ITOMP}`: {balance}"
    return wins[0], (
        f"the first condition (of each task in turn) in which `{OURS}` is a strict success and "
        f"`{ITOMP}` is not ok; {balance}"
    )
