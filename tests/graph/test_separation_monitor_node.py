"""The separation monitor in the graph: it slows and stops whatever moves the robot, and dies safely."""

from collections.abc import Callable
from typing import Any

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
from std_msgs.msg import Float64

from hri_planner.ros.inputs import NOBODY
from hri_prediction.ros.messages import IdsList, ReachTarget, SeparationStatus
from hri_prediction.ros.node import ERROR, WARN, HriNode
from hri_prediction.ros.qos import LATCHED, reliable
from hri_prediction.ros.time import seconds_to_ns
from hri_sim.scenario.schema import Scenario
from hri_sim.testing import Graph, node_factory, spoiling
from hri_sim.testing.spoiling import ARM, RAW, STILL, Bystander, EmptyRoom, Tamper, millimetres

SCALE = "/separation/speed_scale"
STATUS = "/separation/status"


def scales(graph: Graph) -> list[float]:
    return [message.data for message in graph.messages(SCALE)]


def states(graph: Graph) -> list[int]:
    return [message.state for message in graph.messages(STATUS)]


@pytest.mark.parametrize("mode", ["measured", "predicted"])
def test_a_reach_past_a_person(
    make_graph: Callable[..., Graph], scenario: Scenario, mode: str
) -> None:
    graph = make_graph(separation=mode)
    begin = graph.now_s
    graph.run(0.6)
    result = finish(graph, start_reach(graph, scenario), 20.0)
    assert result.outcome == ReachTarget.Result.REACHED, result.reason
    assert largest_reference_step(graph) < 0.02
    assert not any(m.contacts_human for m in graph.messages("/sim/state"))
    # The monitor alone commands the speed, all the time.
    assert len(scales(graph)) >= 120 * (graph.now_s - begin)
    for status in graph.messages(STATUS):
        if status.margin < NOBODY and status.human_part:
            total = status.s_h + status.s_r + status.s_s + status.c + status.z_d + status.z_r
            assert status.protective_distance == pytest.approx(total)
            assert status.margin == pytest.approx(status.distance - total)
            assert status.human_mode in (mode, "assumed")


def test_it_stops_for_a_hand_that_it_takes_to_be_fast(
    make_graph: Callable[..., Graph], scenario: Scenario
) -> None:
    # From farther back: where the scene begins, a hand rests 30 cm away, and the robot would not set out.
    q = list(scenario.robot_start)
    q[1] += 0.6
    back = scenario.model_copy(update={"robot_start": tuple(q)})
    graph = make_graph(scenario=back, separation="assumed")
    graph.run(0.6)
    start_reach(graph, scenario)
    graph.run_until(lambda: np.abs(newest_speed(graph)).max() > 0.05, 5.0)
    graph.run_until(lambda: states(graph)[-1] == SeparationStatus.STOPPED, 5.0)
    stopped = graph.messages(STATUS)[-1]
    assert stopped.body_id == "person1"
    assert "person1" in stopped.reason
    assert stopped.distance < 0.6
    assert stop_time_ms_from_now(graph) <= 150.0
    # The person stays there or goes: the robot moves only while there is room.
    before = len(graph.messages(STATUS))
    graph.run(1.0)
    assert not [s for s in graph.messages(STATUS)[before:] if s.speed_scale > 0.0 > s.margin]
    assert not any(m.contacts_human for m in graph.messages("/sim/state"))


def stop_time_ms_from_now(graph: Graph) -> float:
    since = graph.now_s
    graph.run(0.25)
    assert np.abs(newest_speed(graph)).max() < 0.02
    stamps, _, speeds = joints(graph)
    moving = (np.abs(speeds) >= 0.02).any(axis=1) & (stamps > since)
    return float(stamps[moving][-1] - since) * 1e3 if moving.any() else 0.0


def test_a_policy_is_scaled_too(
    make_policy_graph: Callable[..., Graph], scenario: Scenario
) -> None:
    graph = make_policy_graph(separation="measured")
    begin = graph.now_s
    graph.run(0.6)
    handle = graph.reach(
        ReachTarget.Goal(target=scenario.reaches[0].robot_target), "/policy/reach_target"
    )
    result = finish(graph, handle, 20.0)
    assert result.outcome == ReachTarget.Result.REACHED, result.reason
    assert len(scales(graph)) >= 120 * (graph.now_s - begin)


@pytest.mark.parametrize("speed", [0.1, 0.4])
def test_a_dead_monitor_stops_the_robot(
    make_graph: Callable[..., Graph], scenario: Scenario, speed: float
) -> None:
    graph = make_graph(separation="measured")
    graph.run(0.6)
    start_reach(graph, scenario)
    run_into_motion(graph, speed)
    killed = graph.now_s
    graph.kill("separation_monitor")
    graph.run(0.8)
    assert stop_time_ms(graph, killed) <= 200.0
    newest = graph.messages("/joint_trajectory_controller/reference")[-1]
    assert "heartbeat" in newest.reason
    assert largest_reference_step(graph) < 0.02


