"""What is said of the plan that a replan has come to."""

from __future__ import annotations

import numpy as np

from hri_planner.ptomp.costs import CostModel
from hri_planner.ptomp.layout import TERMS
from hri_planner.ptomp.motion import Grid, Motion
from hri_planner.ptomp.plan import JointPlan
from hri_planner.ptomp.result import ReplanResult
from hri_planner.robot.model import RobotModel

LATE_S = 0.05
"""From which delay on a plan counts as late [s]."""


def keeps_limits(robot: RobotModel, plan: JointPlan) -> bool:
    """Whether a plan stays within joint and speed limits, but for the speed that it begins with."""
    times = np.linspace(plan.start_s, plan.end_s, 2 * len(plan.time_s))
    q, qd, _ = plan.sample(times)
    fast = np.abs(qd) > np.maximum(robot.velocity, np.abs(plan.qd[0]) + 1e-6)
    return bool(robot.within_limits(q, 1e-9) and not fast.any())


def conclude(
    costs: CostModel,
    motion: Motion,
    plan: JointPlan,
    grid: Grid,
    *,
    nominal_end_s: float,
    slows: bool,
    goal_error: float,
    iterations: int,
) -> ReplanResult:
    """The result of a replan: where the plan leads, how near to people, and why it is as it is.

    Args:
        costs: Cost model, bound to the replan's grid.
        motion: The motion that was chosen.
        plan: The plan made of it.
        grid: Its grid.
        nominal_end_s: When the robot was to arrive, plan clock [s].
        slows: Whether the planner slows down for people; otherwise it is late for another reason.
        goal_error: Distance of the tool from the goal at the end of the plan [m].
        iterations: Optimisation steps done.
    """
    arrives = motion.arrival is not None
    at_goal = arrives and motion.arrival == 0
    columns = motion.columns(grid)
    _, terms, nearest = costs.evaluate(columns[None])
    clearance = float(nearest[0])
    contact_s = None
    if clearance < 0.0:
        touching = costs.clearances(columns[None])[0, 2:] < 0.0
        contact_s = grid.start_s + int(np.argmax(touching)) * grid.step
    late = plan.end_s - nominal_end_s if arrives and not at_goal else 0.0
    reason = ""
    if contact_s is not None:
        reason = f"the forecast touches the plan in {contact_s - grid.start_s:.2f} s"
    elif not arrives:
        reason = "no safe way to the goal now: keeping clear of the person"
    elif late > LATE_S:
        reason = f"{'slowed for the person: ' if slows else ''}arrival {late:.2f} s late"
    return ReplanResult(
        plan=plan,
        stage="holding" if at_goal else ("reaching" if arrives else "waiting"),
        feasible=clearance >= 0.0,
        reason=reason,
        iterations=iterations,
        cost_terms=dict(zip(TERMS, map(float, terms[0]), strict=True)),
        predicted_clearance_m=clearance if clearance < 100.0 else float("inf"),
        predicted_first_contact_s=contact_s,
        goal_error_m=goal_error,
    )
