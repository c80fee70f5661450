"""Every example runs as its text says, in a few seconds, and prints something."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = sorted((ROOT / "examples").glob("*.py"))


def test_there_are_examples() -> None:
    assert len(EXAMPLES) >= 6


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_runs(path: Path, tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, str(path)], cwd=tmp_path, capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0, done.stderr
    assert len(done.stdout.splitlines()) >= 3
    assert not list(tmp_path.iterdir())  # nothing is left behind without being asked for


@pytest.mark.parametrize(
    "path", [path for path in EXAMPLES if "--plot" in path.read_text()], ids=lambda path: path.stem
)
def test_plots_when_asked(path: Path, tmp_path: Path) -> None:
    picture = tmp_path / "plot.png"
    done = subprocess.run(
        [sys.executable, str(path), "--plot", str(picture)],
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 0, done.stderr
    assert picture.read_bytes()[:4] == b"\x89PNG"


@pytest.mark.parametrize(
    "path",
    [*EXAMPLES, *sorted((ROOT / "examples" / "live").glob("*.py"))],
    ids=lambda path: path.stem,
)
def test_has_help(path: Path) -> None:
    done = run(path, "--help")
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("usage:")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("read_bag.py /no/such/bag", "/no/such/bag"),
        ("predict_reach.py --file /no/such/file.npz", "/no/such/file.npz"),
        ("predict_reach.py --trial 99", "trial 99"),
        ("steer_policy.py --rate 300", "0.032 s"),
        ("steer_policy.py --rate 0", "--rate 0"),
        ("steer_policy.py --policy nothing", "rnn_gru_9x9_d1"),
        ("condition_promp.py --plot /no/such/folder/plot.png", "/no/such/folder"),
        ("live/send_goal.py 0.4 0.1", "X Y Z"),
        ("live/send_goal.py a b c", "X Y Z"),
    ],
)
def test_a_wrong_argument_gives_one_clear_line(words: str, said: str) -> None:
    name, *arguments = words.split()
    done = run(ROOT / "examples" / name, *arguments)
    assert done.returncode in (1, 2)
    assert said in done.stderr.splitlines()[-1]
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [([], 2, "usage: _run_in_env"), (["no_such_command"], 1, "no_such_command")],
)
def test_run_in_env_says_what_it_wants(arguments: list[str], code: int, said: str) -> None:
    done = run(ROOT / "scripts" / "_run_in_env", *arguments)
    assert done.returncode == code
    assert said in done.stderr
    assert done.stderr.count("\n") == 1


def test_run_in_env_holds_the_packages() -> None:
    command = [sys.executable, str(ROOT / "scripts" / "_run_in_env"), "cat"]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        process.stdin.write("runs\n")
        process.stdin.flush()
        assert process.stdout.readline() == "runs\n"
        locks = [line.split() for line in Path("/proc/locks").read_text().splitlines()]
        held = [row[3] for row in locks if row[1] == "FLOCK" and row[4] == str(process.pid)]
        process.stdin.close()
    assert held == ["READ"]


def run(path: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run a Python file with arguments."""
    command = [sys.executable, str(path), *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=120)
