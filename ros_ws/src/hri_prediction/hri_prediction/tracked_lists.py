"""Who is tracked, as several sources say it: what each of them says last, taken together.

Nobody knows which source a list is of: a list is known by its stamp, of when it became so, and its ids. One
that is not said any more was either changed, when a new one came that may stand for it, or its source is
dead, or hangs: then its people count as tracked, and nobody knows who has come since.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

NANO = 1_000_000_000
MAX_AGE_S = 0.12
"""A list that has not been said for so long is lost [s]: sources say theirs every 40 ms."""
CHANGED_NS = 60_000_000
"""One that has not been said for so long, while a new one came, was changed into that [ns]."""
MOST = 32
"""Lists that are known at the same time; of more, nobody knows whose they are."""
NAMED = 5
"""So many ids of a lost list are named."""


@dataclass(eq=False)
class _List:
    """What a source says.

    Attributes:
        ids: Of the bodies that it tracks.
        heard_ns: When it was heard last [ns].
        first: Number of the message that brought it.
        last: Number of the newest message with it.
        free: Whether it may still stand for one that is over.
        lost: Whether its source no longer says it, and no other stands for it.
    """

    ids: tuple[str, ...]
    heard_ns: int
    first: int
    last: int
    free: bool = True
    lost: bool = False


class TrackedLists:
    """The lists of all sources.

    A new list may stand for one other, that was heard before it came, and not since: for one with the same
    ids if there is such a one (its source was started again, or stamps its list anew each time), else for
    any. So a source that changes its list, or is started again, takes its old one away, and one that dies
    does not go unnoticed.

    Times are the node's own, of when it heard: stamps only tell lists apart, and may be 0.

    Args:
        max_age_s: A list that has not been said for so long is lost [s].

    Attributes:
        ids: Who is tracked, each once: of lists that are said, or were lost; none while there is no list.
    """

    def __init__(self, max_age_s: float = MAX_AGE_S) -> None:
        self._max_age_ns = round(max_age_s * NANO)
        self._changed_ns = min(CHANGED_NS, self._max_age_ns)
        self._lists: dict[tuple[int, tuple[str, ...]], _List] = {}
        self._count = 0
        self._flooded_ns: int | None = None
        self.ids: tuple[str, ...] | None = None

    def heard(self, stamp_ns: int, ids: Iterable[str], now_ns: int) -> None:
        """Somebody says a list.

        Args:
            stamp_ns: Of when the list became so [ns].
            ids: Of the bodies.
            now_ns: When it was heard [ns].
        """
        key = (stamp_ns, tuple(ids))
        self._count += 1
        known = self._lists.get(key)
        if known is None:
            if len(self._lists) >= MOST:
                del self._lists[min(self._lists, key=lambda each: self._lists[each].last)]
                self._flooded_ns = now_ns
            self._lists[key] = _List(key[1], now_ns, self._count, self._count)
            self._unite()
        else:
            known.heard_ns, known.last, known.lost = now_ns, self._count, False
        self.look(now_ns)

    def look(self, now_ns: int) -> None:
        """Find out which lists are over by now.

        Args:
            now_ns: The time [ns]; it may have gone back.
        """
        silent = []
        for key, each in self._lists.items():
            each.heard_ns = min(each.heard_ns, now_ns)
            if now_ns - each.heard_ns > self._changed_ns:
                silent.append(key)
        if not silent:
            return
        over = False
        for key in sorted(silent, key=lambda each: self._lists[each].last):
            each = self._lists[key]
            late = now_ns - each.heard_ns > self._max_age_ns
            heir = self._heir(each, late)
            if heir is not None:
                heir.free = False
                del self._lists[key]
                over = True
            elif late:
                each.lost = True
        if over:
            self._unite()

    def _heir(self, silent: _List, late: bool) -> _List | None:
        """Which list stands for one that is not said any more; none: nobody knows of one.

        One that has the ids of another which was last heard before it came stands for that one, it seems;
        unless the other is heard again, for which there is time while it is not late.
        """
        heirs = [each for each in self._lists.values() if each.free and each.first > silent.last]
        if not heirs:
            return None
        oldest: dict[tuple[str, ...], int] = {}
        for each in self._lists.values():
            oldest[each.ids] = min(each.last, oldest.get(each.ids, each.last))
        for each in heirs:
            if each.ids == silent.ids or oldest[each.ids] >= each.first:
                return each
            if not late:
                return None
        return None

    def _unite(self) -> None:
        self.ids = tuple(
            dict.fromkeys(body_id for each in self._lists.values() for body_id in each.ids)
        )

    @property
    def said(self) -> frozenset[str]:
        """Who is on a list that is still said."""
        return frozenset(
            body_id for each in self._lists.values() if not each.lost for body_id in each.ids
        )

    @property
    def pending(self) -> bool:
        """Whether one of the lists may just have been changed into another."""
        newest = max((each.first for each in self._lists.values() if each.free), default=0)
        return any(each.last < newest and not each.lost for each in self._lists.values())

    def trouble(self, now_ns: int) -> str:
        """Why nobody knows who is there; empty when that is known.

        Args:
            now_ns: The time [ns].
        """
        self.look(now_ns)
        if not self._lists:
            return "nothing says who is tracked"
        lists = self._lists.values()
        if all(now_ns - each.heard_ns > self._max_age_ns for each in lists):
            return "nothing says any longer who is tracked"
        for each in lists:
            if each.lost:
                ids = ", ".join(each.ids[:NAMED]) + (", ..." if len(each.ids) > NAMED else "")
                return f"a source no longer says who is tracked (it listed {ids or 'nobody'})"
        if self._flooded_ns is not None:
            self._flooded_ns = min(self._flooded_ns, now_ns)
            if now_ns - self._flooded_ns <= self._max_age_ns:
                return f"more than {MOST} lists at a time say who is tracked"
        return ""
