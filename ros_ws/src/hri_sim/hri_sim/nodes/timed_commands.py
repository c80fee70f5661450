"""Commands that wait for a tick, each with when it came."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any


class TimedCommands:
    """What has come since the last tick, to be taken piece by piece by one that is late."""

    def __init__(self) -> None:
        self._waiting: list[tuple[int, Any]] = []

    def add(self, came_ns: int, command: Any) -> None:
        """Append one.

        Args:
            came_ns: When it came [ns]; not before those of its type that came first, whatever a clock
                says that was set back in between.
            command: What is commanded, of any type.
        """
        before = [came for came, other in self._waiting if type(other) is type(command)]
        self._waiting.append((max([came_ns, *before]), command))

    def take(self, until_ns: int | None = None) -> list[Any]:
        """Take those that had come before a time [ns], in the order of their coming; without one, all."""
        self._waiting.sort(key=lambda item: item[0])
        due = [one for came, one in self._waiting if until_ns is None or came < until_ns]
        del self._waiting[: len(due)]
        return due

    def forget(self, since_ns: int, kind: Callable[[Any], bool]) -> None:
        """Drop those of a kind that came before a time [ns]."""
        self._waiting = [item for item in self._waiting if item[0] >= since_ns or not kind(item[1])]

    def clear(self) -> None:
        """Drop all."""
        self._waiting.clear()
