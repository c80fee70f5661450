"""What is done about nodes of a run that end by themselves."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Mapping
from typing import Annotated

import typer

from hri_prediction.errors import GraphError
from hri_sim.launch.supervisor import Death, Supervisor

STOP, RESTART = "stop", "restart"
ON_DEATH = (STOP, RESTART)
MOST_STARTS = 3
"""So often a node is started again, unless more is asked for."""
START_DELAY_S = 0.25
"""So long after its death was noticed a node is started again [s]. A node that starts keeps a whole
processor busy with its imports; until the robot is at rest (within 0.2 s), those who stop it come first."""

OnDeath = Annotated[
    str,
    typer.Option(
        help="What is done when a node dies. stop: the run ends, unless it can do without it (recorder); "
        "restart: the node is started again, and the run goes on with the next reach; three times each. "
        "Neither does anything about a node that is frozen (kill -STOP): that is said, and waited for."
    ),
]


class NodeDeath(GraphError):
    """A node that the run needs has ended by itself.

    Attributes:
        death: Which, how, and its last words.
    """

    def __init__(self, death: Death) -> None:
        self.death = death
        super().__init__(str(death))


def ended(before: Mapping[str, int], now: Mapping[str, int]) -> list[str]:
    """Nodes whose process has ended, whether another one was started meanwhile or not.

    Args:
        before: Process ids by node at the last look.
        now: The same now.
    """
    return [label for label, pid in before.items() if now.get(label) != pid]


class Deaths:
    """Looks for nodes that have ended, and starts them again where that is asked for.

    Args:
        supervisor: Whose nodes.
        tell: Takes a line about each.
        policy: One of :data:`ON_DEATH`.
        most_starts: A node that was started again so often, and ends once more, ends the run.

    Attributes:
        again: Nodes that died and are started again; whoever waits for them calls :meth:`forget`.
    """

    def __init__(
        self,
        supervisor: Supervisor,
        tell: Callable[[str], None],
        policy: str = STOP,
        most_starts: int = MOST_STARTS,
    ) -> None:
        self._supervisor, self._tell, self._policy = supervisor, tell, policy
        self._most_starts = most_starts
        self._starts: Counter[str] = Counter()
        self._due: dict[str, float] = {}
        self.again: set[str] = set()

    @property
    def due(self) -> frozenset[str]:
        """Nodes that are not running, and will be started again."""
        return frozenset(self._due)

    def look(self, *, begun: bool) -> None:
        """Act upon nodes that have ended since the last call.

        Args:
            begun: Whether the run has begun; a node that ends with an error before that cannot start.

        Raises:
            NodeDeath: when the run cannot go on.
        """
        for death in self._supervisor.deaths():
            label = death.label
            cause = f"; its last words: {death.cause}" if death.cause else ""
            if begun and self._policy == RESTART and self._starts[label] < self._most_starts:
                self._starts[label] += 1
                self._due[label] = time.monotonic() + START_DELAY_S
                self.again.add(label)
                self._tell(f"{death}; it is started again{cause}")
            elif (not begun and death.code > 0) or self._supervisor.is_essential(label):
                self._tell(f"{death}: the run ends")
                raise NodeDeath(death)
            else:
                self._tell(f"{death}; the run goes on{cause}")
        now_s = time.monotonic()
        for label in [label for label, due_s in self._due.items() if due_s <= now_s]:
            del self._due[label]
            self._supervisor.start_again(label)

    def forget(self, *, starts: bool = False) -> None:
        """Those of :attr:`again` are waited for now.

        Args:
            starts: Forget how often nodes were started again, too.
        """
        self.again.clear()
        if starts:
            self._starts.clear()
