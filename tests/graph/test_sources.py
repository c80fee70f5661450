"""Sources of motion capture that end, bodies that come and go: nobody is forgotten in the robot's way."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from motions import finish, newest_speed, run_into_motion, stop_time_ms
from tampering import STILL

from hri_prediction.ros.messages import ReachTarget
from hri_prediction.tracks.files import save_tracks
from hri_prediction.tracks.track import ArmTrack
from hri_sim.nodes.replayer_node import ReplayerNode
from hri_sim.scenario.schema import Scenario
from hri_sim.testing import Graph, node_factory, reach


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
