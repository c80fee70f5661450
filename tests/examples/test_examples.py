"""Every example runs as its text says, in a few seconds, and prints something."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = sorted((Path(__file__).resolve().parents[2] / "examples").glob("*.py"))


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