@pytest.mark.parametrize(
    ("mode", "dead"),
    [
        ("measured", ["predictor"]),
        ("measured", ["ptomp"]),
        ("measured", ["predictor", "ptomp"]),
        ("predicted", ["predictor"]),
    ],
)
def test_it_goes_on_when_predictor_and_planner_are_dead(
    make_graph: Callable[..., Graph], scenario: Scenario, mode: str, dead: list[str]
) -> None:
    graph = make_graph(separation=mode)
    graph.run(0.6)
    start_reach(graph, scenario)
    run_into_motion(graph)
    killed = graph.now_s
    for name in dead:
        graph.kill(name)
    beats = len(scales(graph))
    graph.run(1.0)
    assert stop_time_ms(graph, killed) <= 200.0
    # It still speaks, of the person as they are now, and heeds no prediction of long ago.
    newest = graph.messages(STATUS)[-1]
    assert newest.distance < NOBODY
    assert len(scales(graph)) - beats >= 45
    if "predictor" in dead:
        assert newest.human_mode != "predicted"


def test_a_silent_motion_capture_is_named(
    make_graph: Callable[..., Graph], scenario: Scenario
) -> None:
    graph = make_graph(separation="measured")
    graph.run(0.6)
    start_reach(graph, scenario)
    run_into_motion(graph)
    killed = graph.now_s
    graph.kill("person")
    graph.run(0.5)
    assert stop_time_ms(graph, killed) <= 200.0
    assert "the right arm of person1 was last seen" in graph.messages(STATUS)[-1].reason
    assert scales(graph)[-1] == 0.0


@pytest.mark.parametrize(
    ("how", "named"),
    [
        (spoiling.blind, "last seen"),
        (spoiling.not_a_number, "last seen"),
        (spoiling.in_frame("body_person1"), "frame"),
        (spoiling.shifted_clock(-3.0), "last seen"),
        (spoiling.shifted_clock(3.0), "in the future"),
        (millimetres, "metres"),
    ],
)
def test_a_spoilt_motion_capture_stops_the_robot(
    make_graph: Callable[..., Graph], scenario: Scenario, how: spoiling.Spoil, named: str
) -> None:
    """For the monitor alone: planner and predictor hear the person as they are."""
    graph = make_graph(
        remappings={"separation_monitor": {ARM: "spoilt/arm"}},
        sensors=[node_factory(Tamper, remappings={RAW: ARM, ARM: "spoilt/arm"})],
        separation="measured",
    )
    graph.run(0.6)
    start_reach(graph, scenario)
    run_into_motion(graph)
    begin = graph.now_s
    tamper = graph.nodes["tamper"]
    assert isinstance(tamper, Tamper)
    tamper.spoil(how, 0.5)
    graph.run(0.45)
    assert stop_time_ms(graph, begin) <= 200.0
    newest = graph.messages(STATUS)[-1]
    assert scales(graph)[-1] == 0.0
    said = (newest.reason, *graph.nodes["separation_monitor"].faults)
    assert any(named in text for text in said), said
    assert all(np.isfinite(m.data) for m in graph.messages(SCALE))
    # When the capture is sound again the robot is let go.
    graph.run(1.0)
    assert scales(graph)[-1] > 0.0


@pytest.mark.parametrize("how", [spoiling.swapped, spoiling.wrist_jump])
def test_jumping_markers_are_reckoned_with_in_both_places(
    make_graph: Callable[..., Graph], scenario: Scenario, how: spoiling.Spoil
) -> None:
    graph = make_graph(remappings=spoiling.REMAP, sensors=[Tamper], separation="measured")
    graph.run(0.6)
    start_reach(graph, scenario)
    run_into_motion(graph)
    tamper = graph.nodes["tamper"]
    assert isinstance(tamper, Tamper)
    tamper.spoil(how, 0.1)
    graph.run(0.1)
    assert any("jumps" in text for text in graph.nodes["separation_monitor"].faults)
    graph.run(1.0)
    assert not any(m.contacts_human for m in graph.messages("/sim/state"))
    assert np.isfinite([m.margin for m in graph.messages(STATUS)]).all()


def test_a_second_body_counts(make_graph: Callable[..., Graph], scenario: Scenario) -> None:
    """One that keeps still right beside the robot."""
    graph = make_graph(
        separation="measured", others=[node_factory(Bystander, STILL - [0.0, 0.2, 0.0])]
    )
    graph.run(0.8)
    assert graph.messages(STATUS)[-1].body_id == "bystander"


def test_a_clock_that_goes_back(graph_with_monitor: Graph, scenario: Scenario) -> None:
    graph = graph_with_monitor
    start_reach(graph, scenario)
    run_into_motion(graph)
    node = graph.nodes["separation_monitor"]
    node.tick(seconds_to_ns(graph.now_s - 1.5))
    assert any("clock went back" in text for text in node.faults)
    said = len(scales(graph))
    graph.run(0.02)
    assert scales(graph)[said:]
    assert set(scales(graph)[said:]) == {0.0}
    graph.run(1.5)
    assert scales(graph)[-1] > 0.0


