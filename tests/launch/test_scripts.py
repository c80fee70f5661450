"""The scripts that run graphs, as a user calls them; each is short."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from hri_sim.testing.domain import own_domain

ROOT = Path(__file__).resolve().parents[2]
DOMAIN = own_domain("scripts")


def run(name: str, *options: str, folder: Path) -> str:
    """What a script prints; it must succeed."""
    done = subprocess.run(
        [sys.executable, str(ROOT / "scripts" / name), *options],
        cwd=folder,
        env={**os.environ, "ROS_DOMAIN_ID": str(DOMAIN), "COLUMNS": "200"},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=110,
    )
    assert done.returncode == 0, done.stdout
    assert "Traceback" not in done.stdout
    return done.stdout


def test_demo(tmp_path: Path) -> None:
    said = run("demo", "--no-video", folder=tmp_path)
    (out,) = (tmp_path / "runs").iterdir()
    assert "Reaches" in said
    for name in ("bag", "summary.json", "picture.png"):
        assert f"{out.relative_to(tmp_path)}/{name}" in said or str(out / name) in said
        assert (out / name).exists()
    assert not (out / "video.mp4").exists()
    summary = json.loads((out / "summary.json").read_text())
    assert [reach["outcome"] for reach in summary["reaches"]] == ["reached"] * 3
    assert summary["touched"] is False
    assert summary["baseline_min_clearance_m"] < 0.0


def test_benchmark_graph(tmp_path: Path) -> None:
    said = run("benchmark_graph.py", "--smoke", "--out", "results", folder=tmp_path)
    out = tmp_path / "results"
    assert sorted(path.name for path in out.iterdir()) == [
        "latency.png",
        "results.json",
        "results.md",
    ]
    results = json.loads((out / "results.json").read_text())
    assert results["outcomes"] == ["reached"]
    assert results["failures"] == {}
    assert results["rates_hz"]["/joint_states"] == pytest.approx(250.0, rel=0.05)
    assert "mocap → trajectory" in said


def test_reproduce_ontology(tmp_path: Path) -> None:
    """With a monitor and a dyad that are watched live."""
    said = run("reproduce_ontology.py", "--smoke", folder=tmp_path)
    out = tmp_path / "runs" / "smoke_ontology"
    results = json.loads((out / "ontology.json").read_text())
    assert results["counts"] == [512, 68, 20, 7]
    assert results["live_latency_ms"]["movements"] >= 2
    # The latest one, for which 50 ms are asked for, hangs on what else the machine does.
    assert results["live_latency_ms"]["case_p50"] <= 50.0
    assert results["live_latency_ms"]["case_most"] < 200.0
    assert results["planned"]["case_1"]["3"]["apart_cm"] > 0.1
    text = (out / "ontology.md").read_text()
    assert "smoke run" in text
    for part in (
        "Full ontology",
        "Live",
        "How much places differ",
        "Two real people",
        "What people avoid",
    ):
        assert part in text
    for picture in ("cases", "layouts", "jitter", "costs", "all_costs", "ways", "confusion_full"):
        assert f"(ontology/{picture}.png)" in text
        assert (out / "ontology" / f"{picture}.png").exists()
    assert "reduced ontology" in said


def test_reproduce_demo(tmp_path: Path) -> None:
    run("reproduce_demo.py", "--smoke", folder=tmp_path)
    out = tmp_path / "runs" / "smoke_demo"
    assert "| 100 | reached |" in (out / "demo.md").read_text()
    assert "1 of 1 reaches reached" in (out / "demo.md").read_text()
    assert (out / "100" / "picture.png").exists()
