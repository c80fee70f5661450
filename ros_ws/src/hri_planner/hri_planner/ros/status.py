"""What the status topic, the action's result and /diagnostics say of plans and motions."""

from __future__ import annotations

from collections.abc import Iterable

from std_msgs.msg import Header

from hri_planner.ptomp.result import ReplanResult
from hri_planner.ptomp.situation import Situation
from hri_planner.ros.inputs import NOBODY
from hri_planner.supervision.decision import Ending, Report
from hri_prediction.ros.conversions import WORLD
from hri_prediction.ros.messages import ControllerState, PlannerStatus, ReachTarget
from hri_prediction.ros.time import to_time


def status_message(
    now_ns: int,
    report: Report,
    *,
    situation: Situation,
    distance: float,
    reference: ControllerState | None,
) -> PlannerStatus:
    """Status without a plan; :func:`describe_plan` adds one.

    Args:
        now_ns: Its stamp [ns].
        report: What there is to say.
        situation: How hard it is.
        distance: Of the tool to the goal [m]; 0 without one.
        reference: What the controller said last.
    """
    return PlannerStatus(
        header=Header(stamp=to_time(now_ns), frame_id=WORLD),
        stage=int(report.stage),
        reason=report.reason,
        motion=report.number,
        replan=report.replans,
        deadline_misses=report.misses,
        clearance=min(situation.distance, NOBODY),
        distance_to_goal=distance,
        speed_scale=report.speed_scale,
        handover_jump=0.0 if reference is None else reference.max_handover_jump,
        predicted_clearance=NOBODY,
        first_contact=-1.0,
        prediction_uncertainty=situation.uncertainty,
        prediction_error=situation.error,
        time_to_collision=situation.time_to_collision,
        collision_cost=situation.collision_cost,
    )


def result_message(ending: Ending, goal_error: float) -> ReachTarget.Result:
    """Result of a motion that has ended with the tool so far from its goal [m]."""
    return ReachTarget.Result(
        outcome=int(ending.outcome),
        reason=ending.reason,
        duration=ending.duration_s,
        min_separation=min(ending.min_separation, NOBODY),
        goal_error=goal_error,
        replans=ending.replans,
        cost_names=list(ending.costs),
        costs=list(ending.costs.values()),
    )


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
