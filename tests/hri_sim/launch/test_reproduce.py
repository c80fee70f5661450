"""Scripts that reproduce tables: a run that fails is a row, a second call does only what is left."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import typer
from typer.testing import CliRunner, Result

from hri_prediction.errors import GraphError
from hri_sim.launch import benchmark, reproduce
from hri_sim.launch.replay_cases import DATA_VARIABLE
from hri_sim.launch.run import RunOptions

REACH = {
    "outcome": "reached",
    "reason": "reached, 0.1 mm off",
    "duration_s": 1.5,
    "replans": 40,
    "goal_error_m": 0.0001,
    "min_clearance_m": 0.05,
    "deadline_misses": 0,
    "max_handover_jump_rad": 1e-9,
}
BLOCKED = {**REACH, "outcome": "blocked", "reason": "no way | around"}


@pytest.fixture
def runs(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Seeds that were run; seed 2 finds no way, seed 3 fails once."""
    found: list[int] = []

    def run_graph(options: RunOptions, console: object) -> SimpleNamespace:
        options.out.mkdir(parents=True)  # refuses a folder that is there
        found.append(options.seed)
        if options.seed == 3 and found.count(3) == 1:
            raise GraphError("node ptomp ended with exit code 1")
        last = BLOCKED if options.seed == 2 else REACH
        summary = {
            "outcome": last["outcome"],
            "reaches": [REACH, last],
            "baseline_min_clearance_m": -0.05,
            "latency_ms": {"mocap_to_trajectory": {"p50": 30.0, "p99": 50.0}},
            "seed": options.seed,
            "origin": {"commit": "that of the table"},
        }
        return SimpleNamespace(summary=summary, series=None, cpu_cores=1.2)

    monkeypatch.setattr(reproduce, "run_graph", run_graph)
    return found


def _call(command: Callable[..., Any], *options: object) -> Result:
    app = typer.Typer()
    app.command()(command)
    return CliRunner().invoke(app, [str(option) for option in options], env={"COLUMNS": "300"})


def test_a_failed_run_is_a_row_and_only_it_is_run_again(runs: list[int], tmp_path: Path) -> None:
    options = ("--first-seed", 1, "--seeds", 4, "--runs", tmp_path / "runs", "--out", tmp_path)
    first = _call(reproduce.reproduce_demo, *options)
    assert first.exit_code == 1
    assert "1 of 4 runs failed" in first.output
    table = (tmp_path / "demo.md").read_text()
    assert "| 1 | reached | 0.1 | 5.0 |" in table
    assert "| 2 | blocked: no way / around | 0.1 |" in table
    assert "| 3 | error: node ptomp ended with exit code 1 | – |" in table
    assert "| 4 | reached |" in table
    assert "5 of 12 reaches reached" in table
    assert runs == [1, 2, 3, 4]

    second = _call(reproduce.reproduce_demo, *options)
    assert second.exit_code == 0, second.output
    assert runs == [1, 2, 3, 4, 3]
    assert "| 3 | reached |" in (tmp_path / "demo.md").read_text()
    seeds = json.loads((tmp_path / "demo.json").read_text())["seeds"]
    assert list(seeds) == ["1", "2", "3", "4"]
    assert "origin" not in seeds["1"]


def test_the_table_is_there_after_each_run(runs: list[int], tmp_path: Path) -> None:
    run_graph = reproduce.run_graph

    def interrupted(options: RunOptions, console: Any) -> Any:
        if options.seed == 2:
            raise KeyboardInterrupt
        return run_graph(options, console)

    options = ("--first-seed", 1, "--seeds", 2, "--runs", tmp_path / "runs", "--out", tmp_path)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(reproduce, "run_graph", interrupted)
        assert _call(reproduce.reproduce_demo, *options).exit_code != 0
    (tmp_path / "runs" / "2").mkdir()  # what it has left
    assert "| 1 | reached |" in (tmp_path / "demo.md").read_text()
    assert _call(reproduce.reproduce_demo, *options).exit_code == 0
    assert runs == [1, 2]


def test_rows_of_another_commit_are_not_taken(
    runs: list[int], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    options = ("--seeds", 1, "--first-seed", 1, "--runs", tmp_path / "runs", "--out", tmp_path)
    assert _call(reproduce.reproduce_demo, *options).exit_code == 0
    origin = {**reproduce.results_origin(), "commit": "abc123"}
    monkeypatch.setattr(reproduce, "results_origin", lambda: origin)
    refused = _call(reproduce.reproduce_demo, *options)
    assert refused.exit_code == 1
    assert "abc123" in refused.output
    assert "--runs" in refused.output
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "notes.txt").write_text("")
    refused = _call(reproduce.reproduce_demo, "--runs", tmp_path / "mine", "--out", tmp_path)
    assert refused.exit_code == 1
    assert "is not empty" in refused.output
    assert runs == [1]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--dfki", 1, "--vicon", 0], "--dfki 1, and 0 recordings in"),
        (["--dfki", 0, "--vicon", 1], "--vicon 1, and 0 recordings in"),
        (["--smoke"], "--vicon 1, and 0 recordings in"),
    ],
)
def test_missing_recordings_are_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, options: list[object], words: str
) -> None:
    monkeypatch.setenv(DATA_VARIABLE, str(tmp_path))
    done = _call(
        reproduce.reproduce_replay, *options, "--runs", tmp_path / "runs", "--out", tmp_path
    )
    assert done.exit_code == 1
    assert words in done.output
    assert DATA_VARIABLE in done.output
    assert not (tmp_path / "replay.md").exists()


def test_a_run_that_failed_does_not_cost_the_benchmark(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def run_graph(options: RunOptions, console: object) -> None:
        raise GraphError(f"seed {options.seed} failed")

    monkeypatch.setattr(benchmark, "run_graph", run_graph)
    done = CliRunner().invoke(benchmark.app, ["--out", str(tmp_path / "b"), "--seeds", "2"])
    assert done.exit_code == 1
    assert "seed 201 failed" in done.output  # the second was tried
    assert "no run went well" in done.output
    results: dict[str, Any] = {"seeds": [1, 2]}
    results |= {"outcomes": ["reached"], "failures": {2: "the recorder died"}}
    figures = ("lost_messages", "host_share", "cpu_share", "replan_miss_share", "replans")
    nothing = {"p50": None, "p99": None}
    results |= {
        "rates_hz": {},
        "sim_realtime_factor": 30.0,
        "recorder_msgs_per_s": 5000.0,
    } | dict.fromkeys(figures, 0)
    results["latency_ms"] = {"mocap_to_prediction": nothing, "mocap_to_trajectory": nothing}
    results["origin"] = reproduce.results_origin()
    benchmark.write_results(tmp_path, results, {"a": np.zeros(3), "b": np.ones(3)})
    assert "Seed 2 is not counted: the recorder died." in (tmp_path / "results.md").read_text()
