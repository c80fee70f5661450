"""What a replan looks at: the margin in force, and the times from the hand-over on."""

from __future__ import annotations

import numpy as np

from hri_planner.ptomp.config import PtompConfig
from hri_planner.ptomp.layout import MAX_COLUMNS
from hri_planner.ptomp.motion import Grid
from hri_planner.ptomp.plan import JointPlan

_OVERDUE_GRACE_S = 0.3


def margin_in_force(config: PtompConfig, overdue_s: float) -> tuple[float, float, float]:
    """The margin [m], kappa and growth [m/s] in force: full while on time, shrinking while overdue.

    A person who rests near the goal gets ever wider forecasts, or margins, with time ahead; with full
    ones the robot would wait for ever where a careful way exists.

    Args:
        config: Of the planner.
        overdue_s: Time since the robot was to arrive [s]; negative before.
    """
    share = min(max((overdue_s - _OVERDUE_GRACE_S) / config.margin_patience, 0.0), 1.0)
    return (
        config.margin + share * (config.margin_min - config.margin),
        config.kappa + share * (config.kappa_min - config.kappa),
        (1.0 - share) * config.margin_growth,
    )


def replan_grid(plan: JointPlan, start_s: float, time_step: float, horizon_s: float) -> Grid:
    """The grid of a replan; where the plan still goes on, its end falls on a knot.

    Args:
        plan: The present plan, which says the state at the hand-over.
        start_s: Hand-over, plan clock [s].
        time_step: Wanted spacing [s]; wider where the horizon would have too many columns.
        horizon_s: How far ahead is looked [s].
    """
    nominal = max(time_step, horizon_s / (MAX_COLUMNS - 8))
    remaining = max(plan.end_s - start_s, 0.0)
    steps = round(remaining / nominal)
    step = remaining / steps if steps > 0 else nominal
    knots = int(np.ceil(horizon_s / step)) + 1
    state = plan.sample(start_s)
    before = start_s - step * np.array([2.0, 1.0])
    past = plan.sample(before)[0]
    early = before < plan.start_s
    q0, v0 = plan.q[0], plan.qd[0]
    past[early] = q0 + (before[early, None] - plan.start_s) * v0
    return Grid(start_s, step, knots, state, past)
