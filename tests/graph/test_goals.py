"""What the action answers: wrong goals, goals out of reach, pre-emption, cancellation."""

import math
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
    start_reach,
    tool_error,
)
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from hri_planner.robot.model import load_robot
from hri_prediction.geometry.segments import capsule_distances
from hri_prediction.ros.messages import PlannerStatus, ReachTarget
from hri_prediction.ros.qos import reliable
from hri_sim.scenario.schema import Scenario
from hri_sim.testing import Graph, node_factory, reach
from hri_sim.testing.spoiling import STILL, Bystander

Result = ReachTarget.Result
ARM_RADII = np.array([0.05, 0.04, 0.05])
COMMAND = "joint_trajectory_controller/joint_trajectory"


@pytest.fixture
def quiet(graph: Graph) -> Graph:
    """The graph with everything heard once."""
    graph.run(0.3)
    return graph


def test_unknown_target(quiet: Graph, scenario: Scenario) -> None:
    result = finish(quiet, quiet.reach(ReachTarget.Goal(target="the_moon")))
    assert result.outcome == Result.REJECTED
    assert "the_moon" in result.reason
    assert ", ".join(scenario.targets) in result.reason


@pytest.mark.parametrize(
    ("goal", "words"),
    [
        (goal_at((math.nan, 0.0, 0.3)), "finite"),
        (goal_at((math.inf, 0.0, 0.3)), "finite"),
        (goal_at((0.5, 0.0, 0.3), duration=math.nan), "duration"),
        (goal_at((0.5, 0.0, 0.3), duration=-1.0), "duration"),
        (goal_at((0.5, 0.0, 0.3), duration=0.01), "duration"),
        (goal_at((0.5, 0.0, 0.3), frame="kitchen"), "kitchen"),
    ],
)
def test_malformed_goals(quiet: Graph, goal: ReachTarget.Goal, words: str) -> None:
    result = finish(quiet, quiet.reach(goal))
    assert result.outcome == Result.REJECTED
    assert words in result.reason


def test_bad_duration_of_a_named_target(quiet: Graph, scenario: Scenario) -> None:
    goal = ReachTarget.Goal(target=scenario.reaches[0].robot_target, duration=math.nan)
    result = finish(quiet, quiet.reach(goal))
    assert result.outcome == Result.REJECTED
    assert "duration" in result.reason


def test_a_malformed_goal_leaves_the_present_motion_alone(quiet: Graph, scenario: Scenario) -> None:
    first = start_reach(quiet, scenario)
    run_into_motion(quiet)
    assert finish(quiet, quiet.reach(ReachTarget.Goal(target="x"))).outcome == Result.REJECTED
    quiet.run(0.1)
    assert quiet.messages("/ptomp/status")[-1].motion == 1
    assert finish(quiet, first).outcome == Result.REACHED


def test_out_of_reach_says_how_far(quiet: Graph) -> None:
    result = finish(quiet, quiet.reach(goal_at((3.0, 0.0, 0.3))))
    assert result.outcome == Result.UNREACHABLE
    assert any(character.isdigit() for character in result.reason)
    assert " m" in result.reason
    quiet.run(0.2)
    assert np.abs(newest_speed(quiet)).max() < 1e-3
    print(result.reason)


def test_into_the_table(quiet: Graph, scenario: Scenario) -> None:
    x, y, _ = scenario.targets[scenario.reaches[0].robot_target]
    lowest = scenario.table.top + load_robot().capsule_radii[2]
    for height in (scenario.table.top, scenario.table.top - 0.05, lowest - 0.002):
        result = finish(quiet, quiet.reach(goal_at((x, y, height))), 0.1)
        assert result.outcome == Result.UNREACHABLE
        assert f"goal height {height:.3f} m puts the hand into the table" in result.reason
        assert f"at least {lowest:.3f} m" in result.reason
        assert result.replans == 0
    assert not quiet.log["/joint_trajectory_controller/joint_trajectory"]  # it was not tried
    assert finish(quiet, start_reach(quiet, scenario)).outcome == Result.REACHED


def test_into_something_that_the_planner_does_not_know(
    make_graph: Callable[..., Graph], scenario: Scenario
) -> None:
    """The table is not where the planner believes it: that is noticed, and said."""
    graph = make_graph(parameters={"ptomp": {"table_center": [0.0, 0.0, -2.0]}})
    graph.run(0.3)
    result = finish(graph, graph.reach(goal_at((0.4, -0.4, scenario.table.top - 0.05))), 6.0)
    assert result.outcome == Result.BLOCKED
    assert "held up" in result.reason
    assert "given no table" not in result.reason
    assert np.abs(newest_speed(graph)).max() < 0.05


@pytest.mark.parametrize("keypoint", [1, 2])
def test_a_goal_inside_a_person(make_graph: Callable[..., Graph], keypoint: int) -> None:
    """Elbow or wrist of an arm that is held still: the robot stays clear, gives up, and says why."""
    graph = make_graph(
        sensors=[node_factory(Bystander, STILL)], parameters={"ptomp": {"max_duration": 2.5}}
    )
    graph.run(0.5)
    result = finish(graph, graph.reach(goal_at(STILL[keypoint])), 4.0)
    assert result.outcome == Result.BLOCKED
    assert "gave up" in result.reason
    assert "person" in result.reason
    assert result.min_separation > 0.0
    graph.run(0.3)
    robot, arm = load_robot(), np.stack((STILL[:-1], STILL[1:]), axis=1)
    clearance = min(
        capsule_distances(robot.robot_capsules(q), robot.capsule_radii, arm, ARM_RADII).min()
        for q in joints(graph)[1]
    )
    assert clearance > 0.0
    assert np.abs(newest_speed(graph)).max() < 1e-3
    newest = graph.messages("/ptomp/status")[-1]
    assert newest.stage == PlannerStatus.IDLE
    assert newest.reason == result.reason
    assert any(m.stage == PlannerStatus.WAITING for m in graph.messages("/ptomp/status"))
    print(f"{result.reason}; never nearer than {clearance * 100:.1f} cm")


