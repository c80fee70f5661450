"""What the separation monitor does about itself being late, and about joint states of two sources."""

from collections import deque
from collections.abc import Callable
from typing import Any

import pytest
from motions import run_into_motion, start_reach, stop_time_ms
from sensor_msgs.msg import JointState

from hri_planner.nodes.separation_monitor_node import PERIOD_S
from hri_prediction.ros.messages import SeparationStatus
from hri_prediction.ros.node import HriNode
from hri_prediction.ros.qos import SENSOR
from hri_prediction.ros.time import seconds_to_ns, to_ns
from hri_sim.scenario.schema import Scenario
from hri_sim.testing import Graph, node_factory

SCALE = "/separation/speed_scale"
STATUS = "/separation/status"


def scales(graph: Graph) -> list[float]:
    return [message.data for message in graph.messages(SCALE)]


@pytest.fixture
def graph_with_monitor(make_graph: Callable[..., Graph]) -> Graph:
    graph = make_graph(separation="measured")
    graph.run(0.6)
    return graph


@pytest.mark.parametrize(
    ("held_s", "said"),
    [
        ((0.0039, 0.0039), [1]),
        ((0.0041,), []),  # before it looks at the clock
        ((0.0, 0.0041), [1, 0]),  # between that and saying it
    ],
)
def test_what_was_decided_too_long_ago_is_not_said(
    graph_with_monitor: Graph,
    monkeypatch: pytest.MonkeyPatch,
    held_s: tuple[float, ...],
    said: list[int],
) -> None:
    graph = graph_with_monitor
    graph.run_until(lambda: scales(graph)[-1] > 0.0, 2.0)
    node = graph.nodes["separation_monitor"]
    before, unsaid = len(scales(graph)), node.health()[2]["unsaid"]
    looks = iter(held_s)
    monkeypatch.setattr(node, "held_s", lambda: next(looks, held_s[-1]))
    graph.run(PERIOD_S)
    assert [int(scale > 0.0) for scale in scales(graph)[before:]] == said
    assert node.health()[2]["unsaid"] - unsaid == (held_s[-1] > 0.004)
    # What was said before that is good for four ticks: only who was stopped is told.
    assert any("held up" in text for text in node.faults) == (0 in said)
    if 0 in said:
        newest = graph.messages(STATUS)[-1]
        assert (newest.state, newest.speed_scale) == (SeparationStatus.STOPPED, 0.0)
        assert "held up" in newest.reason


def test_a_monitor_that_is_always_held_up_stops_the_robot(
    graph_with_monitor: Graph, scenario: Scenario, monkeypatch: pytest.MonkeyPatch
) -> None:
    graph = graph_with_monitor
    start_reach(graph, scenario)
    run_into_motion(graph)
    monkeypatch.setattr(graph.nodes["separation_monitor"], "held_s", lambda: 0.02)
    begin = graph.now_s
    graph.run(0.8)
    assert stop_time_ms(graph, begin) <= 200.0
    assert "heartbeat" in graph.messages("/joint_trajectory_controller/reference")[-1].reason
    assert any("said nothing for" in text for text in graph.nodes["separation_monitor"].faults)


@pytest.mark.parametrize(("in_row", "told"), [(3, False), (5, True)])
def test_what_the_controller_bridges_is_only_counted(
    graph_with_monitor: Graph, monkeypatch: pytest.MonkeyPatch, in_row: int, told: bool
) -> None:
    graph = graph_with_monitor
    graph.run_until(lambda: scales(graph)[-1] > 0.0, 2.0)
    node = graph.nodes["separation_monitor"]
    before = node.health()[2]["unsaid"]
    for held_s, periods in ((0.02, in_row), (0.0, 1)):
        monkeypatch.setattr(node, "held_s", lambda held_s=held_s: held_s)
        graph.run(periods * PERIOD_S)
    assert node.health()[2]["unsaid"] - before == in_row
    assert any("said nothing for" in text for text in node.faults) == told


def test_one_long_hold_up_is_told(graph_with_monitor: Graph) -> None:
    """Wherever it was: between two ticks, or in the middle of one."""
    graph = graph_with_monitor
    graph.run_until(lambda: scales(graph)[-1] > 0.0, 2.0)
    node = graph.nodes["separation_monitor"]
    node.tick(seconds_to_ns(graph.now_s + 0.030))
    assert not any("held up" in text for text in node.faults)
    node.tick(seconds_to_ns(graph.now_s + 0.071))
    assert any("said nothing for 41 ms" in text for text in node.faults)


def test_joint_states_of_two_sources_stop_the_robot(make_graph: Callable[..., Graph]) -> None:
    """Even where both say the same, one of them late."""
    graph = make_graph(separation="measured", others=[node_factory(LateTwin)])
    graph.run(1.0)
    newest = graph.messages(STATUS)[-1]
    assert newest.state == SeparationStatus.STOPPED
    assert newest.reason == "/joint_states come from two sources that contradict each other"
    graph.kill("late_twin")
    graph.run(0.8)
    assert graph.messages(STATUS)[-1].state != SeparationStatus.STOPPED


class LateTwin(HriNode):
    """Says again what the robot's joints were a while ago, with the stamps of then."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("late_twin", period_s=0.004, **kwargs)
        self._heard: deque[JointState] = deque(maxlen=6)
        self._joints = self.announce(JointState, "joint_states", SENSOR)
        self.listen(JointState, "joint_states", self._hear, SENSOR)

    def _hear(self, message: JointState) -> None:
        if not self._heard or to_ns(message.header.stamp) > to_ns(self._heard[-1].header.stamp):
            self._heard.append(message)

    def on_tick(self, now_ns: int) -> None:
        if len(self._heard) == self._heard.maxlen:
            self._joints.publish(self._heard[0])
