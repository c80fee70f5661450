"""The supervisor's own part: whose death ends a node, and how long it may take to end."""

from __future__ import annotations

import functools
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from hri_sim.launch import supervisor
from hri_sim.launch.supervisor import Death, NodeSpec, Supervisor, die_with


@pytest.mark.parametrize(("parent", "code"), [(os.getpid, 0), (os.getppid, 1)])
def test_a_node_whose_parent_has_gone_does_not_start(parent, code: int) -> None:
    # Another parent than the one that started it: that one has died meanwhile. Its number, 1 in a
    # container, says nothing by itself.
    done = subprocess.run(["true"], preexec_fn=functools.partial(die_with, parent()))
    assert done.returncode == code


def _install(folder: Path, name: str, ending_s: float) -> None:
    """A node that takes its time to end."""
    path = folder / "lib" / "cell" / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(
        f"#!{sys.executable}\n"
        "import signal, sys, time\n"
        f"signal.signal(2, lambda *_: (time.sleep({ending_s}), print('closed'), sys.exit(0)))\n"
        "print('ready', flush=True)\n"
        "time.sleep(60)\n"
    )
    path.chmod(0o755)


def test_who_writes_may_take_longer_to_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(supervisor, "STOP_TIMEOUT_S", 0.2)
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path))
    _install(tmp_path, "writer", 0.6)
    _install(tmp_path, "stuck", 60.0)
    said: list[str] = []
    with Supervisor(tmp_path / "run") as nodes:
        nodes.start(
            [
                NodeSpec("cell", "stuck", stop_timeout_s=0.2),
                NodeSpec("cell", "writer", last=True, stop_timeout_s=20.0),
            ]
        )
        end = time.monotonic() + 10.0
        while not (nodes.last_words("stuck") and nodes.last_words("writer")):
            assert time.monotonic() < end
            time.sleep(0.01)
        assert nodes.stop(said.append) == ["stuck"]
    assert nodes.last_words("writer") == ("ready", "closed")
    (line,) = said
    assert line.startswith("writer is still writing")


@pytest.mark.parametrize(
    ("hurry", "killed"), [(1, ["stuck"]), (2, ["stuck", "writer"])], ids=["once", "twice"]
)
def test_ctrl_c_again_costs_the_recording_only_at_the_second_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, hurry: int, killed: list[str]
) -> None:
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path))
    _install(tmp_path, "writer", 0.5)
    _install(tmp_path, "stuck", 60.0)
    said: list[str] = []
    with Supervisor(tmp_path / "run") as nodes:
        nodes.start(
            [NodeSpec("cell", "stuck"), NodeSpec("cell", "writer", last=True, stop_timeout_s=20.0)]
        )
        end = time.monotonic() + 10.0
        while not (nodes.last_words("stuck") and nodes.last_words("writer")):
            assert time.monotonic() < end
            time.sleep(0.01)
        begin = time.monotonic()
        assert nodes.stop(said.append, lambda: hurry) == killed
        assert time.monotonic() - begin < 4.0  # stuck would have been waited for for 5 s
    assert len(said) == (hurry == 1)
    assert all("or at the next Ctrl-C" in text for text in said)


@pytest.mark.parametrize(
    ("code", "cause"),
    [(1, "boom"), (-signal.SIGSEGV, "boom"), (-signal.SIGABRT, "boom"), (0, ""),
     (-signal.SIGKILL, ""), (-signal.SIGINT, ""), (-signal.SIGTERM, "")],
)  # fmt: skip
def test_last_words_are_told_of_who_did_not_end_by_somebody_else(code: int, cause: str) -> None:
    assert Death("ptomp", code, ("before", "boom")).cause == cause
    assert Death("ptomp", code, ()).cause == ""
