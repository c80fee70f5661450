"""The interaction monitor in lock-step: what goes wrong with bodies, samples, clocks and files."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hri_prediction.errors import ConfigError, DataError
from hri_prediction.geometry.minimum_jerk import minimum_jerk
from hri_prediction.nodes.interaction_monitor_node import InteractionMonitorNode
from hri_prediction.ontology.classifier import InteractionClassifier
from hri_prediction.ontology.shipped import SHIPPED
from hri_prediction.ros.messages import HumanArm, IdsList, InteractionCase, LoadModel
from hri_prediction.ros.node import HriNode
from hri_prediction.ros.qos import LATCHED, SENSOR
from hri_prediction.ros.time import NANO, to_ns
from hri_sim.testing import Graph, node_factory

CASE, FEATURES = "/interaction/case", "/interaction/features"


def said(graph: Graph, state: int) -> list[InteractionCase]:
    return [m for m in graph.messages(CASE) if m.state == state]


class Someone(HriNode):
    """Sends what it is told, as a source of people."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("someone", period_s=0.004, **kwargs)
        self.ids = self.announce(IdsList, "humans/bodies/tracked", LATCHED)
        self.arms = {
            name: self.announce(HumanArm, f"humans/bodies/{name}/arm", SENSOR)
            for name in ("a", "b", "c")
        }
        self.seen: tuple[str, ...] = ("a", "b")
        self.side = "right"
        self.shift_ns = 0
        self.frame = "world"
        self.places = "abc"
        self.unseen: dict[str, tuple[int, ...]] = {}
        self.height: Callable[[float], float] = lambda seconds: 0.2 * math.sin(4.0 * seconds)
        self.order = (0, 1, 2, 3)
        self.every = 1
        self.ticks = 0

    def tell(self, *names: str) -> None:
        self.ids.publish(IdsList(ids=list(names)))

    def on_tick(self, now_ns: int) -> None:
        self.ticks += 1
        for name in self.seen if self.ticks % self.every == 0 else ():
            points = np.zeros((4, 3))
            points[:, 0] = np.arange(4) * 0.2
            place = self.places.index(name)
            points[:, 1] = 0.6 * (place + 1)
            points[:, 2] = self.height(now_ns / NANO) * (place == 0)
            message = HumanArm(
                body_id=name,
                side=self.side,
                keypoints=points[list(self.order)].ravel(),
                valid=[index not in self.unseen.get(name, ()) for index in range(4)],
            )
            stamp_ns = now_ns + self.shift_ns
            message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp_ns, NANO)
            message.header.frame_id = self.frame
            self.arms[name].publish(message)

    def health(self) -> tuple[bytes, str, dict[str, Any]]:
        return b"\x00", "", {}


@pytest.fixture
def people() -> Iterator[tuple[Graph, Someone]]:
    with Graph([node_factory(Someone), node_factory(InteractionMonitorNode)]) as graph:
        someone = graph.nodes["someone"]
        assert isinstance(someone, Someone)
        yield graph, someone


def reason(graph: Graph) -> str:
    graph.run(0.7)
    return str(graph.messages(CASE)[-1].reason)


def health(graph: Graph) -> tuple[str, dict[str, Any]]:
    _, words, figures = graph.nodes["interaction_monitor"].health()
    return words, figures


def test_bodies_that_come_and_go(people: tuple[Graph, Someone]) -> None:
    graph, someone = people
    assert reason(graph) == "no source has said who is tracked"
    someone.tell()
    assert reason(graph) == "nobody is tracked; an interaction needs two"
    someone.tell("a")
    assert reason(graph) == "only a is tracked; an interaction needs two"
    someone.tell("a", "b")
    graph.run(2.0)
    assert graph.messages(FEATURES)
    assert health(graph)[0] == "watching a and b"
    # A third one changes nothing, and is named for as long as it is there.
    someone.seen = ("a", "b", "c")
    someone.tell("c", "a", "b")
    graph.run(0.5)
    assert "3 bodies are tracked (a, b, c): a and b are watched" in _faults(graph)
    graph.run(8.0)
    words, figures = health(graph)
    assert words == "watching a and b"
    assert figures["besides"].startswith("3 bodies are tracked")
    # One is lost: said first as not seen, then as not tracked; the third takes the place.
    someone.seen = ("a", "c")
    assert reason(graph).startswith("b was last seen 0.")
    someone.tell("a", "c")
    graph.run(1.0)
    assert health(graph)[0] == "watching a and c"
    assert graph.messages(FEATURES)[-1].second == "c"


