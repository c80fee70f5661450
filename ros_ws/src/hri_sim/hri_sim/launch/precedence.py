"""Which nodes yield when there is more to do than the processors can.

The simulator and the people stand for a robot and for motion capture, which would not wait for this
machine; what they do late, all others get late. Next are those that must keep pace with what comes.
Planning uses the time there is: a plan that was less improved is still a plan. Where there are processors
enough, nobody yields.

The separation monitor, which needs little and is to stop the robot in time, has a real-time priority where
the system permits it. Simulator and people with one, too, took the processors from predictor and planner.
"""

from __future__ import annotations

from hri_prediction.ros.scheduling import HIGHEST

NICENESS = {
    "simulator": 0,
    "person": 0,
    "observer": 0,
    "dyad": 0,
    "replayer": 0,
    "mocap_live": 0,
    "separation_monitor": 0,
    "predictor": 2,
    "recorder": 2,
}
"""Niceness of node processes above that of who launches them, by executable."""
OTHERS = 4
"""That of all others: planners, policies, adaptation, and who says what case of interaction it is."""
REALTIME = {"separation_monitor": HIGHEST}
"""Real-time priorities (SCHED_FIFO), by executable."""


def urgency(executable: str) -> dict[str, int]:
    """The parameter that gives a node its real-time priority; none where it has none."""
    priority = REALTIME.get(executable)
    return {} if priority is None else {"realtime_priority": priority}


def niceness(executable: str) -> int:
    """How much nicer than who launches it a node is."""
    return NICENESS.get(executable, OTHERS)
