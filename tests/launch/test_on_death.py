"""Nodes that are killed in a run which starts them again."""

from __future__ import annotations

import json
import re
import time
from collections.abc import Callable

from launched import Launched, wait_until_moving

Launch = Callable[..., Launched]
KILLED = {"person": 1, "predictor": 4, "ptomp": 7, "recorder": 10}
"""Nodes, and in which reach each is killed."""


def test_a_node_that_is_killed_is_started_again(launch: Launch) -> None:
    """Of three reaches each, it is killed in the first: one run for all, as most of one is its start."""
    count = 3 * len(KILLED)
    run = launch("--reaches", str(count), "--seed", "100", "--on-death", "restart")
    spoilt: list[set[int]] = []
    for name, first in KILLED.items():
        run.wait_for(f"reach {first}/{count} ·", 60.0)
        wait_until_moving(run)
        run.nodes()[name].kill()
        ended = f"node {name} was ended by SIGKILL; it is started again"
        run.wait_for(ended, 5.0)
        # It is told now and then which reach it is: it was that one, or the one that has begun since.
        newest = int(re.findall(rf"reach (\d+)/{count}", run.text.split(ended)[0])[-1])
        spoilt.append({newest, newest + 1})
    assert run.end(150.0) in (0, 3), run.text
    reaches = json.loads((run.out / "summary.json").read_text())["reaches"]
    assert len(reaches) == count
    # What came of those reaches says the summary; the others are as ever.
    missed = {n for n, reach in enumerate(reaches, 1) if reach["outcome"] != "reached"}
    assert missed <= set().union(*spoilt), run.text
    assert all(len(missed & either) <= 1 for either in spoilt), run.text
    assert "Traceback" not in run.text
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
