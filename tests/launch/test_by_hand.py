"""The README's recipe "Each node by hand", line by line, and what Ctrl-C does to its goal."""

from __future__ import annotations

import contextlib
import os
import shlex
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from rosbags.rosbag2 import Reader

from hri_prediction.bags.reader import BagReader
from hri_sim.launch.run import scenario_library
from hri_sim.scenario.shipped import load_shipped

ROOT = Path(__file__).resolve().parents[2]
DOMAIN = 1 + (os.getpid() + 31) % 100


def recipe() -> list[list[str]]:
    """The commands, with the Python that runs the tests."""
    text = (ROOT / "README.md").read_text().partition("**Each node by hand**")[2]
    block = text.partition("```bash\n")[2].partition("```")[0]
    lines = [line.replace("scripts/", f"{ROOT}/scripts/") for line in block.splitlines()]
    lines = [line.replace("examples/", f"{ROOT}/examples/") for line in lines]
    return [[sys.executable, *shlex.split(line)] for line in lines]


class ByHand:
    """Processes as in one terminal each."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.processes: list[subprocess.Popen[str]] = []

    def start(self, command: list[str]) -> subprocess.Popen[str]:
        process = subprocess.Popen(
            command,
            cwd=self.folder,
            env={**os.environ, "ROS_DOMAIN_ID": str(DOMAIN), "PYTHONUNBUFFERED": "1"},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        self.processes.append(process)
        return process

    def end(self) -> None:
        """Ctrl-C in every terminal."""
        for process in self.processes:
            process.send_signal(signal.SIGINT)
        for process in self.processes:
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(10.0)
            process.kill()


@pytest.fixture
def by_hand(tmp_path: Path) -> Iterator[ByHand]:
    found = ByHand(tmp_path)
    yield found
    found.end()


def wait_for(process: subprocess.Popen[str], word: str) -> str:
    """The first line with a word in it."""
    assert process.stdout is not None
    seen = []
    for line in process.stdout:
        seen.append(line)
        if word in line:
            return line
    raise AssertionError(f"no {word!r} in:\n{''.join(seen)}")


def at_rest(bag: Path) -> bool:
    messages = [m.decode() for m in BagReader(bag).messages({"/joint_states"})]
    return bool(np.abs(messages[-1].velocity).max() < 0.02)


def test_the_recipe_of_the_readme(by_hand: ByHand, tmp_path: Path) -> None:
    library = scenario_library(load_shipped("table_reach"), 0)
    assert library is not None
    (tmp_path / "runs" / "seven").mkdir(parents=True)
    library.save(tmp_path / "runs" / "seven" / "library.npz")
    *nodes, goal = recipe()
    assert len(nodes) == 5
    for process in [by_hand.start(command) for command in nodes]:
        wait_for(process, "ready")

    interrupted = by_hand.start(goal)
    while "cm to go" not in (line := wait_for(interrupted, "")) or line.startswith("idle"):
        pass
    time.sleep(0.3)
    interrupted.send_signal(signal.SIGINT)
    assert "the goal is cancelled" in interrupted.communicate(timeout=10.0)[0]
    assert interrupted.returncode == 130

    done = by_hand.start(goal)
    said = done.communicate(timeout=30.0)[0]
    assert done.returncode == 0, said
    assert "REACHED" in said
    by_hand.end()
    assert [process.returncode for process in by_hand.processes] == [0] * 5 + [130, 0]
    with Reader(tmp_path / "my_bag") as reader:
        assert reader.topics["/sim/cue"].msgcount == 2
    assert at_rest(tmp_path / "my_bag")
