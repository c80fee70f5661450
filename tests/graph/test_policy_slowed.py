"""A policy whose robot another slows, and one between two people."""

from collections.abc import Callable

import numpy as np
import pytest
from motions import (
    assert_finite,
    finish,
    goal_at,
    joints,
    largest_reference_step,
    newest_speed,
    run_into_motion,
    tool_error,
)
from tampering import Monitor

from hri_planner.policy.partner import Partner
from hri_planner.robot.model import load_robot
from hri_prediction.ros.messages import PolicyStatus, ReachTarget
from hri_sim.scenario.schema import Scenario
from hri_sim.testing import Graph, cue, node_factory, reach
from hri_sim.testing.spoiling import STILL, Bystander

ACTION = "/policy/reach_target"
STATUS = "/policy/status"
SEPARATION = 0.15


@pytest.fixture
def watched(make_policy_graph: Callable[..., Graph]) -> tuple[Graph, Monitor]:
    """The graph with another that supplies the heartbeat."""
    graph = make_policy_graph(
        others=[node_factory(Monitor)], parameters={"policy": {"heartbeat": False}}
    )
    monitor = graph.nodes["monitor"]
    assert isinstance(monitor, Monitor)
    return graph, monitor


@pytest.mark.parametrize("scale", [0.7, 0.3])
def test_a_slowed_robot_reaches_in_more_time(
    watched: tuple[Graph, Monitor], scenario: Scenario, scale: float
) -> None:
    graph, monitor = watched
    cue(graph, scenario, 0)
    handle = reach(graph, scenario, 0, ACTION)
    run_into_motion(graph)
    monitor.scale = scale
    result = finish(graph, handle, 25.0)
    assert result.outcome == ReachTarget.Result.REACHED
    assert tool_error(graph, scenario.targets[scenario.reaches[0].robot_target]) < 0.006
    assert result.duration > 3.0 / scale
    assert largest_reference_step(graph) < 0.02
    assert_finite(graph)


def test_a_robot_that_is_halted_and_let_go_on(
    watched: tuple[Graph, Monitor], scenario: Scenario
) -> None:
    graph, monitor = watched
    cue(graph, scenario, 0)
    handle = reach(graph, scenario, 0, ACTION)
    run_into_motion(graph)
    monitor.scale = 0.0
    graph.run(1.0)
    assert np.abs(newest_speed(graph)).max() < 0.02
    monitor.scale = 1.0
    assert finish(graph, handle).outcome == ReachTarget.Result.REACHED
    assert largest_reference_step(graph) < 0.02


def test_a_halt_while_a_goal_is_held(watched: tuple[Graph, Monitor], scenario: Scenario) -> None:
    graph, monitor = watched
    cue(graph, scenario, 0)
    assert finish(graph, reach(graph, scenario, 0, ACTION)).outcome == ReachTarget.Result.REACHED
    place = scenario.targets[scenario.reaches[0].robot_target]
    for scale in (0.0, 0.5, 1.0):
        monitor.scale = scale
        for _ in range(8):
            graph.run(0.1)
            assert tool_error(graph, place) < 0.006
    assert graph.messages(STATUS)[-1].stage == PolicyStatus.HOLDING
    # It still moves when it is told to.
    cue(graph, scenario, 1)
    assert finish(graph, reach(graph, scenario, 1, ACTION)).outcome == ReachTarget.Result.REACHED
    assert largest_reference_step(graph) < 0.02


def test_between_two_people(make_policy_graph: Callable[..., Graph], scenario: Scenario) -> None:
    """One who reaches, and an arm that keeps still next to the robot's way."""
    graph = make_policy_graph(sensors=[node_factory(Bystander, STILL)])
    # Beyond the arm that keeps still: the way on is past it.
    goal = STILL[3] + (0.05, 0.0, 0.35)
    cue(graph, scenario, 0)
    handle = graph.reach(goal_at(goal), ACTION)
    result = finish(graph, handle, 15.0)
    assert result.outcome == ReachTarget.Result.REACHED
    tools = load_robot().frames(joints(graph)[1])[:, 3]
    still = Partner(STILL[3], np.zeros(3), 0.0, STILL, 0.0 * STILL)
    assert min(still.distance(tool) for tool in tools) > SEPARATION - 0.01
    assert largest_reference_step(graph) < 0.02
    assert_finite(graph)