def test_others_are_watched_when_a_source_has_ended(people: tuple[Graph, Someone]) -> None:
    """Its bodies stay listed, as nobody knows who is there; two who are seen are watched meanwhile."""
    graph, someone = people
    someone.seen = ("a", "b", "c")
    someone.tell("a", "b", "c")
    graph.run(1.0)
    assert health(graph)[0] == "watching a and b"
    someone.seen = ("b", "c")
    graph.run(1.5)
    assert health(graph)[0].startswith("a was last seen 1.")
    graph.run(1.5)
    assert health(graph)[0] == "watching b and c"
    assert set(graph.messages(FEATURES)[-1].first + graph.messages(FEATURES)[-1].second) == {
        "b",
        "c",
    }
    # With one alone there is nobody else to watch.
    someone.seen = ("b",)
    graph.run(3.0)
    assert health(graph)[0].startswith("c was last seen ")
    # Whoever is listed and seen again can be.
    someone.seen = ("a", "b")
    someone.tell("a", "b", "c")
    graph.run(3.0)
    assert health(graph)[0] == "watching a and b"


def test_arms_that_are_hidden_are_named(people: tuple[Graph, Someone]) -> None:
    """Samples go on coming, and say that nothing is seen."""
    graph, someone = people
    someone.tell("a", "b")
    graph.run(1.0)
    assert someone_moves(graph) == "a"
    someone.unseen = {"a": (0, 1, 2, 3)}
    graph.run(0.3)
    (ended,) = [m for m in graph.messages(CASE) if m.reason == "the arm was lost sight of"]
    assert (ended.first, ended.state) == ("a", InteractionCase.NONE)
    before = len(said(graph, InteractionCase.RUNNING))
    assert reason(graph) == (
        "the right shoulder and elbow and wrist and hand tip of a are not seen"
    )
    assert len(said(graph, InteractionCase.RUNNING)) == before
    someone.unseen = {"b": (1,)}
    assert reason(graph) == "the right elbow of b is not seen"
    assert health(graph)[0] == "the right elbow of b is not seen"
    someone.unseen = {}
    graph.run(3.0)
    assert health(graph)[0] == "watching a and b"
    assert said(graph, InteractionCase.RUNNING)[before:]


def test_names_that_are_no_part_of_topics_are_not_watched(people: tuple[Graph, Someone]) -> None:
    graph, someone = people
    someone.tell("1", "anna-2", "a", "a")
    assert reason(graph) == "only a is tracked; an interaction needs two"
    assert "body 'anna-2' is not watched: its name is no part of topics" in _faults(graph)
    someone.tell("a", "a", "b")
    graph.run(0.7)
    assert health(graph)[0] == "watching a and b"


def test_what_is_too_short_is_refused_once(people: tuple[Graph, Someone]) -> None:
    graph, someone = people
    someone.height = lambda seconds: 0.06 * float(np.clip((seconds - 2.0) / 0.12, 0.0, 1.0))
    someone.tell("a", "b")
    graph.run(4.0)
    (short,) = [m for m in graph.messages(CASE) if to_ns(m.end)]
    assert (short.first, short.state, short.number) == ("a", InteractionCase.NONE, 0)
    assert short.reason.startswith("too short: 0.")
    assert 1.9e9 < to_ns(short.onset) < to_ns(short.end) < 2.3e9
    assert health(graph)[1]["refused: too short"] == 1
    assert "movements" not in health(graph)[1]


@pytest.mark.parametrize(
    ("until_s", "state", "words"),
    [
        (2.66, InteractionCase.COMPLETE, ""),  # as slow as at rest
        (2.3, InteractionCase.NONE, "the arm was lost sight of"),  # at its fastest
    ],
)
def test_who_is_not_heard_of_any_more_is_not_waited_for(
    people: tuple[Graph, Someone], until_s: float, state: int, words: str
) -> None:
    """A source that ends in a movement, or right after one: told once, like that of a recording."""
    graph, someone = people
    someone.height = lambda seconds: 0.3 * float(minimum_jerk((seconds - 2.0) / 0.6))
    someone.tell("a", "b")
    graph.run(until_s - 1.0)  # it began at 1
    someone.seen = ()
    graph.run(0.4)
    assert not [m for m in graph.messages(CASE) if to_ns(m.end)]
    graph.run(3.0)
    (told,) = [m for m in graph.messages(CASE) if to_ns(m.end)]
    assert (told.first, told.state) == ("a", state)
    assert words in told.reason
    assert bool(told.number) == (state == InteractionCase.COMPLETE)
    # How late that was told says nothing of how long telling takes.
    assert "latency_ms_p50" not in health(graph)[1]
    # Samples that come again are no end of the same movement.
    someone.seen = ("a", "b")
    graph.run(2.0)
    assert len([m for m in graph.messages(CASE) if to_ns(m.end)]) == 1


