"""The test kit itself: users' own nodes, and errors that name node and topic."""

from __future__ import annotations

from typing import Any

import pytest
from std_msgs.msg import Float64, String

from hri_prediction.errors import GraphError
from hri_prediction.ros.node import CountedPublisher, HriNode
from hri_prediction.ros.qos import LATCHED, SENSOR, reliable
from hri_sim.testing import Graph, node_factory


class Source(HriNode):
    """Says a number on each tick."""

    def __init__(self, period_s: float = 0.004, qos: Any = None, **kwargs: Any) -> None:
        super().__init__("source", period_s=period_s, **kwargs)
        self._out = self.announce(Float64, "number", qos or reliable(10))
        self._count = 0

    def on_tick(self, now_ns: int) -> None:
        self._count += 1
        self._out.publish(Float64(data=float(self._count)))


class Doubler(HriNode):
    """A user's own node: two for one."""

    def __init__(self, period_s: float = 0.004, qos: Any = None, **kwargs: Any) -> None:
        super().__init__("doubler", period_s=period_s, **kwargs)
        self._values: list[float] = []
        self._out = self.announce(Float64, "double", reliable(10))
        self.listen(Float64, "number", self._on_number, qos or reliable(10))

    def _on_number(self, message: Float64) -> None:
        self._values.append(message.data)

    def on_tick(self, now_ns: int) -> None:
        for value in self._values:
            self._out.publish(Float64(data=2.0 * value))
        self._values.clear()


def test_own_nodes() -> None:
    with Graph([Source, Doubler]) as graph:
        graph.run(1.0)
        assert [m.data for m in graph.messages("/number")] == [float(i) for i in range(1, 251)]
        assert [m.data for m in graph.messages("/double")] == [2.0 * i for i in range(1, 251)]
        # In the same step: the source ticks first.
        assert [t for t, _ in graph.log["/number"]] == [t for t, _ in graph.log["/double"]]
        assert graph.now_s == pytest.approx(2.0)
        graph.publish(Float64, "number", Float64(data=0.5), reliable(10))
        graph.run(0.004)
        assert [m.data for m in graph.messages("/double")][-2:] in ([1.0, 502.0], [502.0, 1.0])


def test_slow_nodes_tick_when_due() -> None:
    with Graph([Source, node_factory(Doubler, 0.02)]) as graph:
        graph.run(0.1)
        assert len(graph.messages("/number")) == 25
        assert [m.data for m in graph.messages("/double")] == [2.0 * i for i in range(1, 26)]


@pytest.mark.parametrize("period", [0.003, 0.0, -0.004])
def test_a_period_that_does_not_fit(period: float) -> None:
    with pytest.raises(GraphError, match=r"source .*multiple of the base step, 0\.004 s"):
        Graph([node_factory(Source, period)])
    with Graph([Source]) as graph:  # and the failed one is in nobody's way
        graph.run(0.02)


def test_qos_that_does_not_match() -> None:
    factories = [node_factory(Source, 0.004, SENSOR), Doubler]
    with pytest.raises(GraphError, match=r"/number of node source .*doubler.*QoS"):
        Graph(factories, timeout_s=0.5)


def test_a_message_that_never_arrives() -> None:
    with Graph([Source, Doubler], timeout_s=0.3) as graph:
        graph.run(0.02)
        source = graph.nodes["source"]
        source.publishers_by_topic["/number"].sent += 1  # says that it spoke, and did not
        with pytest.raises(GraphError, match=r"node doubler has \d+ messages of /number"):
            graph.run(0.004)


class Late(HriNode):
    """Begins to listen, and to speak, in mid-run."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("late", period_s=0.004, **kwargs)
        self.heard: list[Any] = []
        self._ticks = 0
        self._out: CountedPublisher | None = None

    def on_tick(self, now_ns: int) -> None:
        self._ticks += 1
        if self._ticks == 10:
            self.listen(Float64, "number", self.heard.append, reliable(10))
            self.listen(String, "news", self.heard.append, LATCHED)
            self._out = self.announce(Float64, "late", reliable(10))
            self._out.publish(Float64(data=1.0))  # nobody can have it yet
        elif self._out is not None:
            self._out.publish(Float64(data=2.0))


class News(HriNode):
    """Latched: three messages before anybody listens."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("news", period_s=0.004, **kwargs)
        self._out = self.announce(String, "news", LATCHED)
        for text in ("one", "two", "three"):
            self._out.publish(String(data=text))

    def on_tick(self, now_ns: int) -> None:
        pass


def test_those_who_join_late() -> None:
    with Graph([News, Source, Late], timeout_s=2.0) as graph:
        graph.run(0.08)
        late = graph.nodes["late"]
        assert isinstance(late, Late)
        texts = [m.data for m in late.heard if isinstance(m, String)]
        numbers = [m.data for m in late.heard if isinstance(m, Float64)]
        assert texts == ["three"]
        assert numbers == [float(i) for i in range(11, 21)]
        assert [m.data for m in graph.messages("/late")][-10:] == [2.0] * 10


def test_listening_to_the_dead() -> None:
    with Graph([News, Source, Late], timeout_s=2.0) as graph:
        graph.run(0.02)
        graph.kill("news")
        graph.kill("source")
        graph.run(0.08)
        assert not graph.nodes["late"].faults


def test_a_clear_error_for_a_topic_nobody_has() -> None:
    with Graph([Source]) as graph, pytest.raises(GraphError, match=r"/nothing.*/number"):
        graph.messages("/nothing")


class Broken(HriNode):
    """Cannot be made."""

    def __init__(self, **kwargs: Any) -> None:
        raise GraphError("this node cannot be made")


def test_a_node_that_cannot_be_made_leaves_nothing_behind() -> None:
    for _ in range(3):
        with pytest.raises(GraphError, match="cannot be made"):
            Graph([Source, Broken])
    with Graph([Source, Doubler]) as graph:
        graph.run(0.02)
        assert len(graph.messages("/number")) == 5


def test_closing_twice_does_nothing() -> None:
    graph = Graph([Source])
    graph.close()
    graph.close()


class Burst(HriNode):
    """Says sixty numbers in each tick, more than a queue of sensor data is deep."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("burst", period_s=0.004, **kwargs)
        self._out = self.announce(Float64, "number", SENSOR)

    def on_tick(self, now_ns: int) -> None:
        for number in range(60):
            self._out.publish(Float64(data=float(number)))


def test_a_queue_keeps_the_newest_of_a_burst_and_the_log_all_of_it() -> None:
    with Graph([Burst, node_factory(Doubler, 0.004, SENSOR)]) as graph:
        for step in range(1, 4):
            graph.run(0.004)
            burst = [float(number) for number in range(60)]
            assert [m.data for m in graph.messages("/number")] == step * burst
            heard = [2.0 * number for number in burst[-SENSOR.depth :]]
            assert [m.data for m in graph.messages("/double")] == step * heard
