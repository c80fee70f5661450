"""Sources of motion capture that end, bodies that come and go: nobody is forgotten in the robot's way."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from motions import (
    finish,
    largest_reference_step,
    newest_speed,
    run_into_motion,
    start_reach,
    stop_time_ms,
)
from tampering import Tracker

from hri_planner.nodes.ptomp_node import PtompNode
from hri_prediction.nodes.predictor_node import PredictorNode
from hri_prediction.ros.messages import ReachTarget
from hri_prediction.tracks.files import save_tracks
from hri_prediction.tracks.track import ArmTrack
from hri_sim.nodes.replayer_node import ReplayerNode
from hri_sim.scenario.schema import Scenario
from hri_sim.testing import Graph, cue, node_factory, reach
from hri_sim.testing.spoiling import STILL, EmptyRoom


@pytest.fixture
def alone(scenario: Scenario) -> Scenario:
    """The scenario without its people."""
    quiet = scenario.reaches[0].model_copy(update={"person_target": None})
    return scenario.model_copy(update={"persons": (), "reaches": (quiet,)})


def test_a_replay_that_is_ended_in_order_stops_the_robot(
    make_graph: Callable[..., Graph], alone: Scenario, tmp_path: Path
) -> None:
    time_s = np.arange(200) / 100.0
    track = ArmTrack(time_s, np.broadcast_to(STILL, (200, 4, 3)), side="left")
    save_tracks(tmp_path / "still.npz", [track])
    replayer = node_factory(ReplayerNode, parameters={"file": str(tmp_path / "still.npz")})
    graph = make_graph(scenario=alone, sensors=[replayer])
    graph.run(0.4)
    handle = reach(graph, alone, 0)
    run_into_motion(graph)
    ended = graph.now_s
    graph.kill("replayer")  # closes it, as SIGTERM does
    graph.run(0.8)
    took = stop_time_ms(graph, ended)
    assert took <= 200.0
    result = finish(graph, handle)
    assert result.outcome == ReachTarget.Result.LOST_INPUT
    assert "person1" in result.reason
    assert np.abs(newest_speed(graph)).max() < 0.02
    print(f"replay ended in order: at rest after {took:.0f} ms")


def test_a_name_that_no_topic_can_have_stops_the_robot_and_ends_no_node(
    make_graph: Callable[..., Graph], scenario: Scenario
) -> None:
    graph = make_graph(others=[node_factory(EmptyRoom)])
    room = graph.nodes["empty_room"]
    assert isinstance(room, EmptyRoom)
    room.says_so = True
    graph.run(0.4)
    handle = start_reach(graph, scenario)
    run_into_motion(graph)
    named = graph.now_s
    room.ids = ["person1", "body-7"]
    graph.run(0.3)
    assert stop_time_ms(graph, named) <= 200.0
    for name in ("predictor", "ptomp"):
        assert any("'body-7'" in fault for fault in graph.nodes[name].faults), name
    assert "body-7" in graph.messages("/ptomp/status")[-1].reason
    room.ids = ["person1"]
    assert finish(graph, handle).outcome == ReachTarget.Result.REACHED


def test_bodies_that_come_and_go_make_room_for_others() -> None:
    def heard(node: str) -> list[str]:
        return [
            topic for topic in graph.nodes[node].received if topic.startswith("/humans/bodies/")
        ]

    with Graph([Tracker, PredictorNode, PtompNode], timeout_s=5.0) as graph:
        tracker = graph.nodes["tracker"]
        assert isinstance(tracker, Tracker)
        # More than are followed at the same time; the first one comes back in the end.
        for body_id in [*(f"person{number}" for number in range(10)), "person0"]:
            begin = len(graph.log.get(topic := f"/humans/bodies/{body_id}/prediction", ()))
            tracker.see("guest", body_id)
            graph.run(0.1)
            assert len(graph.log[topic]) - begin >= 3
            assert not graph.nodes["predictor"].faults
            bodies = ["guest", body_id]
            tracked = "/humans/bodies/tracked"
            arms = [f"/humans/bodies/{name}/arm" for name in bodies]
            predictions = [f"/humans/bodies/{name}/prediction" for name in bodies]
            assert heard("predictor") == [tracked, *arms]
            assert heard("ptomp") == [tracked, *predictions]
            assert [
                name
                for name in graph.nodes["predictor"].publishers_by_topic
                if name.startswith("/humans/bodies/")
            ] == predictions
            assert set(graph.nodes["ptomp"]._heard.people_heard()) == set(bodies)
        assert len(graph.log["/humans/bodies/person0/prediction"]) < 12
        # The one who stayed was predicted all the time.
        assert len(graph.log["/humans/bodies/guest/prediction"]) >= 11 * 4


def test_a_replay_that_faces_away_from_the_librarys_people_is_named(
    library: Path, tmp_path: Path
) -> None:
    time_s = np.arange(300) / 50.0
    arm = [[0.0, 0.0, 0.4], [0.25, 0.0, 0.2], [0.5, 0.0, 0.2], [0.59, 0.0, 0.2]]
    track = ArmTrack(time_s, np.broadcast_to(arm, (300, 4, 3)))
    save_tracks(tmp_path / "away.npz", [track])
    nodes = [
        node_factory(PredictorNode, parameters={"library": str(library)}),
        node_factory(ReplayerNode, parameters={"file": str(tmp_path / "away.npz")}),
    ]
    with Graph(nodes, timeout_s=20.0) as graph:
        graph.run(4.0)
        predictor = graph.nodes["predictor"]
        assert "person1 turned" not in predictor.health()[2]
        graph.run(2.0)
        assert "another YAW" in predictor.health()[2]["person1 turned"]
        assert not predictor.faults


def test_a_person_who_has_reached_often_takes_no_longer_to_tick(
    make_graph: Callable[..., Graph], scenario: Scenario
) -> None:
    quick = scenario.reaches[0].model_copy(update={"person_delay": 0.0, "person_duration": 0.2})
    scene = scenario.model_copy(update={"reaches": (quick,)})
    graph = make_graph(scenario=scene)
    graph.run(0.1)
    person = graph.nodes["person"]
    kept = []
    for _ in range(12):
        cue(graph, scene, 0)
        graph.run(0.4)
        kept.append(person.health()[2]["reaches_kept"])
    assert not person.faults
    assert kept[0] == 1
    assert max(kept) <= 4  # those of the last second, and the one before


@pytest.mark.parametrize(
    ("separation", "status"), [("off", "/ptomp/status"), ("assumed", "/separation/status")]
)
def test_a_source_that_falls_silent_after_it_said_that_nobody_is_there_stops_the_robot(
    make_graph: Callable[..., Graph], alone: Scenario, separation: str, status: str
) -> None:
    """Somebody may have come since, and nobody would say so."""
    graph = make_graph(scenario=alone, separation=separation, sensors=[node_factory(EmptyRoom)])
    room = graph.nodes["empty_room"]
    assert isinstance(room, EmptyRoom)
    room.says_so = True
    graph.run(0.6)
    handle = start_reach(graph, alone)
    run_into_motion(graph)
    killed = graph.now_s
    graph.kill("empty_room")
    graph.run(0.8)
    took = stop_time_ms(graph, killed)
    assert took <= 200.0
    assert largest_reference_step(graph) < 0.02
    assert finish(graph, handle).outcome == ReachTarget.Result.LOST_INPUT
    assert "nothing says any longer who is tracked" in graph.messages(status)[-1].reason
    print(f"{separation}: at rest after {took:.0f} ms")