def test_samples_that_come_too_seldom_are_named(people: tuple[Graph, Someone]) -> None:
    """A movement in them would be cut anywhere."""
    graph, someone = people
    someone.every = 20
    someone.tell("a", "b")
    graph.run(6.0)
    words = "samples come at 12.5 Hz, too seldom to find reaches"
    assert health(graph)[0] == f"a: {words}"
    assert f"a: {words}" in [m.reason for m in graph.messages(CASE)[-3:]]
    assert not said(graph, InteractionCase.COMPLETE)
    assert {m.reason for m in graph.messages(CASE) if to_ns(m.end)} == {words}
    someone.every = 1
    graph.run(3.0)
    assert health(graph)[0] == "watching a and b"
    assert said(graph, InteractionCase.COMPLETE)


def test_nothing_is_told_twice_of_one_whose_partner_is_not_heard(
    people: tuple[Graph, Someone],
) -> None:
    graph, someone = people
    someone.tell("a", "b")
    graph.run(1.0)
    someone_moves(graph)
    someone.seen = ("a",)
    graph.run(0.05)
    before = said(graph, InteractionCase.RUNNING)
    graph.run(0.4)
    after = said(graph, InteractionCase.RUNNING)[len(before) :]
    assert len(after) <= 1  # what the last sample of b had still to be told
    assert graph.messages(CASE)[-1].state != InteractionCase.RUNNING or not after


def test_identities_that_swap_at_rest_are_named(people: tuple[Graph, Someone]) -> None:
    graph, someone = people
    someone.places = "cab"  # who is first moves, and that is nobody here
    someone.tell("a", "b")
    graph.run(1.0)
    someone.places = "cba"
    graph.run(0.3)
    assert "a: the wrist jumped by 0.6" in _faults(graph)


def test_people_unlike_any_that_were_learnt_are_said_to_be(people: tuple[Graph, Someone]) -> None:
    graph, someone = people
    someone.tell("a", "b")
    someone.places = "axxb"  # farther apart than anybody who was learnt
    graph.run(4.0)
    complete = said(graph, InteractionCase.COMPLETE)
    assert complete
    for message in complete:
        assert message.reason.startswith("unlike what was learnt: ")
        assert message.number
    assert health(graph)[1]["unlike what was learnt"] == len(complete)


def test_the_other_arm_is_not_watched_and_named(people: tuple[Graph, Someone]) -> None:
    graph, someone = people
    someone.side = "left"
    someone.tell("a", "b")
    assert reason(graph) == "no right arm of a has been seen yet; its left arm is"


def test_markers_that_cannot_be_are_named(people: tuple[Graph, Someone]) -> None:
    graph, someone = people
    someone.tell("a", "b")
    graph.run(2.0)
    someone.order = (0, 2, 1, 3)
    graph.run(0.08)
    assert "a: markers swapped" in _faults(graph)
    someone.order = (0, 1, 2, 3)
    graph.run(0.5)
    assert health(graph)[0] == "watching a and b"
    assert not [m for m in graph.messages(CASE) if m.reason == "the arm was lost sight of"]


def test_swapped_identities_refuse_what_is_under_way(people: tuple[Graph, Someone]) -> None:
    graph, someone = people
    someone.tell("a", "b")
    graph.run(1.1)
    someone.places = "bac"
    graph.run(1.0)
    (refused,) = [m for m in graph.messages(CASE) if m.reason.startswith("the wrist jumped by 0.6")]
    assert (refused.first, refused.state) == ("a", InteractionCase.NONE)
    assert to_ns(refused.onset) < to_ns(refused.end)
    assert health(graph)[1]["refused: the wrist jumped"] == 1
    # Who moves is b from then on.
    before = len(said(graph, InteractionCase.COMPLETE))
    graph.run(3.0)
    assert {m.first for m in said(graph, InteractionCase.COMPLETE)[before:]} == {"b"}


def someone_moves(graph: Graph) -> str:
    """Wait until somebody's movement is under way; whose."""

    def running() -> list[InteractionCase]:
        newest = graph.messages(CASE)[-1:]
        return [m for m in newest if m.state == InteractionCase.RUNNING]

    graph.run_until(lambda: bool(running()), 5.0)
    return str(running()[0].first)


def _faults(graph: Graph) -> str:
    """What was wrong in the last seconds."""
    return "; ".join(graph.nodes["interaction_monitor"]._diagnostics.faults)


