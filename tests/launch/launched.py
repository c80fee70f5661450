"""A launch script that runs in a process of its own."""

from __future__ import annotations

import contextlib
import csv
import subprocess
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import psutil

NODES = (
    "simulator", "person", "predictor", "ptomp", "policy", "recorder", "adaptation", "observer",
    "separation_monitor",
)  # fmt: skip


@dataclass
class Launched:
    """A launch script that runs, and what it prints."""

    process: subprocess.Popen[str]
    out: Path
    printed: Path
    domain: int

    @property
    def text(self) -> str:
        """All that it has printed so far."""
        return self.printed.read_text()

    def nodes(self) -> dict[str, psutil.Process]:
        """Its node processes, by name."""
        found = {}
        with contextlib.suppress(psutil.NoSuchProcess):
            for child in psutil.Process(self.process.pid).children(recursive=True):
                words = child.cmdline()
                for name in NODES:
                    if any(word.endswith(f"/{name}") for word in words):
                        found[name] = child
        return found

    def wait_for(self, word: str, timeout_s: float = 40.0) -> None:
        """Until it has printed a word."""
        self._wait(lambda: word in self.text, timeout_s)

    def wait_for_trials(self, count: int, timeout_s: float = 120.0) -> None:
        """Until so many trials of an experiment are done."""
        self._wait(lambda: len(self.trials()) >= count, timeout_s)

    def trials(self) -> list[dict[str, str]]:
        """Trials of an experiment, as its table has them."""
        try:
            with (self.out / "trials" / "trials.csv").open() as file:
                return list(csv.DictReader(file))
        except FileNotFoundError:
            return []

    def _wait(self, done: Callable[[], bool], timeout_s: float) -> None:
        end = time.monotonic() + timeout_s
        while not done():
            assert self.process.poll() is None, self.text
            assert time.monotonic() < end, self.text
            time.sleep(0.02)

    def end(self, timeout_s: float = 60.0) -> int:
        """Exit code, once it has ended."""
        return self.process.wait(timeout_s)


def addresses(node: psutil.Process) -> set[str]:
    """Where a process listens; the system's table is looked at again while the process is not in it."""
    for _ in range(20):
        found = {c.laddr.ip for c in node.net_connections("inet")}
        if found:
            break
        time.sleep(0.1)
    return found
