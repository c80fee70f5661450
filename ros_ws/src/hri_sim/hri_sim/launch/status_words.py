"""The live line about a reach that is under way."""

from __future__ import annotations

from hri_prediction.ros.messages import PlannerStatus, PolicyStatus, SimState
from hri_sim.launch.reports import plans_of

FAR_M = 1e8
"""Clearances beyond this mean that nobody is there [m]."""
STAGES = ("idle", "moving", "waiting", "stopping", "holding")


def status_words(
    title: str,
    status: PlannerStatus | PolicyStatus | None,
    state: SimState | None,
    closest_m: float,
) -> str:
    """How a reach goes, in one line.

    Args:
        title: Which it is.
        status: What the node that moves the robot says; none: nothing yet.
        state: What the simulator says.
        closest_m: Smallest clearance of the reach so far [m].
    """
    words = [title]
    if status is not None:
        words.append(STAGES[min(status.stage, len(STAGES) - 1)])
        words.append(f"{status.distance_to_goal * 100:5.1f} cm to go")
        words.append(f"plans {plans_of(status)}")
    if state is not None and state.clearance < FAR_M:
        least = f" (least {closest_m * 100:.1f})" if closest_m < FAR_M else ""
        words.append(f"clear {state.clearance * 100:5.1f} cm{least}")
    if status is not None and status.reason:
        words.append(status.reason)
    return " · ".join(words)