def test_clocks_and_frames(people: tuple[Graph, Someone]) -> None:
    graph, someone = people
    someone.tell("a", "b")
    graph.run(1.0)
    under_way = someone_moves(graph)
    someone.shift_ns = -3 * NANO
    graph.run(0.5)
    assert "went back by" in _faults(graph)
    # What was under way is not left without an end.
    ended = [m for m in graph.messages(CASE) if "went back by" in m.reason]
    assert (len(ended), ended[0].first) == (1, under_way)
    assert to_ns(ended[0].onset) < to_ns(ended[0].end)
    someone.shift_ns = NANO
    graph.run(0.2)
    assert "in the future" in _faults(graph)
    someone.shift_ns, someone.frame = 0, "lab"
    graph.run(0.7)
    assert "is in frame 'lab'" in _faults(graph)
    someone.frame = "world"
    graph.run(3.0)
    assert health(graph)[0] == "watching a and b"


def test_a_clock_that_goes_back_lets_nothing_be_new_for_ever(
    people: tuple[Graph, Someone],
) -> None:
    """A simulation begins anew, and nobody comes back: what was heard has stamps still to come."""
    graph, someone = people
    someone.tell("a", "b")
    graph.run(8.0)
    assert health(graph)[0] == "watching a and b"
    someone.seen = ()
    graph.shift_clock(-6.0)
    graph.run(0.1)
    assert "the clock went back by 5.9" in _faults(graph)
    assert health(graph)[0] == "no right arm of a has been seen yet"
    told = len(graph.messages(FEATURES))
    graph.run(1.0)
    assert len(graph.messages(FEATURES)) == told
    someone.seen = ("a", "b")
    graph.run(1.0)
    assert health(graph)[0] == "watching a and b"
    assert len(graph.messages(FEATURES)) > told


def test_features_are_told_once(people: tuple[Graph, Someone]) -> None:
    graph, someone = people
    someone.tell("a", "b")
    graph.run(2.0)
    someone.seen = ()
    graph.run(1.0)
    stamps = [to_ns(m.header.stamp) for m in graph.messages(FEATURES)]
    assert len(stamps) > 10
    assert len(set(stamps)) == len(stamps)


def test_who_was_never_seen_since_others_are_watched_gives_way(
    people: tuple[Graph, Someone],
) -> None:
    """A stale list names one whose source has ended: two others are there."""
    graph, someone = people
    someone.seen = ("b", "c")
    someone.tell("a", "b", "c")
    graph.run(1.0)
    assert health(graph)[0] == "no right arm of a has been seen yet"
    graph.run(3.0)
    assert health(graph)[0] == "watching b and c"


def test_another_classifier_is_loaded_while_it_runs(
    people: tuple[Graph, Someone], tmp_path: Path
) -> None:
    graph, someone = people
    path = tmp_path / "mine.npz"
    replace(InteractionClassifier.load(SHIPPED), about="my own place").save(path)
    someone.tell("a", "b")
    graph.run(3.0)
    name = "/interaction_monitor/load_model"
    answer = graph.call(LoadModel, name, LoadModel.Request(path=str(path)))
    assert answer.success
    assert answer.message == "20 cases, of my own place"
    assert health(graph)[1]["classifier"] == str(path)
    told = len(said(graph, InteractionCase.COMPLETE))
    # What cannot be used changes nothing.
    answer = graph.call(LoadModel, name, LoadModel.Request(path=str(tmp_path / "no.npz")))
    assert not answer.success
    assert "no.npz" in answer.message
    assert health(graph)[1]["classifier"] == str(path)
    graph.run(4.0)
    assert len(said(graph, InteractionCase.COMPLETE)) > told
    assert graph.call(LoadModel, name, LoadModel.Request()).success
    assert health(graph)[1]["classifier"] == str(SHIPPED)


def monitor_of(**parameters: Any) -> Graph:
    return Graph([node_factory(InteractionMonitorNode, parameters=parameters)])


def test_wrong_classifiers_and_pairs_are_refused(tmp_path: Path) -> None:
    junk = tmp_path / "junk.npz"
    junk.write_bytes(b"junk")
    with pytest.raises(DataError, match="hri-interaction-classifier-2"):
        monitor_of(classifier=str(junk))
    with pytest.raises(ConfigError, match="two different ids"):
        monitor_of(pair=["a"])
    with pytest.raises(ConfigError, match="part of topics"):
        monitor_of(pair=["a", "anna-2"])
    model = InteractionClassifier.load(SHIPPED)
    other = replace(model, classes=model.classes + 20)
    other.save(tmp_path / "other.npz")
    with pytest.raises(ConfigError, match="cases from 1 to 20"):
        monitor_of(classifier=str(tmp_path / "other.npz"))
