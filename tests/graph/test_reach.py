"""A whole reach: it arrives, clear of the person, and says the same with the same seed."""

from collections.abc import Callable

import numpy as np
import pytest
from motions import (
    PREDICTION,
    assert_finite,
    finish,
    largest_reference_step,
    start_reach,
    tool_error,
)

from hri_prediction.ros.messages import HumanPrediction, ReachTarget
from hri_prediction.ros.time import to_ns
from hri_sim.scenario.schema import Scenario
from hri_sim.testing import Graph

Log = dict[str, list[tuple[int, bytes]]]


def whole_reach(graph: Graph, scenario: Scenario) -> Log:
    graph.run(0.4)
    handle = start_reach(graph, scenario)
    finish(graph, handle)
    graph.run(0.3)
    return {topic: list(messages) for topic, messages in graph.log.items()}


def test_a_reach_arrives_clear_of_the_person(graph: Graph, scenario: Scenario) -> None:
    graph.run(0.5)
    begin = graph.now_s
    handle = start_reach(graph, scenario)
    result = finish(graph, handle)
    arrived = graph.now_s
    spec = scenario.reaches[0]
    graph.run(max(begin + spec.person_delay + 1.5 * spec.person_duration - graph.now_s, 0.0) + 0.3)

    assert result.outcome == ReachTarget.Result.REACHED, result.reason
    assert result.goal_error <= 0.01
    assert tool_error(graph, scenario.targets[spec.robot_target]) <= 0.01
    assert handle.feedback
    assert handle.feedback[0].distance_to_goal > handle.feedback[-1].distance_to_goal
    clearance = min(m.clearance for m in graph.messages("/sim/state"))
    assert clearance > 0.0
    assert result.min_separation > 0.0
    references = graph.messages("/joint_trajectory_controller/reference")
    jump = max(m.max_handover_jump for m in references)
    assert jump < 1e-3
    assert largest_reference_step(graph) < 0.02
    assert not any(m.contacts_human or m.contacts_table for m in graph.messages("/sim/state"))

    predictions = graph.messages(PREDICTION)
    stamps = np.array([to_ns(m.header.stamp) for m in predictions]) * 1e-9
    assert len(predictions) / (graph.now_s - 1.0) >= 25.0
    assert np.diff(stamps).max() <= 0.0401  # never slower than 25 Hz
    before = [m.state for m, t in zip(predictions, stamps, strict=True) if t < begin]
    after = [m.state for m, t in zip(predictions, stamps, strict=True) if t > graph.now_s - 0.2]
    assert set(before) == {HumanPrediction.IDLE}
    assert set(after) == {HumanPrediction.IDLE}
    during = [m for m in predictions if m.state == HumanPrediction.REACHING]
    assert during
    assert {m.state for m in predictions} == {HumanPrediction.IDLE, HumanPrediction.REACHING}
    for message in during:
        assert abs(sum(message.task_probabilities) - 1.0) < 1e-6
        assert 0.3 < message.duration_mean < 4.0
    assert_finite(graph)
    print(
        f"arrived after {arrived - begin:.2f} s, {result.goal_error * 1e3:.2f} mm off, least true "
        f"clearance {clearance * 100:.1f} cm, jump {jump:.1e} rad, {len(predictions)} predictions"
    )


@pytest.mark.parametrize("name", ["itomp", "stomp"])
def test_a_peer_plans_too(make_graph: Callable[..., Graph], scenario: Scenario, name: str) -> None:
    graph = make_graph(parameters={"ptomp": {"variant": name, "max_duration": 4.0}})
    graph.run(0.4)
    result = finish(graph, start_reach(graph, scenario))
    told = [m.iterations for m in graph.messages("/ptomp/status") if m.costs]
    planning = sum(count > 0 for count in told)
    assert len(told) > 20
    if name == "stomp":  # it may run into the person, of whom it knows only how it was at first
        assert planning == 1
        assert max(told) > 100  # no interval of 36 ms has room for so many
    else:
        assert planning > 10
        assert result.outcome == ReachTarget.Result.REACHED, result.reason


def test_the_status_says_how_hard_the_situation_is(graph: Graph, scenario: Scenario) -> None:
    graph.run(0.5)
    finish(graph, start_reach(graph, scenario))
    told = graph.messages("/ptomp/status")
    plans = [m for m in told if m.costs]
    assert len(plans) > 20
    for message in plans:
        costs = dict(zip(message.cost_names, message.costs, strict=True))
        assert message.collision_cost == costs["collision"]
        if message.first_contact < 0.0:
            assert message.time_to_collision == scenario.reaches[0].duration
        else:
            due_s = (to_ns(message.handover) - to_ns(message.header.stamp)) * 1e-9
            assert message.time_to_collision == pytest.approx(message.first_contact + due_s)
    # While the person reaches, predictions are unsure, and off by some centimetres.
    unsure = [m.prediction_uncertainty for m in told]
    off = [m.prediction_error for m in told]
    assert 0.002 < max(unsure) < 0.5
    assert 0.002 < max(off) < 0.3
    # By hand: of the newest prediction before the last plan.
    last = plans[-1]
    before = [
        m for m in graph.messages(PREDICTION) if to_ns(m.header.stamp) == to_ns(last.newest_sample)
    ]
    covariance = np.array(before[-1].covariance).reshape(-1, 3, 3)
    largest = np.linalg.eigvalsh(covariance)[:, -1]
    assert last.prediction_uncertainty == pytest.approx(np.sqrt(largest).mean())
    print(
        f"uncertainty {min(unsure):.3f} to {max(unsure):.3f} m, error to {max(off):.3f} m, "
        f"shortest time to collision {min(m.time_to_collision for m in plans):.2f} s"
    )


def test_same_seed_same_messages(make_graph: Callable[..., Graph], scenario: Scenario) -> None:
    logs = []
    for seed in (100, 100, 101):
        graph = make_graph(seed=seed)
        logs.append(whole_reach(graph, scenario))
        graph.close()
    first, again, other = logs
    assert first.keys() == again.keys() == other.keys()
    assert {"/joint_states", PREDICTION, "/ptomp/status", "/sim/state"} <= first.keys()
    for topic in first:
        assert first[topic] == again[topic], f"{topic} differs between two runs with one seed"
    same = {topic for topic in first if first[topic] == other[topic]}
    assert same <= {"/robot_description", "/sim/cue", "/humans/bodies/tracked"}


def test_two_reaches_one_after_the_other(graph: Graph, scenario: Scenario) -> None:
    outcomes = []
    for index in range(2):
        graph.run(0.5)
        handle = start_reach(graph, scenario, index)
        outcomes.append(finish(graph, handle).outcome)
        spec = scenario.reaches[index]
        graph.run(spec.person_delay + 0.5)
    assert outcomes == [ReachTarget.Result.REACHED] * 2
    assert min(m.clearance for m in graph.messages("/sim/state")) > 0.0
    assert graph.messages("/ptomp/status")[-1].motion == 2
