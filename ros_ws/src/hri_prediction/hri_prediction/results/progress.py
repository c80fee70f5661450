"""How far something is: a live line on a terminal, plain lines anywhere else."""

from __future__ import annotations

import time
from typing import Self

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

from hri_prediction.closing import Closing

PLAIN_PERIOD_S = 2.0
"""A file or a pipe gets a line this often at most [s]."""


_LEAST_LEFT_S = 5.0


class ProgressLine(Closing):
    """Says what is done at present; a context manager.

    A pipe gets no spinners, no escape codes and nothing that is drawn twice.

    Args:
        console: Where to.
    """

    def __init__(self, console: Console) -> None:
        self._console = console
        self._live: Progress | None = None
        if console.is_terminal:
            columns = (
                TextColumn("{task.description}", markup=False),
                BarColumn(),
                MofNCompleteColumn(),
                TimeElapsedColumn(),
                TextColumn("left"),
                TimeRemainingColumn(elapsed_when_finished=False),
            )
            self._live = Progress(*columns, console=console)
            self._line = self._live.add_task("", total=None)
        self._said = ""
        self._next_s = 0.0
        self._text = ""
        self._first: tuple[int, float] | None = None
        self._counted: tuple[tuple[str, int, int, str] | None, str] = (None, "")

    def __enter__(self) -> Self:
        if self._live is not None:
            self._live.start()
        return self

    def close(self) -> None:
        """Take the line away."""
        if self._live is not None:
            self._live.stop()

    def say(self, text: str) -> None:
        """What is done from now on."""
        self._text, self._first = text, None
        if self._live is not None:
            self._live.reset(self._line, total=None, description=text)
        else:
            self._plain(text)

    def count(self, done: int, of: int, note: str = "") -> None:
        """How many steps of it are done, of how many, and how it goes.

        A pipe is told of it when it is time for a line: count it again until then, and the last is said.
        """
        if self._live is not None:
            text = f"{self._text} {note}".strip()
            self._live.update(self._line, completed=done, total=of, description=text)
        else:
            # What has not changed is said in the same words: once, by whoever goes on counting it.
            if self._counted[0] != (counted := (self._text, done, of, note)):
                said = f", {note}" if note else ""
                text = f"{self._text}: {done} of {of}{said}{self._left(done, of)}"
                self._counted = (counted, text)
            self._plain(self._counted[1], last=done == of)

    def _left(self, done: int, of: int) -> str:
        """How long it will take by what was counted so far, which may have begun in the middle."""
        now = time.monotonic()
        if self._first is None:
            self._first = (done, now)
        counted = done - self._first[0]
        if not counted or done >= of:
            return ""
        left_s = (now - self._first[1]) / counted * (of - done)
        if left_s < _LEAST_LEFT_S:
            return ""
        return f", {left_s / 60.0:.0f} min left" if left_s >= 90.0 else f", {left_s:.0f} s left"

    def _plain(self, text: str, last: bool = False) -> None:
        now = time.monotonic()
        if text != self._said and (last or now >= self._next_s):
            self._said, self._next_s = text, now + PLAIN_PERIOD_S
            self._console.print(text, highlight=False, markup=False, soft_wrap=True)
