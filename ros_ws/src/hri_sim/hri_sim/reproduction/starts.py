"""How late each planner sets off, and what is left of the test by then."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache

from hri_sim.benchmark.conditions import task_conditions
from hri_sim.benchmark.late_start import start_delay, still_collides
from hri_sim.benchmark.report import markdown_table, share_text
from hri_sim.benchmark.run import Plan


def starts(plan: Plan) -> dict[str, dict[str, float]]:
    """By planner: its delay [s] and the share of conditions that collide if begun so late."""
    found = {}
    for setup in plan.planners:
        delay_s = start_delay(setup, plan.slowdown)
        share = _share(plan.split, plan.tasks, plan.conditions, round(delay_s, 6))
        found[setup.name] = {"delay_s": delay_s, "still_collides": share}
    return found


@lru_cache(maxsize=64)
def _share(split: str, tasks: tuple[int, ...], count: int, delay_s: float) -> float:
    """Share of conditions in which the nominal motion, begun so late, still collides."""
    drawn = [c for task in tasks for c in task_conditions(split, task).conditions[:count]]
    return sum(still_collides(condition, delay_s) for condition in drawn) / len(drawn)


def table(found: Mapping[str, Mapping[str, float]]) -> str:
    """Both figures of each planner."""
    rows = [
        [f"`{name}`", f"{said['delay_s']:.2f}", share_text(said["still_collides"], None)]
        for name, said in found.items()
    ]
    head = ["planner", "robot sets off after [s]", "nominal motion begun then still collides"]
    return markdown_table(head, rows)
