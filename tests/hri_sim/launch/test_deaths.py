"""Nodes that end by themselves: who ends the run, and who is started again."""

from __future__ import annotations

import sys
import time
from pathlib import Path

import pytest

from hri_sim.launch.deaths import (
    MOST_STARTS,
    RESTART,
    START_DELAY_S,
    STOP,
    Deaths,
    NodeDeath,
    ended,
)
from hri_sim.launch.supervisor import NodeSpec, Supervisor


@pytest.fixture
def nodes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Supervisor:
    """Nodes that say what they were started with, and wait."""
    path = tmp_path / "lib" / "cell" / "node"
    path.parent.mkdir(parents=True)
    path.write_text(
        f"#!{sys.executable}\nimport sys, time\n"
        "print(open(sys.argv[-1]).read() if sys.argv[-1].endswith('.yaml') else 'ready', flush=True)\n"
        "time.sleep(60)\n"
    )
    path.chmod(0o755)
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path))
    return Supervisor(tmp_path / "run")


def kill(nodes: Supervisor, label: str) -> None:
    end = time.monotonic() + 10.0
    while not nodes.last_words(label):
        assert time.monotonic() < end
        time.sleep(0.01)
    nodes.kill(label)


def look_until_started(deaths: Deaths, nodes: Supervisor, label: str) -> None:
    end = time.monotonic() + 10.0
    while label not in nodes.pids:
        assert time.monotonic() < end
        deaths.look(begun=True)
        time.sleep(0.01)


def test_who_is_needed_ends_the_run(nodes: Supervisor) -> None:
    told: list[str] = []
    deaths = Deaths(nodes, told.append, STOP)
    with nodes:
        nodes.start(
            [
                NodeSpec("cell", "node", name="needed"),
                NodeSpec("cell", "node", name="spare", essential=False),
            ]
        )
        kill(nodes, "spare")
        deaths.look(begun=True)
        assert told == ["node spare was ended by SIGKILL; the run goes on"]
        kill(nodes, "needed")
        with pytest.raises(NodeDeath, match="node needed was ended by SIGKILL"):
            deaths.look(begun=True)
    assert told[1:] == ["node needed was ended by SIGKILL: the run ends"]
    assert not deaths.again


def test_who_dies_is_started_again_but_not_forever(nodes: Supervisor) -> None:
    told: list[str] = []
    deaths = Deaths(nodes, told.append, RESTART)
    with nodes:
        nodes.start([NodeSpec("cell", "node", name="needed")])
        before = nodes.pids["needed"]
        for _ in range(MOST_STARTS):
            kill(nodes, "needed")
            deaths.look(begun=True)
            assert deaths.again == {"needed"}
            look_until_started(deaths, nodes, "needed")
            assert nodes.pids["needed"] != before
        assert told == ["node needed was ended by SIGKILL; it is started again"] * MOST_STARTS
        assert nodes.died("needed")
        kill(nodes, "needed")
        with pytest.raises(NodeDeath):
            deaths.look(begun=True)


def test_before_the_run_has_begun_nobody_is_started_again(nodes: Supervisor) -> None:
    deaths = Deaths(nodes, lambda text: None, RESTART)
    with nodes:
        nodes.start([NodeSpec("cell", "node", name="needed")])
        kill(nodes, "needed")
        with pytest.raises(NodeDeath):
            deaths.look(begun=False)


def test_what_was_written_is_left_alone_and_the_log_goes_on(nodes: Supervisor) -> None:
    deaths = Deaths(nodes, lambda text: None, RESTART)
    spec = NodeSpec("cell", "node", {"output": "/x/bag"}, name="recorder", own_folder="output")
    with nodes:
        nodes.start([spec])
        for number in (2, 3):
            kill(nodes, "recorder")
            look_until_started(deaths, nodes, "recorder")
            end = time.monotonic() + 10.0
            while f"/x/bag_{number}" not in nodes.log_path("recorder").read_text():
                assert time.monotonic() < end
                time.sleep(0.01)
    assert nodes.log_path("recorder").read_text().count("output: /x/bag\n") == 1


def test_a_start_waits_until_the_robot_is_at_rest(nodes: Supervisor) -> None:
    deaths = Deaths(nodes, lambda text: None, RESTART)
    with nodes:
        nodes.start([NodeSpec("cell", "node", name="needed")])
        kill(nodes, "needed")
        deaths.look(begun=True)
        seen_s = time.monotonic()
        # Who waits for it meanwhile does not forget to start it.
        deaths.forget(starts=True)
        assert not deaths.again
        assert not nodes.pids
        look_until_started(deaths, nodes, "needed")
        assert time.monotonic() - seen_s >= START_DELAY_S - 0.02
    assert START_DELAY_S > 0.2


def test_a_death_is_told_once_before_and_after_the_node_is_started_again() -> None:
    before, dead, again = {"a": 1, "b": 2}, {"b": 2}, {"a": 3, "b": 2}
    assert ended(before, dead) == ["a"]
    assert ended(dead, again) == []
    assert ended(before, again) == ["a"]  # both between two looks
    assert ended(again, again) == []
