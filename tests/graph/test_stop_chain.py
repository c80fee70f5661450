"""A node dies in mid-motion: the robot is at rest within 200 ms."""

import numpy as np
import pytest
from motions import (
    finish,
    joints,
    largest_reference_step,
    newest_speed,
    run_into_motion,
    start_reach,
    stop_time_ms,
)

from hri_prediction.errors import GraphError
from hri_prediction.ros.messages import ControllerState, ReachTarget
from hri_sim.scenario.schema import Scenario
from hri_sim.testing import Graph


@pytest.mark.parametrize("name", ["predictor", "person", "ptomp"])
@pytest.mark.parametrize("speed", [0.1, 0.6])
def test_robot_is_at_rest_soon_after_a_death(
    graph: Graph, scenario: Scenario, name: str, speed: float
) -> None:
    graph.run(0.4)
    start_reach(graph, scenario)
    run_into_motion(graph, speed)
    killed = graph.now_s
    graph.kill(name)
    graph.run(0.8)
    took = stop_time_ms(graph, killed)
    assert took <= 200.0
    _, q, _ = joints(graph)
    assert np.abs(q[-1] - q[-100]).max() < 1e-3  # and it stays there
    assert largest_reference_step(graph) < 0.02
    assert not any(m.contacts_human for m in graph.messages("/sim/state"))
    print(f"{name} killed at {speed} rad/s: at rest after {took:.0f} ms")


def test_the_controller_says_why_it_stopped(graph: Graph, scenario: Scenario) -> None:
    graph.run(0.4)
    start_reach(graph, scenario)
    run_into_motion(graph)
    graph.kill("ptomp")
    graph.run(0.3)
    newest = graph.messages("/joint_trajectory_controller/reference")[-1]
    assert newest.state == ControllerState.STOPPING
    assert newest.reason


def test_the_planner_gives_up_with_a_reason(graph: Graph, scenario: Scenario) -> None:
    graph.run(0.4)
    handle = start_reach(graph, scenario)
    run_into_motion(graph)
    graph.kill("predictor")
    result = finish(graph, handle, 4.0)
    assert result.outcome == ReachTarget.Result.LOST_INPUT
    assert "person1" in result.reason
    # A new goal is taken, waits for the input, and ends in the same way.
    again = finish(graph, start_reach(graph, scenario), 4.0)
    assert again.outcome == ReachTarget.Result.LOST_INPUT
    assert np.abs(newest_speed(graph)).max() < 1e-3


def test_robot_states_go_missing(graph: Graph, scenario: Scenario) -> None:
    graph.run(0.4)
    handle = start_reach(graph, scenario)
    run_into_motion(graph)
    graph.kill("simulator")
    result = finish(graph, handle, 4.0)
    assert result.outcome == ReachTarget.Result.LOST_INPUT
    assert "/joint_states" in result.reason


def test_kill_names_the_nodes_there_are(graph: Graph) -> None:
    with pytest.raises(GraphError, match="person, predictor, ptomp, simulator"):
        graph.kill("nobody")
