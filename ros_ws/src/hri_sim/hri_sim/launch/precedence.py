"""Which nodes yield when there is more to do than the processors can.

The simulator and the people stand for a robot and for motion capture, which would not wait for this
machine; what they do late, all others get late. Next are those that must keep pace with what comes.
Planning uses the time there is: a plan that was less improved is still a plan. Where there are processors
enough, nobody yields.
"""

from __future__ import annotations

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


def niceness(executable: str) -> int:
    """How much nicer than who launches it a node is."""
    return NICENESS.get(executable, OTHERS)