@pytest.fixture
def graph_with_monitor(make_graph: Callable[..., Graph]) -> Graph:
    graph = make_graph(separation="measured")
    graph.run(0.6)
    return graph


def test_somebody_else_who_commands_the_speed_is_named(
    make_graph: Callable[..., Graph],
) -> None:
    graph = make_graph(separation="measured", others=[node_factory(Meddler)])
    graph.run(0.6)
    level, text, _ = graph.nodes["separation_monitor"].health()
    assert level == ERROR
    assert "heartbeat:=false" in text


def test_a_planner_leaves_the_speed_to_a_monitor_for_good(
    make_graph: Callable[..., Graph], scenario: Scenario
) -> None:
    """A planner as it starts by itself: it must not keep a robot going whose monitor has died."""
    graph = make_graph(separation="measured", parameters={"ptomp": {"heartbeat": True}})
    graph.run(0.6)
    graph.run_until(lambda: graph.nodes["separation_monitor"].health()[0] != ERROR, 2.0)
    start_reach(graph, scenario)
    run_into_motion(graph)
    killed = graph.now_s
    graph.kill("separation_monitor")
    graph.run(0.8)
    assert stop_time_ms(graph, killed) <= 200.0
    assert "heartbeat" in graph.messages("/joint_trajectory_controller/reference")[-1].reason
    level, text, _ = graph.nodes["ptomp"].health()
    assert level == WARN
    assert "separation monitor" in text
    assert "has ended" in text
    beats = len(scales(graph))
    graph.run(1.0)
    assert len(scales(graph)) == beats


@pytest.mark.parametrize("leave_distance", [0.1, 0.5])
def test_a_second_source_makes_nobody_vanish_and_the_death_of_either_is_noticed(
    make_graph: Callable[..., Graph], leave_distance: float
) -> None:
    graph = make_graph(
        separation="measured",
        others=[node_factory(EmptyRoom)],
        parameters={"separation_monitor": {"leave_distance": leave_distance}},
    )
    graph.run(0.6)
    room = graph.nodes["empty_room"]
    assert isinstance(room, EmptyRoom)
    room.says_so = True
    begin = len(graph.messages(STATUS))
    graph.run(1.5)
    assert graph.messages(STATUS)[-1].body_id == "person1"
    assert not any("tracked" in m.reason for m in graph.messages(STATUS)[begin:])
    monitor = graph.nodes["separation_monitor"]
    assert "listed" not in monitor.health()[1]
    graph.kill("person")
    graph.run(0.2)
    begin = len(graph.messages(STATUS))
    graph.run(1.5)
    assert {m.state for m in graph.messages(STATUS)[begin:]} == {SeparationStatus.STOPPED}
    assert graph.messages(STATUS)[-1].distance < NOBODY
    assert "a source no longer says" in graph.nodes["ptomp"]._heard.lists.trouble(
        round(graph.now_s * 1e9)
    )
    # Another list takes the place of the dead one's: who is not on it has left, or was lost.
    graph.publish(IdsList, "humans/bodies/tracked", IdsList(), LATCHED)
    graph.run(0.4)
    assert graph.messages(STATUS)[-1].distance < NOBODY
    graph.run(0.3)
    newest = graph.messages(STATUS)[-1]
    if leave_distance == 0.1:
        assert newest.distance == NOBODY
    else:
        assert newest.state == SeparationStatus.STOPPED
        assert newest.reason == "person1 was lost beside the robot, and is no longer listed"


def test_without_people_it_is_at_full_speed(
    make_graph: Callable[..., Graph], scenario: Scenario
) -> None:
    """Once somebody says that nobody is tracked; before, it stands."""
    alone = scenario.model_copy(update={"persons": ()})
    reaches = tuple(r.model_copy(update={"person_target": None}) for r in scenario.reaches)
    alone = alone.model_copy(update={"reaches": reaches})
    graph = make_graph(scenario=alone, separation="assumed", others=[node_factory(EmptyRoom)])
    room = graph.nodes["empty_room"]
    assert isinstance(room, EmptyRoom)
    graph.run(0.5)
    assert graph.messages(STATUS)[-1].reason == "nothing says who is tracked"
    room.says_so = True
    graph.run(0.5)
    newest = graph.messages(STATUS)[-1]
    assert (newest.state, newest.speed_scale) == (SeparationStatus.FREE, 1.0)
    assert newest.distance == NOBODY
    # Whoever said so is gone: somebody may have come in since.
    graph.kill("empty_room")
    graph.run(1.0)
    newest = graph.messages(STATUS)[-1]
    assert newest.state == SeparationStatus.STOPPED
    assert newest.reason == "nothing says any longer who is tracked"


class Meddler(HriNode):
    """Says that the robot may go at full speed, whoever is there."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("meddler", period_s=0.02, **kwargs)
        self._scale = self.announce(Float64, SCALE, reliable(1))

    def on_tick(self, now_ns: int) -> None:
        self._scale.publish(Float64(data=1.0))
