"""The command and the nodes: real ones that tick by the clock, and a graph in lock-step."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.executors import SingleThreadedExecutor
from std_msgs.msg import Float64

from hri_prediction.nodes.predictor_node import PredictorNode
from hri_prediction.ros.node import ERROR, OK, HriNode
from hri_prediction.ros.qos import reliable
from hri_prediction.ros.this_machine import PROFILE
from hri_sim.health.figures import NodeStatus
from hri_sim.health.watch import Row, Watch
from hri_sim.nodes.person_node import PersonNode
from hri_sim.testing import Graph, node_factory
from hri_sim.testing.domain import own_domain
from hri_sim.tools import watch_health
from hri_sim.tools.discovery import discovery, domain

DOMAIN = own_domain("watch_health")


class Talker(HriNode):
    """Ticks at 10 Hz, hears itself, and says what it is told to."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("talker", period_s=0.1, **kwargs)
        self.level, self.trouble = OK, ""
        self.out = self.announce(Float64, "number", reliable(10))
        self.listen(Float64, "number", lambda _: None, reliable(10))

    def on_tick(self, now_ns: int) -> None:
        self.out.publish(Float64())
        if self.trouble:
            self.fault("joints", self.trouble)

    def health(self) -> tuple[bytes, str, dict[str, Any]]:
        return self.level, "talking", {}


@pytest.fixture
def here(monkeypatch: pytest.MonkeyPatch) -> None:
    """The test's own ROS domain."""
    monkeypatch.setenv("ROS_DOMAIN_ID", str(DOMAIN))
    # A node that spins in a thread of this process takes it away for seconds while processes are looked at.
    monkeypatch.setattr(watch_health, "stopped_nodes", lambda _: [])


@pytest.fixture
def talker(here: None) -> Iterator[Talker]:
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=DOMAIN)
    node = Talker(context=context)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    stop = threading.Event()

    def work() -> None:
        while not stop.is_set():
            executor.spin_once(timeout_sec=0.05)

    thread = threading.Thread(target=work)
    thread.start()
    yield node
    stop.set()
    thread.join()
    executor.shutdown()
    node.destroy_node()
    rclpy.try_shutdown(context=context)


def ended(*options: str) -> int:
    """Exit code of the command."""
    with pytest.raises(SystemExit) as end:
        watch_health.main(list(options))
    return int(end.value.code or 0)


def test_one_look_at_a_node(talker: Talker, capfd: pytest.CaptureFixture[str]) -> None:
    assert ended("--once", "--duration", "3.2", "--json") == 0
    (line,) = capfd.readouterr().out.splitlines()
    told = json.loads(line)
    (node,) = told["nodes"]
    assert (told["domain"], told["exit_code"]) == (str(DOMAIN), 0)
    assert (node["node"], node["state"], node["says"]) == ("/talker", "OK", "talking")
    assert 5.0 < node["inputs"]["/number"]["hz"] < 15.0
    assert 5.0 < node["sent_hz"]["/number"] < 15.0
    talker.trouble = "joint a is missing"
    assert ended("--once", "--duration", "2.5") == 3
    out = capfd.readouterr().out
    assert out.count("/talker") == 2  # in the table, and below
    assert "all seven joints" in " ".join(out.split())
    talker.level = ERROR
    assert ended("--once", "--duration", "2.5", "--node", "talker") == 1
    assert "ERROR" in capfd.readouterr().out


def test_text_goes_on_each_second(talker: Talker, capfd: pytest.CaptureFixture[str]) -> None:
    assert ended("--duration", "4.1", "--node", "talker", "--node", "ptomp") == 1
    out = capfd.readouterr().out
    assert 3 <= out.count("ROS domain") <= 5
    assert "not in the graph" in out
    assert "\x1b" not in out  # no colours in a file


def test_where_no_node_speaks(here: None, capfd: pytest.CaptureFixture[str]) -> None:
    assert ended("--once", "--duration", "1") == 1
    out, err = capfd.readouterr()
    assert out == ""
    assert f"ROS domain {DOMAIN}" in err
    assert discovery(os.environ) in err
    assert "scripts/launch_ptomp.py" in err


