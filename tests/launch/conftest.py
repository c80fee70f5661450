"""Runs the launch scripts as a user does, with real processes in a ROS domain of the test's own."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import psutil
import pytest

sys.path.insert(0, str(Path(__file__).parent))

from launched import Launched
from terminals import Terminals

from hri_sim.testing.domain import own_domain

ROOT = Path(__file__).resolve().parents[2]
SCRIPTS = ROOT / "scripts"


@pytest.fixture
def launch(tmp_path: Path) -> Iterator[Callable[..., Launched]]:
    """Starts a launch script with options; whatever is left of it is ended."""
    started: list[Launched] = []
    everything: list[psutil.Process] = []

    def start(*options: str, out: Path | None = None, script: str = "launch_ptomp.py") -> Launched:
        domain = own_domain("launch")
        folder = out or tmp_path / "run"
        printed = tmp_path / f"printed_{len(started)}.txt"
        with printed.open("w") as file:
            process = subprocess.Popen(
                [sys.executable, str(SCRIPTS / script), "--out", str(folder), *options],
                stdout=file,
                stderr=subprocess.STDOUT,
                text=True,
                cwd=tmp_path,
                env={**os.environ, "ROS_DOMAIN_ID": str(domain), "COLUMNS": "200"},
            )
        started.append(Launched(process, folder, printed, domain))
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


@pytest.fixture
def terminals(tmp_path: Path) -> Iterator[Terminals]:
    """Terminals in a folder and a ROS domain of the test's own; whatever runs in them is ended."""
    opened = Terminals(tmp_path, 1 + (os.getpid() + 31) % 100)
    yield opened
    opened.end()
