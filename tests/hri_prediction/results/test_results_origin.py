"""Files with results say of which commit, when and on which machine they were measured."""

from __future__ import annotations

import os
import re
import subprocess
from pathlib import Path

import pytest

from hri_prediction.results.origin import cpu_model, results_origin


def _git(folder: Path, *arguments: str) -> None:
    identity = ("-c", "user.name=a", "-c", "user.email=a@b")
    subprocess.run(["git", *identity, *arguments], cwd=folder, check=True, capture_output=True)


def test_commit_date_and_machine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HRI_PROJECT_ROOT", str(tmp_path))
    for folder in ("scripts", "docs"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "file").write_text("")
    assert results_origin()["commit"] == "unknown"
    _git(tmp_path, "init")
    _git(tmp_path, "add", ".")
    _git(tmp_path, "commit", "-m", "first")
    origin = results_origin()
    assert re.fullmatch("[0-9a-f]{12}", origin["commit"])
    assert re.fullmatch(r"\d{4}-\d\d-\d\d", origin["date"])
    assert origin["machine"]["cores"] == len(os.sched_getaffinity(0))
    assert origin["machine"]["cpu"]
    _git(tmp_path, "tag", "v1")
    assert results_origin()["commit"] == "v1"
    (tmp_path / "docs" / "file").write_text("the table that was made just before")
    assert results_origin()["commit"] == "v1"
    (tmp_path / "scripts" / "new").write_text("")
    assert results_origin()["commit"] == "v1-dirty"
    # An archive that lies in somebody's repository is not that repository.
    monkeypatch.setenv("HRI_PROJECT_ROOT", str(tmp_path / "docs"))
    assert results_origin()["commit"] == "unknown"
    monkeypatch.delenv("HRI_PROJECT_ROOT")
    assert results_origin()["commit"] == "unknown"


def test_the_processor_is_named_even_where_the_kernel_does_not(tmp_path: Path) -> None:
    info = tmp_path / "cpuinfo"
    assert cpu_model(info)
    info.write_text("processor : 0\nmodel name\t: Fast CPU @ 3 GHz\n")
    assert cpu_model(info) == "Fast CPU @ 3 GHz"
