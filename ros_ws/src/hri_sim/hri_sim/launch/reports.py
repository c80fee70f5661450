"""How the reaches of a conducted scenario went, as the conductor saw it live."""

from __future__ import annotations

from dataclasses import dataclass

from hri_prediction.ros.messages import PlannerStatus, PolicyStatus, ReachTarget

OUTCOMES = {
    ReachTarget.Result.REACHED: "reached",
    ReachTarget.Result.CANCELLED: "cancelled",
    ReachTarget.Result.UNREACHABLE: "unreachable",
    ReachTarget.Result.BLOCKED: "blocked",
    ReachTarget.Result.LOST_INPUT: "lost_input",
    ReachTarget.Result.REJECTED: "rejected",
    ReachTarget.Result.PREEMPTED: "preempted",
    ReachTarget.Result.FAILED: "failed",
}
INTERRUPTED = "interrupted"
"""Outcome of a reach, and of a run, that was broken off."""


@dataclass(frozen=True)
class ReachReport:
    """How one reach went.

    Attributes:
        index: Number of the reach in the scenario.
        target: Name of the robot's target.
        outcome: One of :data:`OUTCOMES`, or :data:`INTERRUPTED`.
        reason: In plain words.
        cue_ns: When the reach began, on the ROS clock [ns].
        end_ns: When its result came [ns].
        over_ns: When the person was through as well [ns].
        duration_s: From acceptance of the goal to its end [s].
        replans: Plans that took effect.
        min_clearance_m: Smallest true clearance that was heard from the cue to the next one, the
            rest included [m]; none when nobody was there. Samples may have been missed: a bag
            knows better.
        goal: Where the goal was in the end, if it had moved [m].
    """

    index: int
    target: str
    outcome: str
    reason: str
    cue_ns: int
    end_ns: int
    over_ns: int
    duration_s: float
    replans: int
    min_clearance_m: float | None = None
    goal: tuple[float, float, float] | None = None


def plans_of(status: PlannerStatus | PolicyStatus) -> int:
    """Plans of the present motion so far."""
    return int(status.cycle if isinstance(status, PolicyStatus) else status.replan)
