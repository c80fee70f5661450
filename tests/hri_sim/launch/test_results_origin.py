"""Files with results say of which commit, when and on which machine they were measured."""

from __future__ import annotations

import json
import os
import re
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hri_sim.launch.benchmark import write_results
from hri_sim.launch.origin import cpu_model, origin_line, results_origin
from hri_sim.launch.reproduce import write_demo, write_replay

ORIGIN = {
    "commit": "abc123",
    "date": "2025-01-31",
    "machine": {"cpu": "Some CPU", "cores": 2, "python": "3.12.1"},
}


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


def test_every_file_with_results_says_so(tmp_path: Path) -> None:
    nothing: dict[str, Any] = {"p50": None, "p99": None}
    write_demo(tmp_path, ORIGIN, {})
    write_replay(tmp_path, ORIGIN, {}, [])
    latencies = {"mocap_to_prediction": nothing, "mocap_to_trajectory": nothing}
    results = {"origin": ORIGIN, "seeds": [1], "outcomes": ["reached"], "latency_ms": latencies}
    figures = ("lost_messages", "cpu_share", "replan_miss_share", "recorder_msgs_per_s")
    results |= {"rates_hz": {}, "sim_realtime_factor": 30.0} | dict.fromkeys(figures, 0)
    write_results(tmp_path, results, {"a": np.zeros(3), "b": np.ones(3)})
    line = origin_line(ORIGIN)
    assert line == "Commit abc123, 2025-01-31; Some CPU, 2 cores, Python 3.12.1."
    for name in ("demo", "replay", "results"):
        assert line in (tmp_path / f"{name}.md").read_text()
        assert json.loads((tmp_path / f"{name}.json").read_text())["origin"] == ORIGIN
