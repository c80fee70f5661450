"""Runs the launch script as a user does, with real processes in a ROS domain of the test's own."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import psutil
import pytest

ROOT = Path(__file__).resolve().parents[2]
NODES = ("simulator", "person", "predictor", "ptomp", "recorder")


@dataclass
class Launched:
    """A launch script that runs, and what it prints."""

    process: subprocess.Popen[str]
    out: Path
    printed: Path

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
        end = time.monotonic() + timeout_s
        while word not in self.text:
            assert self.process.poll() is None, self.text
            assert time.monotonic() < end, self.text
            time.sleep(0.02)

    def end(self, timeout_s: float = 60.0) -> int:
        """Exit code, once it has ended."""
        return self.process.wait(timeout_s)


@pytest.fixture
def launch(tmp_path: Path) -> Iterator[Callable[..., Launched]]:
    """Starts ``scripts/launch_ptomp.py`` with options; whatever is left of it is ended."""
    started: list[Launched] = []
    everything: list[psutil.Process] = []

    def start(*options: str, out: Path | None = None) -> Launched:
        folder = out or tmp_path / "run"
        printed = tmp_path / f"printed_{len(started)}.txt"
        with printed.open("w") as file:
            process = subprocess.Popen(
                [sys.executable, str(ROOT / "scripts" / "launch_ptomp.py"), "--out", str(folder)]
                + list(options),
                stdout=file,
                stderr=subprocess.STDOUT,
                text=True,
                cwd=tmp_path,
                env={**os.environ, "ROS_DOMAIN_ID": str(1 + os.getpid() % 100), "COLUMNS": "200"},
            )
        started.append(Launched(process, folder, printed))
        return started[-1]

    yield start
    for launched in started:
        everything += launched.nodes().values()
        if launched.process.poll() is None:
            launched.process.send_signal(signal.SIGKILL)
            launched.process.wait()
    for process in everything:
        with contextlib.suppress(psutil.NoSuchProcess):
            process.kill()


def gone(processes: dict[str, psutil.Process], timeout_s: float) -> list[str]:
    """Names of those that still run after a time."""
    _, alive = psutil.wait_procs(list(processes.values()), timeout=timeout_s)
    return [name for name, process in processes.items() if process in alive]
