"""What the lock-step tests look at in a graph's log."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from hri_planner.robot.model import load_robot
from hri_prediction.errors import GraphError
from hri_prediction.ros.messages import ReachTarget
from hri_prediction.ros.time import to_ns
from hri_sim.scenario.schema import Scenario
from hri_sim.testing import Graph, ReachHandle, cue, reach
from hri_sim.testing.messages import numbers

REST = 0.02  # rad/s
PREDICTION = "/humans/bodies/person1/prediction"
REFERENCE = "/joint_trajectory_controller/reference"


def joints(graph: Graph) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Stamps (N,) [s], angles (N, 7), speeds (N, 7)."""
    messages = graph.messages("/joint_states")
    return (
        np.array([to_ns(m.header.stamp) * 1e-9 for m in messages]),
        np.array([m.position for m in messages]),
        np.array([m.velocity for m in messages]),
    )


def start_reach(graph: Graph, scenario: Scenario, index: int = 0) -> ReachHandle:
    """Person cued, goal sent."""
    cue(graph, scenario, index)
    return reach(graph, scenario, index)


def run_into_motion(graph: Graph, speed: float = 0.3) -> None:
    """Until the robot is well under way."""
    graph.run_until(lambda: np.abs(newest_speed(graph)).max() > speed, 3.0)


def newest_speed(graph: Graph) -> np.ndarray:
    """Joint speeds (7,) now [rad/s]."""
    from rclpy.serialization import deserialize_message
    from sensor_msgs.msg import JointState

    return np.array(deserialize_message(graph.log["/joint_states"][-1][1], JointState).velocity)


def stop_time_ms(graph: Graph, since_s: float) -> float:
    """From a time to the last joint state that still moves [ms]."""
    stamps, _, speeds = joints(graph)
    moving = (np.abs(speeds) >= REST).any(axis=1) & (stamps > since_s)
    assert moving.any(), "the robot did not move to begin with"
    assert not moving[-1], "the robot still moves"
    return float(stamps[np.flatnonzero(moving)[-1] + 1] - since_s) * 1e3


def largest_reference_step(graph: Graph, topic: str = REFERENCE, since_s: float = 0.0) -> float:
    """Largest step of the reference between two of its messages, any joint [rad]."""
    found = [
        m.reference_position
        for m in graph.messages(topic)
        if to_ns(m.header.stamp) * 1e-9 >= since_s
    ]
    return float(np.abs(np.diff(np.array(found), axis=0)).max())


def goal_at(position: Any, duration: float = 1.5, frame: str = "world") -> ReachTarget.Goal:
    """A goal by tool position [m]."""
    goal = ReachTarget.Goal(duration=duration)
    goal.pose.header.frame_id = frame
    point = goal.pose.pose.position
    point.x, point.y, point.z = map(float, position)
    return goal


def tool_error(graph: Graph, position: Any) -> float:
    """Distance of the tool to a position now [m]."""
    _, q, _ = joints(graph)
    return float(np.linalg.norm(load_robot().frames(q[-1])[3] - np.array(position)))


def assert_finite(graph: Graph, besides: tuple[str, ...] = ()) -> None:
    """No NaN, no infinity in any message of any topic."""
    for topic in graph.log.keys() - set(besides):
        for message in graph.messages(topic):
            for name, value in numbers(message, topic):
                assert math.isfinite(value), f"{name} = {value}"


def finish(graph: Graph, handle: ReachHandle, timeout_s: float = 12.0) -> ReachTarget.Result:
    """Run until a goal has its result."""
    try:
        graph.run_until(lambda: handle.done, timeout_s)
    except GraphError as error:
        newest = graph.messages("/ptomp/status")[-1]
        raise AssertionError(f"{error}: stage {newest.stage}, {newest.reason}") from error
    assert handle.result is not None
    return handle.result
