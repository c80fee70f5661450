"""Node processes that a signal has stopped: they have not died, and answer nobody."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import psutil

from hri_sim.health.processes import is_stopped
from hri_sim.launch.health import SILENT

LOOK_S = 0.2
"""Time from one look at the processes to the next [s]."""
TOLD_S = 0.5
"""One that is stopped for so long is told of [s]; what is shorter, its neighbours get over."""
_RESTS = "and the robot rests because of it"
MEANINGS = {
    "ptomp": f"no plan comes, {_RESTS}",
    "policy": f"no motion is sent, {_RESTS}",
    "predictor": f"no prediction comes, {_RESTS}",
    "separation_monitor": f"its heartbeat has stopped, {_RESTS}",
    **dict.fromkeys(
        ("person", "replayer", "mocap_live", "dyad"), f"nothing is seen of people, {_RESTS}"
    ),
    "observer": "nobody says what the person reads",
    "simulator": "the simulated robot and its controller stand still",
    **SILENT,
}
"""What comes of it when a node does not answer."""


@dataclass
class Freeze:
    """A time during which a node was stopped.

    Attributes:
        label: Name of the node.
        pid: Its process.
        begin_s: When that was seen first [s].
        end_s: When it went on [s]; none while it has not.
        told: Whether the user knows.
    """

    label: str
    pid: int
    begin_s: float
    end_s: float | None = None
    told: bool = False

    def within(self, since_s: float, now_s: float) -> float:
        """How much of the time from then to now it covers [s]."""
        end_s = now_s if self.end_s is None else self.end_s
        return max(end_s - max(self.begin_s, since_s), 0.0)


def pid_is_stopped(pid: int) -> bool:
    """Whether a process is stopped; one that has ended is not."""
    try:
        return is_stopped(psutil.Process(pid))
    except psutil.Error:
        return False


class Freezes:
    """Notices nodes that are stopped by a signal, and that go on again.

    Args:
        tell: Takes a line about each.
        stopped: Whether a process is stopped.
    """

    def __init__(
        self, tell: Callable[[str], None], stopped: Callable[[int], bool] = pid_is_stopped
    ) -> None:
        self._tell, self._stopped = tell, stopped
        self._now: dict[str, Freeze] = {}
        self._all: list[Freeze] = []
        self._next_s = 0.0
        self._looked_s = -math.inf

    @property
    def labels(self) -> tuple[str, ...]:
        """Nodes that are stopped now, and told of."""
        return tuple(label for label, freeze in self._now.items() if freeze.told)

    @property
    def needed(self) -> str:
        """Those of them without which no reach goes on, in words; empty when there are none."""
        return ", ".join(label for label in self.labels if label not in SILENT)

    def look(self, now_s: float, pids: Mapping[str, int]) -> None:
        """Look whether any is stopped; call it often.

        Args:
            now_s: Time of any clock that does not jump [s].
            pids: Processes of the nodes that run.
        """
        self._looked_s = now_s
        if now_s < self._next_s:
            return
        self._next_s = now_s + LOOK_S
        for label in self._now.keys() - pids.keys():
            self._now.pop(label).end_s = now_s
        for label, pid in pids.items():
            freeze = self._now.get(label)
            if not self._stopped(pid):
                if freeze is not None:
                    self._goes_on(self._now.pop(label), now_s)
            elif freeze is None:
                self._now[label] = Freeze(label, pid, now_s)
                self._all.append(self._now[label])
            elif not freeze.told and now_s - freeze.begin_s >= TOLD_S:
                freeze.told = True
                self._tell(_words(freeze))

    def _goes_on(self, freeze: Freeze, now_s: float) -> None:
        freeze.end_s = now_s
        if freeze.told:
            length_s = now_s - freeze.begin_s
            self._tell(f"{freeze.label} goes on: it was stopped for {length_s:.1f} s")

    def hint(self) -> str:
        """What to do about those that are stopped now; empty when there are none."""
        return "; ".join(_words(freeze) for freeze in self._now.values() if freeze.told)

    def stopped_s(self, since_s: float, now_s: float) -> dict[str, float]:
        """How long nodes were stopped from then to now [s], of those that were told of, by name.

        Of one that is stopped still, until it was looked at last: when a run is over nobody looks any more.
        """
        found: dict[str, float] = {}
        now_s = min(now_s, self._looked_s)
        for freeze in self._all:
            length_s = freeze.within(since_s, now_s)
            if freeze.told and length_s > 0.0:
                found[freeze.label] = found.get(freeze.label, 0.0) + length_s
        return found

    def because(self, reason: str, since_s: float, now_s: float) -> str:
        """A reason why something since then went wrong, with who was stopped meanwhile before it."""
        needed = self.stopped_s(since_s, now_s)
        for label in SILENT:
            needed.pop(label, None)
        return f"{stopped_words(needed)} ({reason})" if needed else reason


def stopped_words(stopped_s: Mapping[str, float]) -> str:
    """Who was stopped for how long [s], in words."""
    return ", ".join(f"{label} was stopped for {s:.1f} s" for label, s in stopped_s.items())


def _words(freeze: Freeze) -> str:
    meaning = MEANINGS.get(freeze.label)
    comes = f"; {meaning}" if meaning else ""
    return (
        f"{freeze.label} does not answer: process {freeze.pid} is stopped by a signal{comes}; "
        f"`kill -CONT {freeze.pid}` lets it go on"
    )
