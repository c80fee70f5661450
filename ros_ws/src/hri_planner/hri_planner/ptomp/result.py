"""What a replan decided."""

from __future__ import annotations

from dataclasses import dataclass

from hri_planner.ptomp.plan import JointPlan


@dataclass(frozen=True)
class ReplanResult:
    """What a replan decided.

    Attributes:
        plan: Takes effect at the hand-over, starts at the state the old plan has there.
        stage: reaching, waiting (resting or evading away from the goal) or holding (at the goal).
        feasible: Whether the forecast's mean is nowhere touched. Limits are kept in any case.
        reason: Why the robot is late, waits or is infeasible; empty when all is well.
        iterations: Optimisation steps done.
        cost_terms: Weighted terms of the plan's cost by name.
        predicted_clearance_m: Smallest clearance to the forecast's mean; infinite without people.
        predicted_first_contact_s: First plan-clock time at which the forecast touches the plan.
        goal_error_m: Distance of the tool from the goal at the end of the plan.
    """

    plan: JointPlan
    stage: str
    feasible: bool
    reason: str
    iterations: int
    cost_terms: dict[str, float]
    predicted_clearance_m: float
    predicted_first_contact_s: float | None
    goal_error_m: float
