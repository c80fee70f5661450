"""What the scripts of a run say: a live line, lines that stay, and why it was broken off."""

from __future__ import annotations

import contextlib
import math
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from rich.console import Console
from rich.markup import escape

from hri_prediction.errors import HriError
from hri_sim.launch.deaths import NodeDeath
from hri_sim.launch.folder import LOGS


@contextlib.contextmanager
def status_line(console: Console, period_s: float = 1.0) -> Iterator[Callable[[str], None]]:
    """A live line on a terminal; on anything else, a plain line in each period at most."""
    if console.is_terminal:
        with console.status("starting") as status:
            yield lambda text: status.update(escape(text))
        return
    last_s, last = -math.inf, ""

    def say(text: str) -> None:
        nonlocal last_s, last
        now = time.monotonic()
        if text != last and now - last_s >= period_s:
            last_s, last = now, text
            print_line(console, text)

    yield say


def why_broken(error: BaseException) -> str:
    """What broke a run off, in plain words."""
    if isinstance(error, HriError):
        return error.problem
    if isinstance(error, KeyboardInterrupt):
        return "Ctrl-C"
    return "told to end" if isinstance(error, SystemExit) else words_of(error)


def words_of(error: BaseException) -> str:
    """What an error says, without the number of one of the operating system's."""
    if not isinstance(error, OSError) or not error.strerror:
        return str(error)
    return f"{error.filename}: {error.strerror}" if error.filename else error.strerror


def explain(error: HriError | OSError, console: Console) -> None:
    """Say why a run failed; of a dead node, its last words too."""
    console.print("[red]error:[/] ", end="", highlight=False)
    print_line(console, words_of(error))
    if isinstance(error, NodeDeath):
        for line in error.death.last_words:
            print_line(console, f"  {line}")


def left_words(folder: Path, bag: Path | None = None) -> list[str]:
    """Where the files are that a run which failed has left; nothing when it has left none.

    Args:
        folder: Of the run.
        bag: Its bag; none: it has none.
    """
    logs = folder / LOGS
    if not logs.is_dir():
        return []
    lines = [f"logs:    {logs}"]
    if bag is not None and bag.is_dir():
        lines += [f"bag:     {bag}", f"scripts/draw_run.py {folder} draws what was recorded"]
    return lines


def print_line(console: Console, text: str) -> None:
    """One line as it is: brackets are no markup, and a pipe gets it unbroken."""
    console.print(text, highlight=False, markup=False, soft_wrap=True)