@pytest.mark.parametrize("options", [["--duration", "0"], ["--duration", "x"], ["--nodes"], ["x"]])
def test_options_that_make_no_sense(options: list[str], capfd) -> None:
    assert ended(*options) == 2
    assert "Usage" in capfd.readouterr().err


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_it_ends_quietly(talker: Talker, number: int) -> None:
    process = subprocess.Popen(
        [sys.executable, "-m", "hri_sim.tools.watch_health"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        assert process.stdout is not None
        assert "ROS domain" in process.stdout.readline()
        process.send_signal(number)
        _, err = process.communicate(timeout=10)
    finally:
        if process.poll() is None:
            process.kill()
            process.communicate()
    assert process.returncode == 0
    assert err == ""


@pytest.mark.parametrize(
    ("environment", "words"),
    [
        ({}, "local network"),
        ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}, "this machine alone"),
        ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "OFF"}, "no other node"),
        ({"ROS_LOCALHOST_ONLY": "1"}, "this machine alone"),
        ({"ROS_DISCOVERY_SERVER": "10.0.0.1:11811"}, "10.0.0.1:11811"),
        ({"ROS_STATIC_PEERS": "10.0.0.2"}, "and 10.0.0.2"),
        (
            {
                "ROS_AUTOMATIC_DISCOVERY_RANGE": "SYSTEM_DEFAULT",
                "FASTRTPS_DEFAULT_PROFILES_FILE": str(PROFILE),
            },
            "this machine alone",
        ),
        (
            {
                "ROS_AUTOMATIC_DISCOVERY_RANGE": "SYSTEM_DEFAULT",
                "FASTRTPS_DEFAULT_PROFILES_FILE": "/my.xml",
            },
            "/my.xml",
        ),
    ],
)
def test_where_nodes_are_looked_for(environment: dict[str, str], words: str) -> None:
    assert words in discovery(environment)
    assert domain(environment) == "0"


def said_wrong(row: Row) -> list[str]:
    """What a node says is wrong; that its ticks take long on a busy machine is seen from outside."""
    return [trouble.text for trouble in row.troubles if not trouble.seen_from_outside]


def test_a_graph_whose_person_is_lost() -> None:
    """What the predictor says when its samples stay away becomes a row with advice."""
    watch = Watch()
    with Graph([node_factory(PersonNode), PredictorNode]) as graph:

        def hear(message: DiagnosticArray) -> None:
            for item in message.status:
                values = {value.key: value.value for value in item.values}
                said = NodeStatus(item.name, item.level[0], item.message, values)
                watch.hear(said, graph.now_s)

        graph.nodes["predictor"].create_subscription(DiagnosticArray, "/diagnostics", hear, 10)

        def rows(done: Callable[[list[Row]], bool], seconds: float) -> dict[str, Row]:
            """Rows after a time of the graph; what was said in it is on its way for a moment."""
            graph.run(seconds)
            end = time.monotonic() + 5.0
            while not done(found := watch.rows(graph.now_s)) and time.monotonic() < end:
                graph.lockstep.executor.spin_once(timeout_sec=0.02)
            assert done(found)
            return {row.name: row for row in found}

        found = rows(lambda rows: len(rows) == 2 and not any(map(said_wrong, rows)), 2.2)
        figures = found["/predictor"].figures
        assert figures is not None
        (arm,) = (each for each in figures.inputs if each.topic == "/humans/bodies/person1/arm")
        assert arm.hz == pytest.approx(250.0, abs=5.0)
        assert 0.0 < arm.age_s < 0.1
        graph.kill("person")
        found = rows(lambda rows: rows[-1].says.count("no usable sample") == 1, 2.4)
        predictor = found["/predictor"]
        assert predictor.worst_input is not None
        assert predictor.worst_input.quiet_s > 1.0
        assert any("cameras" in trouble.do for trouble in predictor.troubles)
