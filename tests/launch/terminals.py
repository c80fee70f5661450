"""Commands of the documentation, each run as in a terminal of its own."""

from __future__ import annotations

import contextlib
import os
import shlex
import signal
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def block(document: str, heading: str, language: str) -> str:
    """The first block of code in a language after a heading."""
    text = (ROOT / document).read_text().partition(heading)[2]
    return text.partition(f"```{language}\n")[2].partition("```")[0]


def recipe(document: str, heading: str) -> list[list[str]]:
    """The commands of the first block after a heading, with the Python that runs the tests."""
    lines = block(document, heading, "bash").replace("\\\n", " ").splitlines()
    return [
        # Inputs are found from any folder; outputs go where the test runs.
        [
            sys.executable,
            *(f"{ROOT}/{w}" if w.startswith(("scripts/", "examples/")) else w for w in c),
        ]
        for line in lines
        if (c := shlex.split(line, comments=True))
    ]


class Terminals:
    """Processes in one folder and one ROS domain."""

    def __init__(self, folder: Path, domain: int) -> None:
        self.folder = folder
        self.domain = domain
        self.processes: list[subprocess.Popen[str]] = []

    def start(self, command: list[str]) -> subprocess.Popen[str]:
        """Start a command."""
        process = subprocess.Popen(
            command,
            cwd=self.folder,
            env={**os.environ, "ROS_DOMAIN_ID": str(self.domain), "PYTHONUNBUFFERED": "1"},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        self.processes.append(process)
        return process

    def run(self, command: list[str], timeout_s: float = 60.0) -> str:
        """What a command prints; it must succeed."""
        process = self.start(command)
        said = process.communicate(timeout=timeout_s)[0]
        assert process.returncode == 0, said
        return said

    def end(self) -> None:
        """Ctrl-C in every terminal."""
        running = [process for process in self.processes if process.poll() is None]
        for process in running:
            process.send_signal(signal.SIGINT)
        for process in running:
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(10.0)
            process.kill()


def wait_for(process: subprocess.Popen[str], word: str) -> str:
    """The first line with a word in it."""
    assert process.stdout is not None
    seen = []
    for line in process.stdout:
        seen.append(line)
        if word in line:
            return line
    raise AssertionError(f"no {word!r} in:\n{''.join(seen)}")
