"""Who yields when the processors cannot do all: each node's process has its niceness from the start."""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path

import pytest

from hri_sim.launch.precedence import NICENESS, OTHERS, REALTIME
from hri_sim.launch.supervisor import NodeSpec, Supervisor


def _installed(folder: Path, name: str) -> NodeSpec:
    path = folder / "lib" / "cell" / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(
        f"#!{sys.executable}\n"
        "import os, threading, time\n"
        "say = lambda: print(os.getpriority(os.PRIO_PROCESS, 0), flush=True)\n"
        "threading.Thread(target=say).start()\n"  # of the thread that asks
        "time.sleep(60)\n"
    )
    path.chmod(0o755)
    return NodeSpec("cell", name)


def test_what_stands_for_the_world_goes_first_and_planning_last(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path))
    own = os.getpriority(os.PRIO_PROCESS, 0)
    names = ("simulator", "recorder", "ptomp")
    with Supervisor(tmp_path / "run") as nodes:
        nodes.start([_installed(tmp_path, name) for name in names])
        end = time.monotonic() + 20.0
        while not all(nodes.last_words(name) for name in names):
            assert time.monotonic() < end
            time.sleep(0.01)
        found = {name: int(nodes.last_words(name)[0]) - own for name in names}
        assert found == {"simulator": 0, "recorder": NICENESS["recorder"], "ptomp": OTHERS}
        nodes.kill("ptomp")
        nodes.start_again("ptomp")
        assert os.getpriority(os.PRIO_PROCESS, nodes.pids["ptomp"]) - own == OTHERS
        # Where the kernel shares processors among sessions, those of one session are weighed.
        assert {os.getsid(pid) for pid in nodes.pids.values()} == {os.getsid(0)}
        assert os.getpgid(0) not in {os.getpgid(pid) for pid in nodes.pids.values()}


def test_all_that_are_named_are_nodes() -> None:
    for name in {*NICENESS, *REALTIME}:
        packages = ("hri_sim", "hri_prediction", "hri_planner")
        assert any((Path(sys.prefix) / "lib" / package / name).exists() for package in packages)
