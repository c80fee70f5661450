"""Trouble after a run: a full disk or a broken bag is one line, and hides no death of a node."""

from __future__ import annotations

import errno
import io
import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any, ClassVar

import pytest
import typer
from rich.console import Console

from hri_sim.launch import command, run
from hri_sim.launch.deaths import NodeDeath
from hri_sim.launch.run import RunOptions, run_graph
from hri_sim.launch.supervisor import Death

SCRIPTS = Path(__file__).resolve().parents[3] / "scripts"
FULL = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


class _NoNodes:
    """In place of the supervisor: starts nothing."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.pids: dict[str, int] = {}

    def __enter__(self) -> _NoNodes:
        return self

    def __exit__(self, *error: object) -> None:
        pass

    def start(self, specs: object) -> None:
        pass

    def stop(self, tell: object, hurry: object) -> list[str]:
        return []

    def died(self, label: str) -> bool:
        return False

    def exit_code(self, label: str) -> int | None:
        return None


class _Dying:
    """In place of the conductor: the planner dies while the run is under way."""

    begun = True
    insisted: tuple[int, ...] = ()
    reports: tuple[Any, ...] = ()
    stopped_s: ClassVar[dict[str, float]] = {}

    def __init__(self, *arguments: object, **options: object) -> None:
        self.close = self.check_alone = self.wait_ready = self.break_off = lambda *a: None

    def run(self) -> None:
        raise NodeDeath(Death("ptomp", -9, ()))


class _Interrupted(_Dying):
    """Ctrl-C comes while the run is under way."""

    def run(self) -> None:
        raise KeyboardInterrupt


class _Finished(_Dying):
    """All goes well."""

    def run(self) -> None:
        pass


class _Insisted(_NoNodes):
    """Ctrl-C comes again, twice, while nodes are stopped."""

    hurried: tuple[int, ...] = ()

    def stop(self, tell: object, hurry: Callable[[], int]) -> list[str]:
        seen = [hurry()]
        for _ in range(2):
            signal.raise_signal(signal.SIGINT)
            seen.append(hurry())
        type(self).hurried = tuple(seen)
        return ["person", "recorder"]


@pytest.mark.parametrize("conductor", [_Interrupted, _Finished])
def test_ctrl_c_again_loses_no_summary(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, console: Console, conductor: type
) -> None:
    before = signal.getsignal(signal.SIGINT)
    monkeypatch.setattr(run, "Supervisor", _Insisted)
    monkeypatch.setattr(run, "Conductor", conductor)
    monkeypatch.setattr(
        run, "CpuMeter", lambda pids: SimpleNamespace(cores=lambda: 0.0, host_share=lambda: 0.0)
    )
    with pytest.raises(KeyboardInterrupt):
        run_graph(RunOptions(out=tmp_path / "run", reaches=1), console)
    assert _Insisted.hurried == (0, 1, 2)
    assert json.loads((tmp_path / "run" / "summary.json").read_text())["outcome"] == "interrupted"
    said = _said(console)
    assert ("Ctrl-C again" in said) is (conductor is _Interrupted)
    assert "had to be killed: person, recorder" in said
    assert "bag was not closed" in said
    assert "--salvage" in said
    assert "Reaches" in said
    assert signal.getsignal(signal.SIGINT) == before


@pytest.fixture
def console() -> Console:
    return Console(file=io.StringIO(), width=200)


def _said(console: Console) -> str:
    return console.file.getvalue()  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("where", "error", "words"),
    [
        ("read_run", ValueError("no such type"), "no figures of the recording"),
        ("read_run", FULL, "no figures of the recording"),
        ("write_summary", FULL, "no summary.json: No space left"),
    ],
)
def test_a_node_that_died_is_named_whatever_comes_after_it(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    console: Console,
    where: str,
    error: Exception,
    words: str,
) -> None:
    def fails(*arguments: object, **options: object) -> None:
        raise error

    monkeypatch.setattr(run, "Supervisor", _NoNodes)
    monkeypatch.setattr(run, "Conductor", _Dying)
    monkeypatch.setattr(run, where, fails)
    with pytest.raises(NodeDeath, match="ptomp was ended by SIGKILL"):
        run_graph(RunOptions(out=tmp_path / "run", reaches=1), console)
    assert words in _said(console)
    if where == "read_run":
        summary = json.loads((tmp_path / "run" / "summary.json").read_text())
        assert summary["outcome"] == "interrupted"
        assert summary["origin"].keys() == {"commit", "date", "machine"}


def test_a_full_disk_is_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, console: Console
) -> None:
    def full(*arguments: object) -> None:
        raise FULL

    monkeypatch.setattr(command, "run_graph", full)
    with pytest.raises(typer.Exit) as ended:
        command.conduct(RunOptions(out=tmp_path), console, picture=False, video=False)
    assert ended.value.exit_code == 1
    assert _said(console) == "error: No space left on device\n"


def test_a_full_disk_is_one_line_in_every_script(tmp_path: Path) -> None:
    (tmp_path / "full.py").write_text(
        "def main():\n    raise OSError(28, 'No space left', 'x.npz')\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", "import _project; _project.main('full')"],
        env={**os.environ, "PYTHONPATH": f"{SCRIPTS}:{tmp_path}", "HRI_PROJECT_ROOT": str(SCRIPTS)},
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert done.returncode == 1
    assert done.stderr == "-c: error: x.npz: No space left\n"


def test_messages_that_are_missing_are_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, console: Console
) -> None:
    monkeypatch.setattr(run, "Supervisor", _NoNodes)
    monkeypatch.setattr(run, "Conductor", _Dying)
    lost = ["7 messages were sent and are not in bag"]
    bags = SimpleNamespace(unread_words=list, lost_words=lambda: lost)
    monkeypatch.setattr(run, "RunBags", SimpleNamespace(of=lambda bags_there: bags))
    monkeypatch.setattr(run, "read_run", lambda *a, **o: None)
    monkeypatch.setattr(run, "summarise", lambda *a, **o: {"outcome": "interrupted"})
    monkeypatch.setattr(run, "print_table", lambda *a: None)
    with pytest.raises(NodeDeath):
        run_graph(RunOptions(out=tmp_path / "run", reaches=1), console)
    assert "7 messages were sent and are not in" in _said(console)
