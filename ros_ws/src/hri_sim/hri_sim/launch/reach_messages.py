"""What is sent at the begin of a reach: the cue to the person, the goal to the robot."""

from __future__ import annotations

from collections.abc import Sequence

from hri_prediction.ros.conversions import WORLD
from hri_prediction.ros.messages import Cue, ReachTarget
from hri_prediction.ros.time import to_time
from hri_sim.scenario.schema import ReachSpec


def cue_message(number: int, reach: ReachSpec, cue_ns: int) -> Cue:
    """The cue of a reach that begins at a time [ns]; ``number`` tells it from others."""
    cue = Cue(reach=number, delay=reach.person_delay, duration=reach.person_duration)
    cue.header.stamp = to_time(cue_ns)
    cue.header.frame_id = WORLD
    cue.person_target = reach.person_target or ""
    return cue


def goal_message(target: str, place: Sequence[float], duration_s: float) -> ReachTarget.Goal:
    """A goal by its name, if it has one, and its place (3) [m]."""
    goal = ReachTarget.Goal(target=target, duration=duration_s)
    goal.pose.header.frame_id = WORLD
    position = goal.pose.pose.position
    position.x, position.y, position.z = place
    return goal
