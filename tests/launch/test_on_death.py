"""Nodes that are killed in a run which starts them again."""

from __future__ import annotations

import json
import time
from collections.abc import Callable

import pytest
from launched import Launched

Launch = Callable[..., Launched]


@pytest.mark.parametrize("name", ["person", "predictor", "ptomp", "recorder"])
def test_a_node_that_is_killed_is_started_again(launch: Launch, name: str) -> None:
    run = launch("--reaches", "3", "--seed", "100", "--on-death", "restart")
    run.wait_for("reach 1/3 · moving")
    time.sleep(0.3)
    run.nodes()[name].kill()
    run.wait_for(f"node {name} was ended by SIGKILL; it is started again", 5.0)
    assert run.end(150.0) in (0, 3), run.text
    reaches = json.loads((run.out / "summary.json").read_text())["reaches"]
    # What came of the first says the summary; those after it are as ever.
    assert [reach["outcome"] for reach in reaches[1:]] == ["reached", "reached"], run.text
    assert "Traceback" not in run.text
    if name == "recorder":
        assert (run.out / "bag_2" / "metadata.yaml").exists()


def test_trials_go_on_whichever_node_is_killed(launch: Launch) -> None:
    options = ("--experiment", "transfer", "--smoke", "--person", "ann", "--seed", "2")
    run = launch(*options, "--on-death", "restart", script="adapt_policy.py")
    killed = ("adaptation", "policy", "simulator", "observer", "recorder")
    run.wait_for("trials: ", 120.0)  # before all were ready a death would end it
    for done, name in enumerate(killed, start=2):
        run.wait_for_trials(done)
        time.sleep(2.0)
        run.nodes()[name].kill()
        run.wait_for(f"node {name} was ended by SIGKILL; it is started again", 5.0)
    assert run.end(150.0) == 0, run.text
    assert len(run.trials()) == 9
    assert "Traceback" not in run.text
    assert (run.out / "run_1" / "bag_2" / "metadata.yaml").exists()
