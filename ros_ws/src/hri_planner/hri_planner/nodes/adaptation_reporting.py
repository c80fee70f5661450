"""What the adaptation node says of itself."""

from __future__ import annotations

from std_msgs.msg import Header

from hri_planner.pibb.costs import TERM_NAMES
from hri_planner.pibb.session import Session
from hri_planner.ros.inputs import NOBODY
from hri_prediction.ros.conversions import WORLD
from hri_prediction.ros.messages import AdaptationStatus
from hri_prediction.ros.time import to_time

STAGES = ("idle", "returning", "ready", "moving", "answering", "over", "stopped")
"""Of :class:`AdaptationStatus`, in words."""


def status_of(
    session: Session,
    *,
    now_ns: int,
    stage: int,
    reason: str,
    person: str,
    aborted: int,
    between: float,
) -> AdaptationStatus:
    """The status at a time [ns]; the goal of the present trial is not in it: people could read it."""
    state, plan = session.state, session.experiment.improvement
    trial = session.next_trial()
    message = AdaptationStatus(
        header=Header(stamp=to_time(now_ns), frame_id=WORLD),
        stage=stage,
        reason=reason,
        experiment=session.experiment.name,
        person=person,
        trial=len(state.results),
        trials=session.trials,
        update=min(state.update, plan.updates - 1),
        updates=plan.updates,
        sample=0 if trial is None else trial.sample,
        aborted=aborted,
        last_trial=-1,
        last_clearance=NOBODY,
        between_clearance=between,
    )
    if state.results:
        last = state.results[-1]
        message.last_trial, message.last_goal = last.trial.number, last.trial.goal
        message.last_guess, message.last_cost = last.guess, last.cost
        message.term_names = list(TERM_NAMES)
        message.terms = [float(getattr(last.terms, name)) for name in TERM_NAMES]
        message.last_clearance = last.clearance
    return message
