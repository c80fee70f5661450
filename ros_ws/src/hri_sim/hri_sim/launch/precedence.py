"""Which nodes yield when there is more to do than the processors can.

The simulator and the people stand for a robot and for motion capture, which would not wait for this
machine; what they do late, all others get late. Next are those that must keep pace with what comes.
Planning uses the time there is: a plan that was less improved is still a plan. Where there are processors
enough, nobody yields.
"""

from __future__ import annotations

import contextlib
import os

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
_NICEST = 19


def yield_to_others(executable: str, pid: int) -> None:
    """Give a process that has just been started its place.

    Args:
        executable: Which node it is.
        pid: Its process, of one thread as yet: on Linux each thread has a niceness, given by who starts it.
    """
    own = os.getpriority(os.PRIO_PROCESS, 0)
    with contextlib.suppress(ProcessLookupError):  # it has ended already, which is told elsewhere
        os.setpriority(os.PRIO_PROCESS, pid, min(own + NICENESS.get(executable, OTHERS), _NICEST))
