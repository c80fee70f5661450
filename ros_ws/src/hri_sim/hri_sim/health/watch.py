"""Who is in the graph and how each node does: from statuses as they come to the rows of a table."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

from hri_sim.health.advice_table import ABSENT, FROZEN, GONE, SILENT, TWINS, UNHEARD
from hri_sim.health.figures import OK, STALE, WARN, Figures, Input, NodeStatus, figures_of
from hri_sim.health.processes import StoppedNode
from hri_sim.health.troubles import Past, Trouble, is_sole, trouble, troubles_of

SILENT_S = 2.0
"""A node that has said nothing for longer is silent, unless it speaks more seldom than each second [s]."""
LATELY_S = 10.0
"""Growth of counters is that of so long [s]."""
_SELDOM = 2.5
"""A node that speaks seldom, as one in slow motion, is silent after so many of its own periods."""


@dataclass(frozen=True)
class Row:
    """One node, or one part of a node of others that says how each part is.

    Attributes:
        name: Fully qualified name.
        level: Worst of what the node says and what is seen from outside.
        says: What is wrong, or what it does.
        silent_s: Time since it has spoken [s]; none when it never has.
        figures: Its figures, if it has spoken.
        worst_input: The input that is most late against its own rate.
        lately: Growth of counters in the last seconds, ``dropped`` among them.
        troubles: What is wrong, and what to do.
    """

    name: str
    level: int
    says: str
    silent_s: float | None = None
    figures: Figures | None = None
    worst_input: Input | None = None
    lately: Mapping[str, int] = field(default_factory=dict)
    troubles: tuple[Trouble, ...] = ()

    @property
    def dropped(self) -> int:
        """Messages that it has lost so far."""
        return 0 if self.figures is None else sum(self.figures.dropped.values())


class _Known:
    """What is remembered of a status."""

    def __init__(self) -> None:
        self.heard: deque[float] = deque(maxlen=4)
        self.past: deque[tuple[float, Past]] = deque()
        self.status: NodeStatus | None = None
        self.figures: Figures | None = None

    def hear(self, status: NodeStatus, at_s: float) -> None:
        self.heard.append(at_s)
        self.status, self.figures = status, figures_of(status.values)
        now = Past.of(self.figures)
        if self.past and self.past[-1][1].exceeds(now):  # it was started anew
            self.past.clear()
        while len(self.past) > 1 and at_s - self.past[0][0] > LATELY_S:
            self.past.popleft()
        self.past.append((at_s, now))

    def patience_s(self) -> float:
        """How long it may be silent."""
        steps = [later - earlier for earlier, later in pairwise(self.heard)]
        return max(SILENT_S, _SELDOM * min(steps, default=0.0))


class Watch:
    """Takes what is heard, and says how all are.

    Args:
        names: Nodes that are looked at, with or without namespace; all, when empty. Those that are not
            there get a row that says so.
    """

    def __init__(self, names: Collection[str] = ()) -> None:
        self._names = tuple(names)
        self._known: dict[str, _Known] = {}
        self._present: Counter[str] = Counter()
        self._since: dict[str, float] = {}
        self._sources: dict[str, tuple[str, ...]] = {}
        self._stopped: tuple[StoppedNode, ...] = ()

    def hear(self, status: NodeStatus, at_s: float) -> None:
        """Take a status, heard at a time of a clock that only goes on [s]."""
        self._known.setdefault(status.name, _Known()).hear(status, at_s)

    def look(self, speakers: Sequence[str], at_s: float) -> None:
        """Take who is there.

        Args:
            speakers: Fully qualified names of all nodes that publish /diagnostics, one a publisher.
            at_s: When [s].
        """
        self._present = Counter(speakers)
        for name in self._present:
            self._since.setdefault(name, at_s)

    def look_at_sources(self, sources: Mapping[str, Sequence[str]]) -> None:
        """Take who publishes :attr:`sole_topics`: names of nodes by topic."""
        self._sources = {topic: tuple(names) for topic, names in sources.items()}

    def look_at_processes(self, stopped: Iterable[StoppedNode]) -> None:
        """Take whose process is stopped, on this machine."""
        self._stopped = tuple(stopped)

    @property
    def sole_topics(self) -> set[str]:
        """Topics that nodes listen to, and that no two others should send at once."""
        return {
            item.topic
            for known in self._known.values()
            if known.figures is not None
            for item in known.figures.inputs
            if is_sole(item.topic)
        }

    def rows(self, at_s: float) -> list[Row]:
        """How all are at a time [s], by name."""
        rows = [
            self._row(name, known, known.status, at_s)
            for name, known in self._known.items()
            if known.status is not None
        ]
        owners = {_owner(name) for name in self._known}
        if owners <= self._since.keys():  # else somebody speaks under other names than the node's
            for name in self._present.keys() - owners:
                if at_s - self._since[name] > SILENT_S:
                    rows.append(_missing(name, UNHEARD, "is there and has said nothing yet"))
        rows = [row for row in self._with_stopped(rows) if self._is_wanted(row.name)]
        for name in self._names:
            if not any(_matches(row.name, name) for row in rows):
                rows.append(_missing(name, ABSENT, "not in the graph"))
        return sorted(rows, key=lambda row: row.name)

    def _with_stopped(self, rows: list[Row]) -> list[Row]:
        """The same, where nodes whose process is stopped say so, whether the graph knows them or not."""
        for node in self._stopped:
            text = f"its process {node.pid} is stopped"
            silent = {
                row.name: row.silent_s
                for row in rows
                if _matches(row.name, node.name) and row.level == STALE
            }
            rows = [row for row in rows if row.name not in silent]
            # One of that name that speaks is another, or has only just been stopped.
            found = silent or {f"/{node.name}": None}
            rows += [_missing(name, FROZEN, text, silent_s) for name, silent_s in found.items()]
        return rows

    def _is_wanted(self, name: str) -> bool:
        return not self._names or any(_matches(name, wanted) for wanted in self._names)

    def _row(self, name: str, known: _Known, status: NodeStatus, at_s: float) -> Row:
        silent_s = at_s - known.heard[-1]
        owner = _owner(name)
        has_left = owner in self._since and not self._present[owner]
        if has_left:
            return _missing(
                name, GONE, f"left the graph; last heard {silent_s:.0f} s ago", silent_s
            )
        if silent_s > known.patience_s():
            return _missing(name, SILENT, f"silent for {silent_s:.0f} s", silent_s)
        figures = known.figures or figures_of({})
        then_s, before = known.past[0]
        now_s, now = known.past[-1]
        lately = now.since(before)
        troubles = troubles_of(status, figures, lately, now_s - then_s, self._sources)
        if self._present[owner] > 1:
            troubles.append(trouble(TWINS, f"{self._present[owner]} nodes are called {owner}"))
        outside = [found.text for found in troubles if found.seen_from_outside]
        said = " · ".join(filter(None, (scale_words(status.values), status.message)))
        words = [said, *outside] if status.level != OK or not outside else outside
        return Row(
            name=name,
            level=max(status.level, WARN if outside else OK),
            says="; ".join(words),
            silent_s=silent_s,
            figures=figures,
            worst_input=_worst(figures),
            lately=lately,
            troubles=tuple(troubles),
        )


def scale_words(values: Mapping[str, str]) -> str:
    """How fast a separation monitor lets the robot be; empty of any other node."""
    if "protective_distance_m" not in values or "speed_scale" not in values:
        return ""
    try:
        scale = float(values["speed_scale"])
    except ValueError:
        return ""
    if scale >= 1.0:
        return "full speed"
    return f"slowed {scale:.2f}" if scale > 0.0 else "stopped"


def exit_code(rows: Sequence[Row]) -> int:
    """0 when all are well, 3 when nothing is worse than a warning, 1 otherwise and when nobody is there."""
    worst = max((row.level for row in rows), default=STALE)
    return {OK: 0, WARN: 3}.get(worst, 1)


def all_gone(rows: Sequence[Row]) -> bool:
    """Whether there are rows, and all are of nodes that have left."""
    return bool(rows) and all([one.key for one in row.troubles] == [GONE] for row in rows)


def _missing(name: str, key: str, text: str, silent_s: float | None = None) -> Row:
    return Row(name, STALE, text, silent_s, troubles=(trouble(key, text),))


def _worst(figures: Figures) -> Input | None:
    late = [item for item in figures.inputs if item.lateness > 0.0]
    return max(late, key=lambda item: item.lateness, default=None)


def _owner(name: str) -> str:
    """The node that says a status: parts of nodes are called ``node: part``."""
    return "/" + name.split(":")[0].strip().lstrip("/")


def _matches(name: str, wanted: str) -> bool:
    """Whether a name is the wanted one, which may leave the namespace away."""
    return f"/{_owner(name)}".endswith(f"/{wanted.strip('/')}")
