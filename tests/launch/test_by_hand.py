"""The README's recipe "Each node by hand", line by line, and what Ctrl-C does to its goal."""

from __future__ import annotations

import signal
import time
from pathlib import Path

import numpy as np
from rosbags.rosbag2 import Reader
from terminals import Terminals, recipe, wait_for

from hri_prediction.bags.reader import BagReader
from hri_sim.launch.scene import scenario_library
from hri_sim.scenario.shipped import load_shipped


def at_rest(bag: Path) -> bool:
    messages = [m.decode() for m in BagReader(bag).messages({"/joint_states"})]
    return bool(np.abs(messages[-1].velocity).max() < 0.02)


def test_the_recipe_of_the_readme(terminals: Terminals, tmp_path: Path) -> None:
    library = scenario_library(load_shipped("table_reach"), 0)
    assert library is not None
    (tmp_path / "runs" / "seven").mkdir(parents=True)
    library.save(tmp_path / "runs" / "seven" / "library.npz")
    *nodes, goal = recipe("README.md", "**Each node by hand**")
    assert len(nodes) == 5
    for process in [terminals.start(command) for command in nodes]:
        wait_for(process, "ready")

    interrupted = terminals.start(goal)
    while "cm to go" not in (line := wait_for(interrupted, "")) or line.startswith("idle"):
        pass
    time.sleep(0.3)
    interrupted.send_signal(signal.SIGINT)
    assert "the goal is cancelled" in interrupted.communicate(timeout=10.0)[0]
    assert interrupted.returncode == 130

    done = terminals.start(goal)
    said = done.communicate(timeout=30.0)[0]
    assert done.returncode == 0, said
    assert "REACHED" in said
    terminals.end()
    assert [process.returncode for process in terminals.processes] == [0] * 5 + [130, 0]
    with Reader(tmp_path / "my_bag") as reader:
        assert reader.topics["/sim/cue"].msgcount == 2
    assert at_rest(tmp_path / "my_bag")
