"""The policy node in the whole graph: reaches, goals that move, stops, models, authority."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from geometry_msgs.msg import PoseStamped
from motions import (
    assert_finite,
    finish,
    goal_at,
    joints,
    largest_reference_step,
    newest_speed,
    run_into_motion,
    stop_time_ms,
    tool_error,
)

from hri_planner.nodes.policy_config import DEFAULT_POLICY
from hri_planner.nodes.ptomp_node import PtompNode
from hri_planner.policy.partner import Partner
from hri_planner.rnn.model_file import find_policy, load_policy, save_policy
from hri_planner.robot.model import load_robot
from hri_prediction.errors import DataError
from hri_prediction.ros.messages import LoadModel, PolicyStatus, ReachTarget
from hri_prediction.ros.qos import reliable
from hri_prediction.ros.time import to_time
from hri_sim.scenario.schema import Scenario
from hri_sim.testing import Graph, ReachHandle, cue, node_factory, reach
from hri_sim.testing.spoiling import REMAP, EmptyRoom, Spoil, Tamper, blind, millimetres, wrist_jump

Result = ReachTarget.Result
ACTION = "/policy/reach_target"
STATUS = "/policy/status"
SEPARATION = 0.15
UNWATCHED = {"policy": {"require_tracking": False}}


@pytest.fixture
def make(make_policy_graph: Callable[..., Graph]) -> Callable[..., Graph]:
    """Graphs with a policy."""
    return make_policy_graph


def start(graph: Graph, scenario: Scenario, index: int = 0) -> ReachHandle:
    cue(graph, scenario, index)
    return reach(graph, scenario, index, ACTION)


def move_goal(graph: Graph, place: Any, stamp_s: float = 0.0) -> None:
    message = PoseStamped()
    message.header.stamp = to_time(round(stamp_s * 1e9))
    message.header.frame_id = "world"
    point = message.pose.position
    point.x, point.y, point.z = map(float, place)
    graph.publish(PoseStamped, "policy/goal", message, reliable(1))


def alone(scenario: Scenario) -> Scenario:
    """The same without people."""
    nobody = {"person_target": None, "person_candidates": ()}
    reaches = tuple(one.model_copy(update=nobody) for one in scenario.reaches)
    return scenario.model_copy(update={"persons": (), "reaches": reaches})


def test_a_reach_beside_a_person(make: Callable[..., Graph], scenario: Scenario) -> None:
    graph = make()
    handle = start(graph, scenario)
    result = finish(graph, handle)
    assert result.outcome == Result.REACHED
    assert result.goal_error < 0.006
    assert handle.feedback
    assert largest_reference_step(graph) < 0.02  # that is 5 rad/s: the path is smooth
    assert_finite(graph)
    arms = graph.messages("/sim/bodies/person1/arm")
    truth = {(m.header.stamp.sec, m.header.stamp.nanosec): m.keypoints for m in arms}
    tools = load_robot().frames(joints(graph)[1])[:, 3]
    nearest = np.inf
    for message, tool in zip(graph.messages("/joint_states"), tools, strict=True):
        stamp = message.header.stamp
        keypoints = truth.get((stamp.sec, stamp.nanosec))
        if keypoints is not None:
            arm = np.array(keypoints).reshape(4, 3)
            nearest = min(nearest, Partner(arm[3], np.zeros(3), 0.0, arm, 0.0 * arm).distance(tool))
    # The robot's own lag, tracking noise and people's true accelerations come on top.
    assert nearest > SEPARATION - 0.02
    status = graph.messages(STATUS)[-1]
    assert status.policy == DEFAULT_POLICY
    assert status.stage == PolicyStatus.HOLDING


def test_reaches_one_after_the_other(make: Callable[..., Graph], scenario: Scenario) -> None:
    graph = make()
    for index in range(2):
        assert finish(graph, start(graph, scenario, index)).outcome == Result.REACHED
    assert tool_error(graph, scenario.targets[scenario.reaches[1].robot_target]) < 0.006


def test_the_goal_changes_in_mid_flight(make: Callable[..., Graph], scenario: Scenario) -> None:
    graph = make()
    handle = start(graph, scenario)
    run_into_motion(graph)
    later = np.array(scenario.targets[scenario.reaches[1].robot_target])
    move_goal(graph, later)
    result = finish(graph, handle)
    assert result.outcome == Result.REACHED
    assert tool_error(graph, later) < 0.006
    assert largest_reference_step(graph) < 0.02


def test_a_goal_that_moves_is_followed(make: Callable[..., Graph], scenario: Scenario) -> None:
    graph = make(scenario=alone(scenario), parameters=UNWATCHED)
    place = np.array(scenario.targets[scenario.reaches[0].robot_target])
    up = np.array((0.0, 0.0, 0.003))
    handle = graph.reach(goal_at(place), ACTION)
    for step in range(40):
        move_goal(graph, place + step * up)
        graph.run(0.02)
    assert finish(graph, handle).outcome == Result.REACHED
    assert tool_error(graph, place + 39 * up) < 0.006
    # What is held stays: nothing moves without a motion.
    move_goal(graph, place)
    graph.run(1.0)
    assert tool_error(graph, place + 39 * up) < 0.006
    assert any("no motion" in fault for fault in graph.nodes["policy"].faults)


def test_goals_that_are_none(make: Callable[..., Graph], scenario: Scenario) -> None:
    graph = make()
    move_goal(graph, (0.4, 0.2, 0.3))
    graph.run(0.02)
    assert any("no motion" in fault for fault in graph.nodes["policy"].faults)
    handle = start(graph, scenario)
    run_into_motion(graph)
    for place, word in (
        ((np.nan, 0.0, 0.3), "finite"),
        ((2.0, 0.0, 0.3), "out of reach"),
        ((0.5, 0.0, -0.2), "table"),
    ):
        move_goal(graph, place)
        graph.run(0.02)
        assert word in " ".join(graph.nodes["policy"].faults)
    for off_s in (-0.6, 5.0):
        move_goal(graph, (0.5, 0.0, 0.3), graph.now_s + off_s)
        graph.run(0.02)
        assert "expected 0.5 s at most" in " ".join(graph.nodes["policy"].faults)
    assert finish(graph, handle).outcome == Result.REACHED
    assert tool_error(graph, scenario.targets[scenario.reaches[0].robot_target]) < 0.006
    result = finish(graph, graph.reach(goal_at((2.0, 0.0, 0.3)), ACTION))
    assert result.outcome == Result.UNREACHABLE


def test_a_cancelled_motion_stops_smoothly(make: Callable[..., Graph], scenario: Scenario) -> None:
    graph = make()
    handle = start(graph, scenario)
    run_into_motion(graph)
    graph.cancel(handle)
    assert finish(graph, handle).outcome == Result.CANCELLED
    assert np.abs(newest_speed(graph)).max() < 0.02
    assert largest_reference_step(graph) < 0.02


def spoilt_in_motion(
    make: Callable[..., Graph], scenario: Scenario, how: Spoil, seconds: float
) -> tuple[Graph, ReachHandle]:
    """A graph whose motion capture goes wrong for a while, from now on, as the robot moves."""
    graph = make(remappings=REMAP, sensors=[node_factory(Tamper)])
    handle = start(graph, scenario)
    run_into_motion(graph)
    tamper = graph.nodes["tamper"]
    assert isinstance(tamper, Tamper)
    tamper.spoil(how, seconds)
    return graph, handle


def test_a_partner_who_is_lost_stops_the_robot(
    make: Callable[..., Graph], scenario: Scenario
) -> None:
    graph, handle = spoilt_in_motion(make, scenario, blind, 0.5)
    graph.run(0.35)
    assert np.abs(newest_speed(graph)).max() < 0.02
    assert "person1" in graph.messages(STATUS)[-1].reason
    assert finish(graph, handle).outcome == Result.REACHED
    assert largest_reference_step(graph) < 0.02


def test_a_partner_in_millimetres_stops_the_robot(
    make: Callable[..., Graph], scenario: Scenario
) -> None:
    """Nobody else would: there is neither a predictor nor a separation monitor."""
    graph, handle = spoilt_in_motion(make, scenario, millimetres, 0.6)
    graph.run(0.2)
    faults = " ".join(graph.nodes["policy"].faults)
    assert "upper arm of person1 is" in faults
    assert "check the unit: positions are in metres" in faults
    for _ in range(8):  # as long as it lasts
        assert np.abs(newest_speed(graph)).max() < 0.02
        graph.run(0.05)
    assert finish(graph, handle).outcome == Result.REACHED


def test_one_wild_sample_changes_nothing(make: Callable[..., Graph], scenario: Scenario) -> None:
    graph, handle = spoilt_in_motion(make, scenario, wrist_jump, 0.004)
    graph.run(0.1)
    assert np.abs(newest_speed(graph)).max() > 0.1
    assert finish(graph, handle).outcome == Result.REACHED


def test_the_clock_goes_back(make: Callable[..., Graph], scenario: Scenario) -> None:
    graph = make()
    handle = start(graph, scenario)
    run_into_motion(graph)
    graph.nodes["policy"].tick(round((graph.now_s - 2.0) * 1e9))
    graph.run(1.0)
    assert handle.result is not None
    assert "clock went back" in handle.result.reason
    assert np.abs(newest_speed(graph)).max() < 0.02
    assert largest_reference_step(graph) < 0.02


def test_people_come_and_go(make: Callable[..., Graph], scenario: Scenario) -> None:
    graph = make(others=[node_factory(EmptyRoom)])
    room = graph.nodes["empty_room"]
    assert isinstance(room, EmptyRoom)
    room.says_so = True
    handle = start(graph, scenario)
    run_into_motion(graph)
    # Somebody is tracked of whom nothing is heard: the robot waits.
    for names, word in ((["person1", "eve"], "eve"), (["person1", "no/name"], "no/name")):
        room.ids = names
        graph.run(0.4)
        assert np.abs(newest_speed(graph)).max() < 0.02
        assert word in graph.messages(STATUS)[-1].reason
    room.ids = ["person1"]
    assert finish(graph, handle).outcome == Result.REACHED
    assert largest_reference_step(graph) < 0.02


def test_the_robot_stops_when_the_node_dies(make: Callable[..., Graph], scenario: Scenario) -> None:
    graph = make()
    start(graph, scenario)
    run_into_motion(graph)
    killed_s = graph.now_s
    graph.kill("policy")
    graph.run(1.0)
    assert stop_time_ms(graph, killed_s) <= 200.0


def test_models_are_loaded_between_motions(
    make: Callable[..., Graph], scenario: Scenario, tmp_path: Path
) -> None:
    graph = make()
    handle = start(graph, scenario)
    run_into_motion(graph)
    path = str(find_policy(DEFAULT_POLICY))
    answer = graph.call(LoadModel, "/policy/load_model", LoadModel.Request(path=path))
    assert not answer.success
    assert "under way" in answer.message
    assert finish(graph, handle).outcome == Result.REACHED
    broken = tmp_path / "broken.npz"
    broken.write_bytes(Path(path).read_bytes()[:500])
    slow = tmp_path / "rnn_slow.npz"
    save_policy(slow, replace(load_policy(path), dt=0.030), {})
    for wrong in (str(broken), "rnn_unknown", str(tmp_path / "none.npz"), str(slow)):
        answer = graph.call(LoadModel, "/policy/load_model", LoadModel.Request(path=wrong))
        assert not answer.success
        assert answer.message
    # While the goal is held, that is let go.
    assert graph.messages(STATUS)[-1].stage == PolicyStatus.HOLDING
    answer = graph.call(LoadModel, "/policy/load_model", LoadModel.Request(path=path))
    assert answer.success
    graph.run(0.1)
    assert graph.messages(STATUS)[-1].stage == PolicyStatus.IDLE
    assert finish(graph, start(graph, scenario, 1)).outcome == Result.REACHED
    assert graph.messages(STATUS)[-1].policy == path


def test_goals_may_name_those_of_the_policy(make: Callable[..., Graph], scenario: Scenario) -> None:
    graph = make(policy="dmp_transfer")
    answer = finish(graph, graph.reach(ReachTarget.Goal(target="sideways"), ACTION))
    assert answer.outcome == Result.REJECTED
    for name in ("left", "middle", "right", "start", scenario.reaches[0].robot_target):
        assert name in answer.reason
    handle = graph.reach(ReachTarget.Goal(target="left"), ACTION)
    graph.run(0.3)
    assert not handle.done
    graph.cancel(handle)
    assert finish(graph, handle).outcome == Result.CANCELLED
    assert graph.call(
        LoadModel, "/policy/load_model", LoadModel.Request(path=DEFAULT_POLICY)
    ).success
    answer = finish(graph, graph.reach(ReachTarget.Goal(target="left"), ACTION))
    assert answer.outcome == Result.REJECTED


def test_a_broken_model_keeps_the_node_from_starting(
    make: Callable[..., Graph], tmp_path: Path
) -> None:
    broken = tmp_path / "rnn_broken.npz"
    broken.write_bytes(b"nothing of the kind")
    with pytest.raises(DataError, match="rnn_broken"):
        make(policy=str(broken))


def test_one_node_at_a_time_moves_the_robot(make: Callable[..., Graph], scenario: Scenario) -> None:
    ptomp = node_factory(PtompNode, parameters={"require_tracking": False})
    graph = make(scenario=alone(scenario), others=[ptomp], parameters=UNWATCHED)
    place = scenario.targets[scenario.reaches[0].robot_target]
    other = scenario.targets[scenario.reaches[1].robot_target]
    handle = graph.reach(goal_at(place), ACTION)
    run_into_motion(graph)
    refused = finish(graph, graph.reach(goal_at(other)))
    assert refused.outcome == Result.REJECTED
    assert "policy moves the robot" in refused.reason
    assert finish(graph, handle).outcome == Result.REACHED
    # The policy holds its goal, and lets go when the planner takes over.
    graph.run(0.6)
    assert finish(graph, graph.reach(goal_at(other))).outcome == Result.REACHED
    assert graph.messages(STATUS)[-1].stage == PolicyStatus.IDLE
    assert tool_error(graph, other) < 0.006


def test_of_two_nodes_that_begin_at_once_one_goes_on(
    make: Callable[..., Graph], scenario: Scenario
) -> None:
    ptomp = node_factory(PtompNode, parameters={"require_tracking": False})
    graph = make(scenario=alone(scenario), others=[ptomp], parameters=UNWATCHED)
    mine = scenario.targets[scenario.reaches[0].robot_target]
    theirs = scenario.targets[scenario.reaches[1].robot_target]
    handle, other = graph.reach(goal_at(mine), ACTION), graph.reach(goal_at(theirs))
    result = finish(graph, handle)
    assert result.outcome == Result.REJECTED
    assert "ptomp moves the robot" in result.reason
    assert finish(graph, other).outcome == Result.REACHED
    assert tool_error(graph, theirs) < 0.006
    assert largest_reference_step(graph) < 0.02


def test_the_same_seed_says_the_same(make: Callable[..., Graph], scenario: Scenario) -> None:
    logs = []
    for _ in range(2):
        graph = make()
        start(graph, scenario)
        graph.run(1.0)
        logs.append({name: log for name, log in graph.log.items() if "diagnostics" not in name})
        graph.close()
    assert logs[0] == logs[1]
