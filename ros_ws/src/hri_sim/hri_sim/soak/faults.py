"""Which faults a soak brings about, and when: drawn one after the other by a seed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hri_prediction.errors import ConfigError

KILL, PAUSE = "kill", "pause"
NAN, FRAME, CLOCK, JUMP = "nan", "frame", "clock", "jump"
CANCEL, UNREACHABLE, PREEMPT = "cancel", "unreachable", "preempt"

GROUPS: dict[str, tuple[str, ...]] = {
    "kills": (KILL,),
    "pauses": (PAUSE,),
    "mocap": (NAN, FRAME, CLOCK, JUMP),
    "goals": (CANCEL, UNREACHABLE, PREEMPT),
}
"""What can be asked for."""
ALL, NONE = "all", "none"

WORDS = {
    KILL: "a node is killed (kill -9)",
    PAUSE: "a node stands still for a while (SIGSTOP)",
    NAN: "motion capture sends NaN",
    FRAME: "motion capture sends in a wrong frame",
    CLOCK: "the clock of motion capture goes back by 1 s",
    JUMP: "motion capture sees the arm half a metre off",
    CANCEL: "the goal is cancelled in mid-motion",
    UNREACHABLE: "a goal is out of reach",
    PREEMPT: "a newer goal takes over in mid-motion",
}
"""What each is."""

PAUSE_S = (0.4, 3.0)
MOCAP_S = (0.3, 2.0)
INTO_MOTION_S = (0.1, 1.2)
"""Ranges of how long they last, and of when in a motion they begin [s]."""


@dataclass(frozen=True)
class Fault:
    """One fault.

    Attributes:
        kind: One of :data:`WORDS`.
        node: Name of the node that is killed or stands still; empty for others.
        wait_s: From the moment that the fault before is over, to when this one is due [s].
        into_motion_s: So long after the begin of the next motion it comes [s].
        seconds: How long it lasts [s]; 0 for what is done at once.
    """

    kind: str
    node: str
    wait_s: float
    into_motion_s: float
    seconds: float


def chosen_kinds(asked: str) -> tuple[str, ...]:
    """The kinds of faults that are asked for: ``all``, ``none``, or groups with commas between them.

    Raises:
        ConfigError: when one is not known.
    """
    if asked == ALL:
        return tuple(WORDS)
    if asked == NONE:
        return ()
    kinds: list[str] = []
    for name in asked.split(","):
        if name not in GROUPS:
            raise ConfigError(
                f"--faults {asked}",
                expected=f"{ALL}, {NONE}, or some of {', '.join(GROUPS)} with commas between them",
            )
        kinds += GROUPS[name]
    return tuple(dict.fromkeys(kinds))


class FaultPlan:
    """Draws faults.

    Groups come in rounds, each once and in an order that is drawn, so that a short soak has some of all;
    within them the kind is drawn, then the node. Kills come first in the first round: they may be over
    after half the time, in which a busy machine gets through few faults.

    Args:
        rng: Source of all randomness.
        kinds: Those that may come.
        nodes: Names of the nodes.
        mean_wait_s: Mean time from the end of one to the next [s].
    """

    def __init__(
        self,
        rng: np.random.Generator,
        kinds: Sequence[str],
        nodes: Sequence[str],
        mean_wait_s: float,
    ) -> None:
        self._rng = rng
        self._groups = [
            own for group in GROUPS.values() if (own := [kind for kind in group if kind in kinds])
        ]
        self._round: list[list[str]] = []
        self._first = True
        self._nodes = list(nodes)
        self._mean_wait_s = mean_wait_s

    def next(self, *, kills: bool = True) -> Fault | None:
        """The next fault; none when there are to be none.

        Args:
            kills: Whether nodes may be killed now.
        """
        if not any(self._may_come(group, kills) for group in self._groups):
            return None
        rng = self._rng
        while not self._may_come(group := self._next_group(), kills):
            pass
        kind = group[int(rng.integers(len(group)))]
        node = self._nodes[int(rng.integers(len(self._nodes)))]
        lasts = {PAUSE: PAUSE_S, **dict.fromkeys(GROUPS["mocap"], MOCAP_S)}.get(kind, (0.0, 0.0))
        return Fault(
            kind=kind,
            node=node if kind in (KILL, PAUSE) else "",
            wait_s=float(rng.exponential(self._mean_wait_s)),
            into_motion_s=float(rng.uniform(*INTO_MOTION_S)),
            seconds=float(rng.uniform(*lasts)),
        )

    @staticmethod
    def _may_come(group: list[str], kills: bool) -> bool:
        return kills or group != [KILL]

    def _next_group(self) -> list[str]:
        """The next one of this round, or the first one of a new round."""
        if not self._round:
            order = self._rng.permutation(len(self._groups))
            self._round = [self._groups[index] for index in order]
            if self._first:
                self._round.sort(key=lambda group: group != [KILL])
                self._first = False
        return self._round.pop(0)
