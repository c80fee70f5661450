"""``scripts/launch_rnn.py`` with real processes: a policy moves the robot; wrong arguments."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from launched import Launched
from typer.testing import CliRunner

from hri_planner.nodes.policy_config import DEFAULT_POLICY
from hri_prediction.bags.reader import BagReader
from hri_sim.launch.draw import earlier_run
from hri_sim.launch.policy import app

Launch = Callable[..., Launched]


@pytest.mark.parametrize("scene", ["sequence", "switch", "handover"])
def test_a_policy_moves_the_robot(launch: Launch, scene: str) -> None:
    run = launch("--scene", scene, "--reaches", "1", "--seed", "3", script="launch_rnn.py")
    assert run.end(120.0) == 0, run.text
    summary = json.loads((run.out / "summary.json").read_text())
    assert summary["outcome"] == "reached"
    assert summary["planner"] == DEFAULT_POLICY
    (reach,) = summary["reaches"]
    assert reach["goal_error_m"] <= 0.01
    assert reach["min_clearance_m"] > 0.0
    assert reach["max_handover_jump_rad"] < 5e-3
    assert (run.out / "picture.png").stat().st_size > 10_000
    reader = BagReader(run.out / "bag")
    assert {"/policy/status", "/joint_states", "/sim/state"} <= set(reader.topics)
    assert ("/policy/goal" in reader.topics) == (scene != "sequence")
    for message in reader.messages({"/diagnostics"}):
        for status in message.decode().status:
            figures = {value.key: value.value for value in status.values}
            assert figures.get("compiled_late", "") == "", f"{status.name} waited for a compiler"
    record = earlier_run(run.out).record
    assert record.goals is not None
    assert (len(record.goals) > 1) == (scene != "sequence")
    assert np.isfinite(record.q).all()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--scene", "dance"], "one of sequence, switch, handover"),
        (["--policy", "rnn_none"], DEFAULT_POLICY),
        (["--policy", "missing.npz"], "missing.npz"),
        (["--scene", "switch", "--human", "replay", "--human-file", "x.npz"], "sequence"),
        (["--human", "robot"], "simulated, replay"),
    ],
)
def test_what_does_not_fit_is_named(tmp_path: Path, options: list[str], words: str) -> None:
    result = CliRunner().invoke(app, ["--out", str(tmp_path / "run"), *options])
    said = result.output + str(result.exception)
    assert result.exit_code == 1
    assert words in " ".join(said.split())