def test_goal_in_the_robot_s_own_frame(quiet: Graph, scenario: Scenario) -> None:
    position = scenario.targets[scenario.reaches[0].robot_target]
    result = finish(quiet, quiet.reach(goal_at(position, frame="lwr_base")))
    assert result.outcome == Result.REACHED
    assert tool_error(quiet, position) <= 0.01


def test_a_newer_goal_takes_over_without_a_jump(quiet: Graph, scenario: Scenario) -> None:
    quiet.run(0.2)
    first = reach(quiet, scenario, 0)
    run_into_motion(quiet, 0.5)
    second = reach(quiet, scenario, 1)
    result = finish(quiet, first, 0.1)
    assert result.outcome == Result.PREEMPTED
    assert result.reason
    result = finish(quiet, second)
    assert result.outcome == Result.REACHED, result.reason
    assert tool_error(quiet, scenario.targets[scenario.reaches[1].robot_target]) <= 0.01
    step = largest_reference_step(quiet)
    assert step < 0.02
    jump = max(
        m.max_handover_jump for m in quiet.messages("/joint_trajectory_controller/reference")
    )
    assert jump < 1e-3
    assert_finite(quiet)
    print(f"largest step of the reference in 4 ms: {step:.4f} rad, at hand-over {jump:.1e} rad")


def test_a_newer_goal_out_of_reach_stops_the_robot(quiet: Graph, scenario: Scenario) -> None:
    first = reach(quiet, scenario, 0)
    run_into_motion(quiet, 0.5)
    second = quiet.reach(goal_at((3.0, 0.0, 0.3)))
    assert finish(quiet, first, 0.1).outcome == Result.PREEMPTED
    assert finish(quiet, second).outcome == Result.UNREACHABLE
    quiet.run(0.2)
    assert np.abs(newest_speed(quiet)).max() < 0.02
    assert largest_reference_step(quiet) < 0.02


def test_cancelling_stops_smoothly(quiet: Graph, scenario: Scenario) -> None:
    handle = start_reach(quiet, scenario)
    run_into_motion(quiet, 0.5)
    begin = quiet.now_s
    quiet.cancel(handle)
    result = finish(quiet, handle, 1.0)
    took = quiet.now_s - begin
    assert result.outcome == Result.CANCELLED
    assert np.abs(newest_speed(quiet)).max() < 0.02
    assert largest_reference_step(quiet) < 0.02
    assert quiet.messages("/ptomp/status")[-1].stage == PlannerStatus.IDLE
    quiet.run(0.3)
    assert np.abs(newest_speed(quiet)).max() < 0.02
    print(f"at rest {took * 1e3:.0f} ms after the cancellation")


def test_a_goal_right_after_a_cancellation(quiet: Graph, scenario: Scenario) -> None:
    """The robot is still slowing down when the next goal comes."""
    handle = start_reach(quiet, scenario)
    run_into_motion(quiet, 0.5)
    quiet.cancel(handle)
    quiet.run(0.02)
    begin = quiet.now_s
    again = reach(quiet, scenario, 0)
    assert finish(quiet, again).outcome == Result.REACHED
    assert largest_reference_step(quiet) < 0.02
    # No jolt: what the references accelerate by stays within what plans do.
    references = [
        m
        for m in quiet.messages("/joint_trajectory_controller/reference")
        if m.header.stamp.sec + m.header.stamp.nanosec * 1e-9 > begin - 0.05
    ]
    speed = np.array([m.reference_velocity for m in references])
    assert np.abs(np.diff(speed, axis=0)).max() / 0.004 < 20.0


def test_a_motion_of_somebody_else_is_stopped_first(quiet: Graph, scenario: Scenario) -> None:
    start = np.array(quiet.messages("/joint_states")[-1].position)
    foreign = JointTrajectory(joint_names=list(load_robot().joint_names))
    for share in (0.0, 1.0):
        point = JointTrajectoryPoint(positions=start + share * np.full(7, 0.3))
        point.time_from_start.sec = round(2.0 * share)
        point.time_from_start.nanosec = 50_000_000
        foreign.points.append(point)
    quiet.publish(JointTrajectory, COMMAND, foreign, reliable(1))
    quiet.run(0.06)
    handle = reach(quiet, scenario, 0)
    assert finish(quiet, handle).outcome == Result.REACHED
    assert largest_reference_step(quiet) < 0.02


def test_cancelling_before_the_robot_moves(
    make_graph: Callable[..., Graph], scenario: Scenario
) -> None:
    graph = make_graph()  # nothing was heard yet: the motion waits for its inputs
    handle = reach(graph, scenario, 0)
    graph.run(0.008)
    graph.cancel(handle)
    assert finish(graph, handle, 1.0).outcome == Result.CANCELLED
    graph.run(0.3)
    assert np.abs(newest_speed(graph)).max() < 1e-3


def test_no_goal_no_motion(quiet: Graph) -> None:
    quiet.run(1.0)
    assert np.abs(newest_speed(quiet)).max() < 1e-3
    assert not quiet.log["/joint_trajectory_controller/joint_trajectory"]
    beats = len(quiet.log["/separation/speed_scale"])
    assert beats >= 50 * 1.2
