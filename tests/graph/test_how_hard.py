"""How fast and how hard planned motions are, beside what the separation monitor reckons with."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from motions import REFERENCE, finish

from hri_planner.robot.model import load_robot
from hri_planner.separation.config import ProtectiveDistanceConfig
from hri_planner.separation.pairs import robot_ends
from hri_prediction.ros.time import to_ns
from hri_sim.scenario.schema import Scenario
from hri_sim.testing import Graph, cue, reach

CONFIG = ProtectiveDistanceConfig()
UNSLOWED = 0.98


def hardest(graph: Graph) -> tuple[float, float]:
    """Speed of the fastest point of the robot [m/s], and how much it gains until a stop is done [m/s²]."""
    lengths = load_robot().lengths
    stamps, velocities = [], []
    for message in graph.messages(REFERENCE):
        if message.state != message.TRACKING or message.speed_scale < UNSLOWED:
            continue
        ends, moving = np.empty((4, 3)), np.empty((4, 3))
        qd = np.array(message.reference_velocity) / message.speed_scale
        robot_ends(np.array(message.reference_position), qd, lengths, ends, moving)
        stamps.append(to_ns(message.header.stamp) * 1e-9)
        velocities.append(moving)
    time_s, speeds = np.array(stamps), np.array(velocities)
    window = CONFIG.reaction_time + CONFIG.stopping_time
    later = np.searchsorted(time_s, time_s + window)
    first = np.flatnonzero(later < len(time_s))
    later = later[first]
    together = time_s[later] - time_s[first] < window + 0.01  # of one motion
    first, later = first[together], later[together]
    assert len(first) > 50
    gained = np.linalg.norm(speeds[later] - speeds[first], axis=-1).max(axis=1)
    fastest = float(np.linalg.norm(speeds, axis=-1).max())
    hardest_gain = float((gained / (time_s[later] - time_s[first])).max())
    print(f"{fastest:.2f} m/s, {hardest_gain:.2f} m/s²")
    return fastest, hardest_gain


def check(graph: Graph, scenario: Scenario, action: str) -> None:
    for index in range(2):
        cue(graph, scenario, index)
        finish(graph, reach(graph, scenario, index, action))
    fastest, gain = hardest(graph)
    assert 0.2 < fastest <= CONFIG.robot_speed
    assert 0.5 < gain <= CONFIG.robot_acceleration


def test_a_planned_robot_is_no_harder_than_the_monitor_reckons_with(
    graph: Graph, scenario: Scenario
) -> None:
    check(graph, scenario, "/ptomp/reach_target")


def test_nor_is_one_that_a_policy_moves(
    make_policy_graph: Callable[..., Graph], scenario: Scenario
) -> None:
    check(make_policy_graph(), scenario, "/policy/reach_target")
