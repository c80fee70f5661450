"""Tests in real time that fail are failures, but on a machine that is too slow for them."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

CONFTEST = Path(__file__).parents[1] / "conftest.py"
FAILING = "def test_it():\n    assert 1 == 2, 'the reason'\n"


@pytest.mark.parametrize(
    ("folder", "limit_s", "code", "words"),
    [
        ("launch", 0.0, 0, ("1 skipped", "not judged: launch/test_it.py::test_it", "the reason")),
        ("launch", 100.0, 1, ("1 failed", "the reason")),
        ("hri_sim/launch", 0.0, 1, ("1 failed", "the reason")),
    ],
)
def test_who_is_judged(
    tmp_path: Path, folder: str, limit_s: float, code: int, words: tuple[str, ...]
) -> None:
    text = CONFTEST.read_text()
    assert "\nSLOW_S = 1.1\n" in text
    text = text.replace("\nSLOW_S = 1.1\n", f"\nSLOW_S = {limit_s}\n")
    (tmp_path / "conftest.py").write_text(text.replace("10_000_000", "10_000"))
    (tmp_path / folder).mkdir(parents=True)
    (tmp_path / folder / "test_it.py").write_text(FAILING)
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", str(tmp_path)],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == code, done.stdout + done.stderr
    for word in words:
        assert word in done.stdout
