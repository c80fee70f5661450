"""What became of every condition in which the planner failed."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from hri_sim.benchmark.outcome import GOAL_M, SPEED_SHARE, Outcome
from hri_sim.benchmark.planners import PLANNERS
from hri_sim.benchmark.report import markdown_table
from hri_sim.reproduction.bars import OURS
from hri_sim.reproduction.closer import Item, Look
from hri_sim.reproduction.section import Measured

CAUSES = {
    "contact": "contact on the way",
    "lost": "not arrived in time",
    "held": "arrived, then contact while it held the goal",
    "drifted": "arrived, then left the goal",
    "fast": "faster than the limits",
    "table": "touched the table",
}
"""In the order in which they are looked for: the first is what a failure is counted as."""
LISTED = 25
"""Failures that the report lists, the deepest contacts first."""


@dataclass(frozen=True)
class Failure:
    """A condition that is no strict success.

    Attributes:
        item: Which.
        seen: What happened.
    """

    item: Item
    seen: Look

    @property
    def cause(self) -> str:
        """One of `CAUSES`."""
        return cause_of(self.seen.outcome)

    def figures(self) -> dict[str, Any]:
        """As in ``ptomp.json``."""
        condition, outcome = self.item.find(), self.seen.outcome
        reach = condition.scenario.reaches[0]
        return {
            "slowdown": self.item.slowdown,
            "task": self.item.task,
            "condition": self.item.condition,
            "seed": self.item.seed,
            "ambiguous": condition.task.ambiguous,
            "person_must_move": condition.staying_clearance > 0.0,
            "cause": self.cause,
            "clearance_m": outcome.clearance,
            "closest_s": self.seen.closest_s,
            "contact_s": self.seen.contact_s,
            "robot_standing": self.seen.standing,
            "robot_part": self.seen.part,
            "limb": self.seen.limb,
            "person_begins_s": reach.person_delay,
            "person_ends_s": reach.person_delay + reach.person_duration,
            "hold_clearance_m": outcome.hold_clearance,
            "hold_error_m": outcome.hold_error,
            "time_to_goal_s": outcome.time_to_goal,
            "goal_error_m": outcome.goal_error,
            "speed_share": outcome.speed_share,
            "table_clearance_m": outcome.table_clearance,
        }


def cause_of(outcome: Outcome) -> str:
    """Why an outcome is no strict success; the first of `CAUSES` that holds."""
    assert not outcome.strict
    holds = {
        "contact": outcome.clearance <= 0.0,
        "lost": outcome.time_to_goal is None,
        "held": outcome.hold_clearance is not None and outcome.hold_clearance <= 0.0,
        "drifted": outcome.hold_error is not None and outcome.hold_error > GOAL_M,
        "fast": outcome.speed_share > SPEED_SHARE,
        "table": outcome.table_clearance <= 0.0,
    }
    return next(cause for cause in CAUSES if holds[cause])


def failed_items(measured: Measured) -> list[Item]:
    """The conditions in which ours was no strict success."""
    plan = measured.plan
    return [
        Item(PLANNERS[OURS], plan.split, unit.task, number, plan.slowdown, unit.seed)
        for unit, result in measured.done.items()
        if unit.planner == OURS
        for number, outcome in enumerate(result.outcomes)
        if not outcome.strict
    ]


def worst_item(measured: Measured) -> tuple[Item, float]:
    """The condition in which ours had the smallest clearance [m], whether it failed or not."""
    plan = measured.plan
    clearance, unit, number = min(
        (
            (outcome.clearance, unit, number)
            for unit, result in measured.done.items()
            if unit.planner == OURS
            for number, outcome in enumerate(result.outcomes)
        ),
        key=lambda found: found[0],
    )
    item = Item(PLANNERS[OURS], plan.split, unit.task, number, plan.slowdown, unit.seed)
    return item, clearance


def lines(failures: Sequence[Mapping[str, Any]], of: int, slowdown: float) -> list[str]:
    """How many failed of how many on one machine, by cause, and the worst of them one by one.

    Args:
        failures: On all machines, see :meth:`Failure.figures`.
        of: Motions on this one.
        slowdown: F of it.
    """
    failures = [found for found in failures if found["slowdown"] == slowdown]
    if not failures:
        return [f"F = {slowdown:g}: none of {of} motions failed.\n"]
    rows = []
    for cause, text in CAUSES.items():
        some = [found for found in failures if found["cause"] == cause]
        counts = [
            len(some),
            sum(found["ambiguous"] for found in some),
            sum(found["person_must_move"] for found in some),
            sum(found["robot_standing"] for found in some),
            len({(found["task"], found["condition"]) for found in some}),
        ]
        if some:
            rows.append([text, *map(str, counts)])
    head = ["cause", "motions", "ambiguous", "person must move", "robot at rest", "conditions"]
    listed = sorted(failures, key=lambda found: found["clearance_m"])[:LISTED]
    parts = [
        f"{len(failures)} of {of} motions of `{OURS}` are no strict success (F = {slowdown:g}, all seeds). "
        "Robot at rest: when they touched, or were nearest. Conditions: different ones, whatever the "
        "seed.\n",
        markdown_table(head, rows),
        _where(failures),
        "All of them:\n"
        if len(listed) == len(failures)
        else f"The {len(listed)} with the smallest clearance:\n",
        markdown_table(
            [
                "task / condition / seed",
                "ambiguous",
                "person moves [s]",
                "what happened",
                "clearance [mm]",
            ],
            [_row(found) for found in listed],
        ),
    ]
    return parts


def _where(failures: Sequence[Mapping[str, Any]]) -> str:
    """In which tasks, and with what and when there was contact."""
    tasks = Counter(found["task"] for found in failures)
    text = ", ".join(f"{task} ({count})" for task, count in tasks.most_common())
    parts = [f"Tasks (motions): {text}."]
    touched = [found for found in failures if found["cause"] == "contact"]
    if touched:
        pairs = Counter(f"{found['robot_part']} and {found['limb']}" for found in touched)
        met = ", ".join(f"{pair} ({count})" for pair, count in pairs.most_common())
        times = [found["contact_s"] for found in touched]
        moving = sum(f["person_begins_s"] <= f["contact_s"] <= f["person_ends_s"] for f in touched)
        parts.append(
            f"Contact of robot and person (motions): {met}; {min(times):.2f} to {max(times):.2f} s after "
            f"the start, in {moving} of {len(touched)} while the person moved."
        )
    return " ".join(parts) + "\n"


def _row(found: Mapping[str, Any]) -> list[str]:
    return [
        f"{found['task']} / {found['condition']} / {found['seed']}",
        "yes" if found["ambiguous"] else "no",
        f"{found['person_begins_s']:.2f}–{found['person_ends_s']:.2f}",
        _words(found),
        f"{1e3 * found['clearance_m']:.0f}",
    ]


def _words(found: Mapping[str, Any]) -> str:
    where = f"{found['robot_part']} and {found['limb']}"
    state = "at rest" if found["robot_standing"] else "moving"
    match found["cause"]:
        case "contact":
            return f"contact of {where} at {found['contact_s']:.2f} s, robot {state}"
        case "lost":
            return f"not arrived, tool {1e3 * found['goal_error_m']:.0f} mm from the goal"
        case "held":
            depth = 1e3 * found["hold_clearance_m"]
            return f"arrived at {found['time_to_goal_s']:.2f} s, then contact ({depth:.0f} mm)"
        case "fast":
            return f"{100.0 * found['speed_share']:.0f} % of the speed limits"
        case "table":
            return f"table touched by {-1e3 * found['table_clearance_m']:.0f} mm"
        case "drifted":
            return f"arrived, then {1e3 * found['hold_error_m']:.0f} mm off the goal"
        case cause:
            return CAUSES[cause]
