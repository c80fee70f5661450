"""Compiled kernels of source states that nobody uses any more do not stay for ever."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from hri_prediction import compiled


def test_only_what_was_not_used_for_a_month_goes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    long_ago = time.time() - compiled.UNUSED_S - 60.0
    names = {name: f"hri-{name * 16}" for name in "abc"}
    for name in (*names.values(), "other"):
        (tmp_path / name / "inner").mkdir(parents=True)
        if name != names["b"]:
            os.utime(tmp_path / name, (long_ago, long_ago))
    monkeypatch.setattr(compiled, "cache_folder", lambda: tmp_path / names["a"])
    compiled.remove_unused_caches()
    assert {path.name for path in tmp_path.iterdir()} == {names["a"], names["b"], "other"}


def test_kernels_that_check_their_indices_are_cached_apart(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    monkeypatch.setenv("NUMBA_BOUNDSCHECK", "0")
    usual = compiled.cache_folder()
    monkeypatch.setenv("NUMBA_BOUNDSCHECK", "1")
    assert compiled.cache_folder() == usual.with_name(f"{usual.name}-checked")
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(compiled.cache_folder()))
    assert compiled.cache_folder() == usual.with_name(f"{usual.name}-checked")


def test_use_is_noted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    folder = compiled.cache_folder()
    folder.mkdir()
    os.utime(folder, (0.0, 0.0))
    subprocess.run([sys.executable, "-c", "import hri_prediction.compiled"], check=True, timeout=60)
    assert time.time() - folder.stat().st_mtime < 60.0
