"""Real-time priority of a node's process, as controllers and drivers of robots have it.

What must answer within milliseconds waits for nobody then but who is more urgent; with shares of the
processors, however large, it waits for others to use up theirs. ros2_control's controller manager asks for
SCHED_FIFO, too, with priority 50 (its user documentation, "Determinism").
"""

from __future__ import annotations

import contextlib
import os
from dataclasses import dataclass
from pathlib import Path

from hri_prediction.config import parameter
from hri_prediction.results.origin import available_cores

HIGHEST = 12
"""The highest that nodes are given here. Where the limit is below, nobody has any: their order counts."""
SHARED = "shared"
"""What is said of a process that has its share of the processors, by its niceness."""


@dataclass(frozen=True)
class SchedulingConfig:
    """How the process of a node gets the processors."""

    realtime_priority: int = parameter(
        0,
        "Real-time priority (SCHED_FIFO) of all threads of the node's process and of what it starts, where "
        "the system permits it and has more than one processor: one that computes all the time takes a "
        "processor from all that have none; 0: it shares the processors",
        low=0,
        high=49,
    )


def take_precedence(priority: int) -> str:
    """Give all threads of this process a real-time priority; threads that they start later have it too.

    Args:
        priority: Of SCHED_FIFO; 0: nothing is changed.

    Returns:
        What the process has now, in words: where the system does not permit it, it goes on as before.
    """
    if priority == 0:
        return _present()
    if available_cores() < 2:  # a node that spins would leave nothing to anybody
        return f"{_present()}: real-time priority {priority} needs more than one processor"
    most = max(priority, HIGHEST)
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(most))
        for task in Path("/proc/self/task").iterdir():
            with contextlib.suppress(ProcessLookupError):  # it has just ended
                os.sched_setscheduler(int(task.name), os.SCHED_FIFO, os.sched_param(priority))
    except PermissionError:
        text = f"real-time priority {priority} is not permitted (ulimit -r is below {most})"
        return f"{_present()}: {text}"
    except OSError as error:
        return f"{_present()}: real-time priority {priority} failed ({error})"
    return _present()


def share_processors() -> None:
    """Give back a real-time priority that this process has from who started it; its niceness stays."""
    if os.sched_getscheduler(0) in (os.SCHED_FIFO, os.SCHED_RR):
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))


def _present() -> str:
    name = {os.SCHED_FIFO: "SCHED_FIFO", os.SCHED_RR: "SCHED_RR"}.get(os.sched_getscheduler(0))
    return f"{name} {os.sched_getparam(0).sched_priority}" if name else SHARED
