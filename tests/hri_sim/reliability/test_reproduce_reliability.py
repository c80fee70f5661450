"""The report of what happens when things go wrong."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from hri_sim.faults import command
from hri_sim.reliability import encounters
from hri_sim.reliability.fault import LOCKSTEP, PROCESSES, Fault, Result
from hri_sim.separation.encounter import KINDS


def test_a_smoke_run(tmp_path: Path) -> None:
    code = "import sys; from hri_sim.faults.command import main; main()"
    # The lines of faults have tests of their own.
    lines = ["--only", "encounters", "--only", "truncated_models"]
    arguments = ["--smoke", "--encounters", "6", "--workers", "1", "--runs", str(tmp_path), *lines]
    done = subprocess.run(
        [sys.executable, "-c", code, *arguments],
        capture_output=True,
        text=True,
        env=dict(os.environ),
        timeout=600,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    content = json.loads((tmp_path / "reliability.json").read_text())
    assert content["smoke"]
    assert set(content["encounters"]) == {case.name for case in encounters.CASES}
    figures = json.loads((tmp_path / "results.json").read_text())
    assert figures["touched_by_moving_robot"] == 0
    assert figures["missed"] == []
    assert content["faults"]["truncated_models"]["repetitions"] == 1
    text = (tmp_path / "reliability.md").read_text()
    assert "A smoke run" in text
    assert "`scripts/reproduce_reliability.py --only truncated_models --count 1`" in text
    for case in encounters.CASES:
        for kind in KINDS:
            assert f"| {case.name} | {kind} |" in text


def test_a_touch_is_a_bar_that_is_missed() -> None:
    row = {
        "encounters": 1000,
        "robot_moved": 990,
        "touched_moving": 0,
        "seeds_touched": [],
        "fastest_touch_m_s": 0.0,
        "fastest_approach_m_s": 0.0,
        "came_to_a_resting_robot": 5,
        "closest_moving_m": None,
        "median_closest_moving_m": None,
        "stops": 3,
        "stopped_share": 0.25,
        "slowed_share": 0.1,
    }
    found = {case.name: {kind: dict(row) for kind in KINDS} for case in encounters.CASES}
    origin = {
        "commit": "abc",
        "date": "2026-01-01",
        "machine": {"cpu": "x", "cores": 2, "python": "3.11"},
    }
    content = {"origin": origin, "smoke": False, "encounters": found}
    assert "in 15,000 encounters" in command.report(content, ())
    assert "in 14,850 of them the robot moved" in command.report(content, ())
    assert "| met |" in command.report(content, ())
    # With the monitor alone that lets people come nearer, nothing is promised.
    found["launched, measured"]["chasing"]["touched_moving"] = 2
    assert "| met |" in command.report(content, ())
    found["assumed"]["walking"] |= {
        "touched_moving": 1,
        "fastest_touch_m_s": 0.3,
        "fastest_approach_m_s": -0.1,
    }
    assert "**missed**" in command.report(content, ())
    assert "| assumed | walking | 1,000 | 990 | 1 | 0.30 | -0.10 |" in command.report(content, ())


def test_no_graph_runs_on_beside_what_needs_none(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen = []

    class Stay:
        closed = False

        def close(self) -> None:
            self.closed = True

    stay = Stay()

    def bring_about(fault: Fault, *rest: object, stays: dict[str, Stay], **more: object) -> Result:
        if fault.kind == PROCESSES:
            stays["graph"] = stay
        seen.append((fault.kind, stay.closed))
        return Result(fault, (), "left out")

    monkeypatch.setattr(command, "bring_about", bring_about)
    options = ["--only", "kill_ptomp", "--only", "clock_back", "--runs", str(tmp_path)]
    assert CliRunner().invoke(command.app, options).exit_code == 0
    assert seen == [(PROCESSES, False), (LOCKSTEP, True)]
