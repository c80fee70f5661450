"""Nodes that are stopped by a signal: they are named, with what lets them go on."""

from __future__ import annotations

import io
import os
import signal
import subprocess
import time
from pathlib import Path

import pytest
import typer
from rich.console import Console

from hri_prediction.errors import ConfigError
from hri_sim.launch import command
from hri_sim.launch.folder import LOGS, NOT_BEGUN
from hri_sim.launch.freezing import Freezes, pid_is_stopped
from hri_sim.launch.run import RunOptions
from hri_sim.launch.telling import left_words

PIDS = {"ptomp": 7, "recorder": 8}


@pytest.fixture
def told() -> list[str]:
    return []


@pytest.fixture
def stopped() -> set[int]:
    return set()


@pytest.fixture
def freezes(told: list[str], stopped: set[int]) -> Freezes:
    return Freezes(told.append, stopped.__contains__)


def look(freezes: Freezes, begin_s: float, end_s: float, pids: dict[str, int] = PIDS) -> None:
    for step in range(round((end_s - begin_s) / 0.1)):
        freezes.look(begin_s + step * 0.1, pids)


def test_one_that_is_stopped_is_named_once_and_again_when_it_goes_on(
    freezes: Freezes, told: list[str], stopped: set[int]
) -> None:
    look(freezes, 0.0, 1.0)
    assert not freezes.hint()
    stopped.add(7)
    look(freezes, 1.0, 3.0)
    assert told == [
        "ptomp does not answer: process 7 is stopped by a signal; no plan comes, and the robot rests "
        "because of it; `kill -CONT 7` lets it go on"
    ]
    assert freezes.hint() == told[0]
    assert (freezes.labels, freezes.needed) == (("ptomp",), "ptomp")
    stopped.clear()
    look(freezes, 21.0, 21.5)
    assert told[1] == "ptomp goes on: it was stopped for 20.0 s"
    assert not freezes.labels
    said = freezes.because("no way to the goal was found", 0.5, 22.0)
    assert said == "ptomp was stopped for 20.0 s (no way to the goal was found)"
    assert freezes.because("no way", 21.3, 22.0) == "no way"  # over before that began
    assert freezes.stopped_s(11.0, 22.0) == {"ptomp": pytest.approx(10.0)}


def test_when_nobody_looks_any_more_a_stop_does_not_go_on(
    freezes: Freezes, stopped: set[int]
) -> None:
    """The run is over, and its files are written: the node may have gone on meanwhile."""
    look(freezes, 0.0, 1.0)
    stopped.add(7)
    look(freezes, 1.0, 3.0)
    assert freezes.stopped_s(0.0, 9.0) == {"ptomp": pytest.approx(1.9, abs=0.11)}


def test_a_short_stop_is_not_told(freezes: Freezes, told: list[str], stopped: set[int]) -> None:
    stopped.add(7)
    look(freezes, 0.0, 0.3)
    stopped.clear()
    look(freezes, 0.3, 2.0)
    assert told == []
    assert freezes.stopped_s(0.0, 2.0) == {}


def test_a_reach_does_not_fail_for_a_recorder(
    freezes: Freezes, told: list[str], stopped: set[int]
) -> None:
    stopped.add(8)
    look(freezes, 0.0, 2.0)
    assert "it may be recording nothing" in told[0]
    assert freezes.needed == ""
    assert freezes.because("blocked", 0.0, 2.0) == "blocked"
    assert freezes.stopped_s(0.0, 2.0) == {"recorder": pytest.approx(2.0, abs=0.11)}


def test_one_that_dies_is_stopped_no_more(
    freezes: Freezes, told: list[str], stopped: set[int]
) -> None:
    stopped.add(7)
    look(freezes, 0.0, 2.0)
    look(freezes, 2.0, 3.0, {"recorder": 8})
    assert not freezes.labels
    look(freezes, 3.0, 4.0, {"ptomp": 9, "recorder": 8})
    assert len(told) == 1


def test_a_process_that_is_really_stopped() -> None:
    process = subprocess.Popen(["sleep", "60"])
    try:
        assert not pid_is_stopped(process.pid)
        os.kill(process.pid, signal.SIGSTOP)
        end = time.monotonic() + 5.0
        while not pid_is_stopped(process.pid):
            assert time.monotonic() < end
            time.sleep(0.01)
    finally:
        process.kill()
        process.wait()
    assert not pid_is_stopped(process.pid)


def test_where_the_files_of_a_failed_run_are(tmp_path: Path) -> None:
    assert left_words(tmp_path, tmp_path / "bag") == []  # it left nothing
    (tmp_path / LOGS).mkdir()
    assert left_words(tmp_path, tmp_path / "bag") == [f"logs:    {tmp_path / LOGS}"]
    (tmp_path / "bag").mkdir()
    said = left_words(tmp_path, tmp_path / "bag")
    assert f"bag:     {tmp_path / 'bag'}" in said
    assert any(f"draw_run.py {tmp_path}" in line for line in said)


@pytest.mark.parametrize("begun", [True, False])
def test_the_files_of_another_run_are_not_called_those_of_one_that_was_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, begun: bool
) -> None:
    (tmp_path / LOGS).mkdir()
    if not begun:
        (tmp_path / LOGS / NOT_BEGUN).write_text("why\n")

    def refuse(*_: object) -> None:
        raise ConfigError("no", expected="yes", hint="mend it")

    monkeypatch.setattr(command, "run_graph", refuse)
    console = Console(file=io.StringIO(), width=200)
    with pytest.raises(typer.Exit):
        command.conduct(RunOptions(out=tmp_path), console, picture=False, video=False)
    said = console.file.getvalue()  # type: ignore[attr-defined]
    assert ("logs:" in said) is not begun
