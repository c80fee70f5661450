"""How a plan is described on the status topic, and timings on /diagnostics."""

from __future__ import annotations

from collections.abc import Iterable

from hri_planner.ptomp.result import ReplanResult
from hri_planner.ros.inputs import NOBODY
from hri_prediction.ros.messages import PlannerStatus
from hri_prediction.ros.time import to_time


def describe_plan(
    message: PlannerStatus,
    result: ReplanResult,
    *,
    due_ns: int,
    due_s: float,
    newest_sample_ns: int,
) -> None:
    """Fill in what a status says of a plan.

    Args:
        message: Gets the fields.
        result: The plan and how it came about.
        due_ns: When its first point is due, ROS time [ns].
        due_s: When it was planned to be due, plan clock [s].
        newest_sample_ns: Newest human sample that it used [ns].
    """
    message.handover = to_time(due_ns)
    message.newest_sample = to_time(newest_sample_ns)
    message.iterations = result.iterations
    message.feasible = result.feasible
    message.cost_names = list(result.cost_terms)
    message.costs = list(result.cost_terms.values())
    message.predicted_clearance = min(result.predicted_clearance_m, NOBODY)
    if result.predicted_first_contact_s is not None:
        message.first_contact = result.predicted_first_contact_s - due_s


def percentile_figures(name: str, values: Iterable[float]) -> dict[str, str]:
    """Median and 99th percentile as figures for /diagnostics; nothing of no values."""
    ordered = sorted(values)
    if not ordered:
        return {}
    return {
        f"{name}_p50": f"{ordered[len(ordered) // 2]:.2f}",
        f"{name}_p99": f"{ordered[int(len(ordered) * 0.99)]:.2f}",
    }
