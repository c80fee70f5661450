"""Node processes of this machine that a signal has stopped: the graph forgets them; they may wake up."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import psutil

from hri_sim.tools.discovery import domain

PACKAGES = ("hri_prediction", "hri_planner", "hri_sim")


@dataclass(frozen=True)
class StoppedNode:
    """One of them.

    Attributes:
        name: Of its executable, which is the node's unless it was renamed.
        pid: Its process.
    """

    name: str
    pid: int


def node_of(command: Sequence[str]) -> str:
    """The node that a command line runs; empty when it runs none of these packages."""
    for word in command[:2]:  # the interpreter, and what it runs
        path = Path(word)
        if path.parent.name in PACKAGES and path.parent.parent.name == "lib":
            return path.name
    return ""


def is_stopped(process: psutil.Process) -> bool:
    """Whether a process is stopped by a signal, or by a debugger.

    Raises:
        psutil.Error: it has ended, or is not to be looked at.
    """
    return str(process.status()) in (psutil.STATUS_STOPPED, psutil.STATUS_TRACING_STOP)


def stopped_nodes(environment: Mapping[str, str]) -> list[StoppedNode]:
    """Nodes of this user's, or of whom this user may look at, in the ROS domain of an environment."""
    return _stopped(psutil.process_iter(), domain(environment))


def _stopped(processes: Iterable[psutil.Process], of_domain: str) -> list[StoppedNode]:
    found = []
    for process in processes:
        try:
            if not is_stopped(process):
                continue
            name = node_of(process.cmdline())
            if name and domain(process.environ()) == of_domain:
                found.append(StoppedNode(name, process.pid))
        except psutil.Error:  # it has ended, or is somebody else's
            continue
    return found
