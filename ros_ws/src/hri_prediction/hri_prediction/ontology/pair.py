"""Which two of the bodies that are tracked are watched, and what is to be said of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Pair:
    """Two bodies, or why there are none.

    Attributes:
        bodies: Their ids; none where there are not two.
        reason: Why there are none; empty where there are.
        besides: What somebody should know although there are two; else empty.
    """

    bodies: tuple[str, str] | None
    reason: str = ""
    besides: str = ""


def choose_pair(
    tracked: Sequence[str], wanted: Sequence[str] = (), before: tuple[str, str] | None = None
) -> Pair:
    """The two to watch.

    Args:
        tracked: Ids of the bodies that are tracked.
        wanted: Ids of two that are to be watched; empty: any two.
        before: Who was watched until now: as long as both are tracked they still are.
    """
    if wanted:
        missing = [name for name in wanted if name not in tracked]
        if missing:
            verb = "is" if len(missing) == 1 else "are"
            there = f"; who is: {', '.join(sorted(tracked))}" if tracked else ""
            return Pair(None, f"{' and '.join(missing)} {verb} not tracked{there}")
        return Pair((wanted[0], wanted[1]))
    if len(tracked) < 2:
        who = f"only {tracked[0]} is" if tracked else "nobody is"
        return Pair(None, f"{who} tracked; an interaction needs two")
    chosen = before if before and set(before) <= set(tracked) else (tracked[0], tracked[1])
    if len(tracked) == 2:
        return Pair(chosen)
    names = ", ".join(sorted(tracked))
    return Pair(
        chosen,
        besides=f"{len(tracked)} bodies are tracked ({names}): {chosen[0]} and {chosen[1]} are watched; "
        "set pair to watch others",
    )
