"""A pipe gets plain lines: no spinner, no bar, no escape codes, nothing twice."""

from __future__ import annotations

import io
import subprocess
import sys
from pathlib import Path

import pytest
from rich.console import Console

from hri_prediction.results import progress as module
from hri_prediction.results.progress import PLAIN_PERIOD_S, ProgressLine

ROOT = Path(__file__).resolve().parents[3]
TRC = ROOT / "examples" / "data" / "simulated_reach.trc"
MAP = "shoulder=RSHO,elbow=RELB,wrist=RWRA+RWRB,hand_tip=RFIN"


class _Clock:
    now = 100.0

    def monotonic(self) -> float:
        return self.now


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> _Clock:
    clock = _Clock()
    monkeypatch.setattr(module, "time", clock)
    return clock


def test_plain_lines(clock: _Clock) -> None:
    console = Console(file=(said := io.StringIO()), width=20)
    with ProgressLine(console) as line:
        line.say("reading [a] long name of a file.npz")
        line.say("too soon to be said")
        clock.now += PLAIN_PERIOD_S
        line.say("folds")
        for done in range(5):
            line.count(done, 4)
    assert said.getvalue().splitlines() == [
        "reading [a] long name of a file.npz",
        "folds",
        "folds: 4 of 4",
    ]


def test_plain_lines_say_what_is_left_and_how_it_goes(clock: _Clock) -> None:
    console = Console(file=(said := io.StringIO()), width=20)
    with ProgressLine(console) as line:
        line.say("training")
        for done in (6, 7, 8, 26):  # gone on with: six were done before
            clock.now += 10.0
            line.count(done, 26, f"loss {done}")
    assert said.getvalue().splitlines() == [
        "training",
        "training: 6 of 26, loss 6",
        "training: 7 of 26, loss 7, 3 min left",
        "training: 8 of 26, loss 8, 3 min left",
        "training: 26 of 26, loss 26",
    ]


def test_what_came_too_soon_is_said_when_it_is_counted_again(clock: _Clock) -> None:
    console = Console(file=(said := io.StringIO()), width=20)
    with ProgressLine(console) as line:
        line.say("trials")
        for note in ("right", "a hand is at a target", *("a hand is at a target",) * 9):
            line.count(4, 9, note)
            clock.now += 0.3 * PLAIN_PERIOD_S
    assert said.getvalue().splitlines() == ["trials", "trials: 4 of 9, a hand is at a target"]


def test_a_terminal_gets_a_live_line() -> None:
    console = Console(file=(said := io.StringIO()), width=80, force_terminal=True)
    with ProgressLine(console) as line:
        line.say("folds")
        line.count(3, 4)
    assert "3/4" in said.getvalue()
    assert "\x1b[" in said.getvalue()


def test_piped_scripts_print_plain_lines(tmp_path: Path) -> None:
    reach, library = str(tmp_path / "reach.npz"), str(tmp_path / "library")
    imported = [str(TRC), "--out", reach, "--map", MAP, "--axes", "y-up", "--task", "cup"]
    code = (
        "import sys\n"
        "from hri_prediction.tracks.importers import cli\n"
        "from hri_prediction.prediction.cli import train_main\n"
        f"sys.exit(cli.main({imported}) or train_main([{reach!r}, '--out', {library!r}]))\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, timeout=100)
    said = (done.stdout + done.stderr).decode()
    assert done.returncode == 0, said
    assert "reading" in said
    assert "\x1b" not in said
    assert "\r" not in said
    assert not set(said) & set("⠋⠙⠹⠸⠼⠴⠦⠧⠇⠏")
