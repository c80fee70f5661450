"""The node of two simulated people, in lock-step; and a bag of it as training data."""

import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from hri_prediction.bags.arms import ARM_TYPE, sample_of
from hri_prediction.bags.metadata import OfferedQos, TopicInfo
from hri_prediction.bags.writer import BagWriter
from hri_prediction.errors import ConfigError
from hri_prediction.ros.messages import HumanArm, Reset
from hri_sim.nodes.dyad_node import DyadNode
from hri_sim.policies.recordings import load_encounters
from hri_sim.testing import Graph, node_factory

NAMES = ("person1", "person2")


@pytest.fixture
def graph() -> Iterator[Graph]:
    parameters = {"seed": 3, "pause": 0.4, "encounters": 2}
    with Graph([node_factory(DyadNode, parameters=parameters)]) as made:
        yield made


def keypoints(messages: list[HumanArm]) -> np.ndarray:
    """Those of all (n, 4, 3) [m]."""
    return np.array([sample_of(message).keypoints for message in messages])


def stamps(messages: list[HumanArm]) -> np.ndarray:
    return np.array([sample_of(message).stamp_ns for message in messages])


def test_two_people_are_tracked_beside_their_truth(graph: Graph) -> None:
    graph.run(2.0)
    lists = graph.messages("/humans/bodies/tracked")
    assert {tuple(ids.ids) for ids in lists} == {NAMES}
    assert len(lists) == 51  # one every 40 ms
    for name in NAMES:
        truth = graph.messages(f"/sim/bodies/{name}/arm")
        tracked = graph.messages(f"/humans/bodies/{name}/arm")
        assert (np.diff(stamps(truth)) == 4_000_000).all()
        assert (np.diff(stamps(tracked)) == 4_000_000).all()
        assert 495 <= len(tracked) < len(truth) <= 505  # latency, and the lead of the truth
        assert tracked[0].side == "right"
        true = keypoints(truth)[: len(tracked)]
        error = keypoints(tracked) - true
        assert np.nanstd(error) == pytest.approx(0.002, rel=0.1)
        assert np.abs(true[..., 0] - 0.85).max() < 1.0
    one, other = (keypoints(graph.messages(f"/sim/bodies/{name}/arm")) for name in NAMES)
    assert one[0, 0, 1] < -0.4 < 0.4 < other[0, 0, 1]  # opposite each other


def test_a_reset_with_the_same_seed_is_the_same_again(graph: Graph) -> None:
    node = graph.nodes["dyad"]
    assert isinstance(node, DyadNode)
    graph.run(0.1)
    runs = []
    for seed in (3, 3, 4):
        answer = node._on_reset(Reset.Request(seed=seed), Reset.Response())
        assert answer.success
        before = len(graph.messages("/humans/bodies/person1/arm"))
        graph.run(0.9)
        runs.append(keypoints(graph.messages("/humans/bodies/person1/arm")[before:])[-100:])
    np.testing.assert_array_equal(runs[0], runs[1])
    assert np.nanmax(np.abs(runs[0] - runs[2])) > 0.02
    answer = node._on_reset(Reset.Request(seed=1, scenario="table.yaml"), Reset.Response())
    assert not answer.success
    assert "a dyad has none" in answer.message


@pytest.mark.parametrize(("jump_s", "word"), [(-100.0, "back"), (40_000.0, "on by 40000 s")])
def test_a_clock_that_jumps_begins_anew_and_holds_nothing_up(
    graph: Graph, jump_s: float, word: str
) -> None:
    graph.run(1.0)
    node = graph.nodes["dyad"]
    begin = time.monotonic()
    node.tick(round((graph.now_s + jump_s) * 1e9))
    assert time.monotonic() - begin < 2.0
    assert any(f"clock went {word}" in fault for fault in node.faults)


def test_what_is_said_can_be_learnt_from(graph: Graph, tmp_path: Path) -> None:
    graph.run(7.0)
    _, text, figures = graph.nodes["dyad"].health()
    assert (text, figures["encounters"]) == ("at rest", 2)
    with BagWriter(tmp_path / "bag") as writer:
        for name in NAMES:
            topic = f"/humans/bodies/{name}/arm"
            qos = OfferedQos(depth=50, reliability="best_effort")
            channel = writer.add_topic(TopicInfo(topic, ARM_TYPE, (qos,)))
            for count, (time_ns, data) in enumerate(graph.log[topic], start=1):
                writer.write(channel, data, time_ns, sequence=count)
        writer.close()
    found = load_encounters(tmp_path / "bag")
    assert len(found) == 4
    assert {one.encounter.pair for one in found} == {"person1 and person2"}


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("ids", ["ann"], "two different names"),
        ("ids", ["ann", "ann"], "two different names"),
        ("ids", ["ann", "b o b"], "body 'b o b'"),
        ("arrangement", "above", "one of opposite, corner, beside"),
        ("place", "0,0", "X,Y,Z,YAW"),
        ("pause", 0.0, "pause"),
    ],
)
def test_what_cannot_be_is_one_clear_line(name: str, value: object, words: str) -> None:
    with pytest.raises(ConfigError, match=words) as caught:
        Graph([node_factory(DyadNode, parameters={name: value})])
    assert "\n" not in str(caught.value)
