"""Commands that wait for a tick, each with when it came."""

from __future__ import annotations

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

    def take(self, until_ns: int | None = None) -> list[tuple[int, Any]]:
        """Take those that had come before a time [ns], each with when it came, in that order.

        Args:
            until_ns: The time; when not given, all are taken.
        """
        self._waiting.sort(key=lambda item: item[0])
        due = [item for item in self._waiting if until_ns is None or item[0] < until_ns]
        del self._waiting[: len(due)]
        return due

    def clear(self) -> None:
        """Drop all."""
        self._waiting.clear()
