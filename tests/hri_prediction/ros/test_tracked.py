"""Who is tracked is said again and again, by each source."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from typing import Any

import pytest
from std_msgs.msg import Header

from hri_prediction.ros.messages import IdsList
from hri_prediction.ros.node import HriNode
from hri_prediction.ros.qos import LATCHED, LISTS
from hri_prediction.ros.time import to_time
from hri_prediction.ros.tracked import TRACKED, TrackedList
from hri_sim.testing.graph import Graph

MS = 1_000_000


class Source(HriNode):
    """Says who is tracked from its first tick on."""

    ids = ("ann",)

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(type(self).__name__.lower(), period_s=0.004, **kwargs)
        self.list: TrackedList | None = None

    def on_tick(self, now_ns: int) -> None:
        if self.list is None:
            self.list = TrackedList(self, self.ids)
        self.list.say(now_ns)


class Listener(HriNode):
    """Notes what is said, and when [ms]."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("listener", period_s=0.004, **kwargs)
        self.heard: list[tuple[float, tuple[str, ...]]] = []
        self.listen(IdsList, TRACKED, self._note, LISTS)

    def _note(self, message: IdsList) -> None:
        self.heard.append((self.tick_ns / MS, tuple(message.ids)))

    def on_tick(self, now_ns: int) -> None:
        pass

    def since(self, ms: float) -> set[tuple[str, ...]]:
        return {ids for when, ids in self.heard if when > ms}


@pytest.fixture
def graph() -> Iterator[Graph]:
    with Graph([Source, Listener], timeout_s=5.0) as made:
        yield made


def test_a_list_is_said_every_40_ms(graph: Graph) -> None:
    graph.run(1.0)
    listener = graph.nodes["listener"]
    assert isinstance(listener, Listener)
    whens = [when for when, _ in listener.heard]
    gaps = {round(after - before) for before, after in itertools.pairwise(whens)}
    assert gaps == {40}
    assert listener.since(0.0) == {("ann",)}


def test_a_change_is_said_at_once(graph: Graph) -> None:
    graph.run(0.2)
    source, listener = graph.nodes["source"], graph.nodes["listener"]
    assert isinstance(source, Source)
    assert isinstance(listener, Listener)
    assert source.list is not None
    now_ms = graph.now_s * 1e3
    source.list.change(["ann", "bob"])
    graph.run(0.1)
    assert listener.since(now_ms) == {("ann", "bob")}
    assert min(when for when, _ in listener.heard if when > now_ms) <= now_ms + 8.0


@pytest.mark.parametrize("stamped", [True, False])
def test_a_source_says_its_list_whatever_others_say(graph: Graph, stamped: bool) -> None:
    listener = graph.nodes["listener"]
    assert isinstance(listener, Listener)
    graph.run(0.2)
    stamp = to_time(round(graph.now_s * 1e9)) if stamped else to_time(0)
    graph.publish(IdsList, TRACKED, IdsList(header=Header(stamp=stamp), ids=["bob"]), LATCHED)
    graph.run(0.02)
    since = graph.now_s * 1e3
    graph.run(0.3)
    assert listener.since(since) == {("ann",)}


class Other(Source):
    """Another one, that begins with the first."""

    ids = ("bob",)


def test_two_sources_that_begin_together_are_both_heard() -> None:
    with Graph([Source, Other, Listener], timeout_s=5.0) as graph:
        graph.run(0.2)
        listener = graph.nodes["listener"]
        assert isinstance(listener, Listener)
        since = graph.now_s * 1e3
        graph.run(0.2)
        assert listener.since(since) == {("ann",), ("bob",)}
        graph.kill("other")
        since = graph.now_s * 1e3 + 8.0
        graph.run(0.2)
        assert listener.since(since) == {("ann",)}
