"""A node dies in mid-motion: the robot is at rest within 200 ms."""

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

from hri_planner.nodes.ptomp_node import PtompNode
from hri_planner.ptomp import planner
from hri_prediction.errors import DataError, GraphError, PlanningError
from hri_prediction.ros.messages import ControllerState, PlannerStatus, ReachTarget
from hri_prediction.ros.time import seconds_to_ns, to_ns
from hri_sim.nodes.simulator_node import SimulatorNode
from hri_sim.scenario.schema import Scenario
from hri_sim.simulator.stopchain import NO_HEARTBEAT
from hri_sim.testing import Graph, scenes
from hri_sim.testing.slow import SlowWorker


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


class Stalling(SimulatorNode):
    """A simulator whose machine is busy for a while: simulated time falls behind the clock."""

    stall_s = (0.0, 0.0)

    def on_tick(self, now_ns: int) -> None:
        if not self.stall_s[0] <= now_ns * 1e-9 < self.stall_s[1]:
            super().on_tick(now_ns)


@pytest.mark.parametrize(("stall_s", "slips"), [(0.15, False), (0.6, True)])
def test_a_simulator_that_falls_behind(
    make_graph: Callable[..., Graph],
    scenario: Scenario,
    monkeypatch: pytest.MonkeyPatch,
    stall_s: float,
    slips: bool,
) -> None:
    """It catches up after a short stall; after a long one simulated time slips against the clock.

    Whoever moved on meanwhile has stopped the robot: here the planner, once joint states were 0.1 s old.
    It is at rest by the time that a robot is which hears that at once.
    """
    monkeypatch.setitem(scenes.NODES, "simulator", Stalling)
    graph = make_graph()
    graph.run(0.4)
    handle = start_reach(graph, scenario)
    run_into_motion(graph, 0.6)
    stalled_s = graph.now_s
    monkeypatch.setattr(Stalling, "stall_s", (stalled_s, stalled_s + stall_s))
    assert finish(graph, handle).outcome == ReachTarget.Result.REACHED
    slipped = any("ran ahead" in fault for fault in graph.nodes["simulator"].faults)
    assert slipped == slips
    references = graph.messages("/joint_trajectory_controller/reference")
    assert max(m.max_handover_jump for m in references) < 1e-3
    assert largest_reference_step(graph) < 0.02
    rests_s = stalled_s + 0.1 + 2 * 0.004 + 0.07  # told with the planner's next tick, then the ramp
    until_s = max(rests_s, stalled_s + stall_s)
    while_told = [
        m for m in references if rests_s <= to_ns(m.header.stamp) * 1e-9 < until_s + 0.004
    ]
    assert while_told
    assert max(np.abs(m.reference_velocity).max() for m in while_told) < 1e-6


class Frozen(Stalling):
    """One that hears nothing meanwhile, as when its process is stopped."""

    def tick(self, now_ns: int | None = None) -> None:
        now_s = (self.now_ns() if now_ns is None else now_ns) * 1e-9
        if not self.stall_s[0] <= now_s < self.stall_s[1]:
            super().tick(now_ns)


def test_a_frozen_simulator_makes_up_for_half_a_second_at_the_end_of_which_the_robot_rests(
    make_graph: Callable[..., Graph], scenario: Scenario, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nobody has told it to stop when it goes on: its controller finds that nobody says anything."""
    monkeypatch.setitem(scenes.NODES, "simulator", Frozen)
    graph = make_graph()
    graph.run(0.4)
    start_reach(graph, scenario)
    run_into_motion(graph, 0.6)
    fast = np.abs(newest_speed(graph)).max()
    goes_on_s = graph.now_s + 1.5
    monkeypatch.setattr(Frozen, "stall_s", (graph.now_s, goes_on_s))
    graph.kill("ptomp")
    graph.run(1.6)
    assert fast > 0.1
    reasons = [
        m.reason
        for m in graph.messages("/joint_trajectory_controller/reference")
        if to_ns(m.header.stamp) * 1e-9 < goes_on_s
    ]
    assert NO_HEARTBEAT in reasons, sorted(set(reasons))
    references = graph.messages("/joint_trajectory_controller/reference")
    newest = next(m for m in references if to_ns(m.header.stamp) * 1e-9 >= goes_on_s)
    assert np.abs(newest.reference_velocity).max() < 1e-6


@pytest.mark.parametrize("stall_s", [0.06, 0.3])
def test_a_simulator_that_was_late_hears_each_command_when_it_came(
    make_graph: Callable[..., Graph],
    scenario: Scenario,
    monkeypatch: pytest.MonkeyPatch,
    stall_s: float,
) -> None:
    """Heartbeats and plans went on all the while: there is no reason to stop in what is made up for."""
    monkeypatch.setitem(scenes.NODES, "simulator", Stalling)
    graph = make_graph(
        parameters={
            "simulator": {"heartbeat_timeout": 0.032},
            "ptomp": {"max_joint_age": 1.0},  # so that it goes on, though the robot says nothing
        }
    )
    graph.run(0.4)
    handle = start_reach(graph, scenario)
    run_into_motion(graph, 0.6)
    stalled_s = graph.now_s
    monkeypatch.setattr(Stalling, "stall_s", (stalled_s, stalled_s + stall_s))
    assert finish(graph, handle).outcome == ReachTarget.Result.REACHED
    references = graph.messages("/joint_trajectory_controller/reference")
    caught_up = [
        m for m in references if 0.002 < to_ns(m.header.stamp) * 1e-9 - stalled_s < stall_s + 0.002
    ]
    assert len(caught_up) == round(stall_s / 0.004)
    assert {m.reason for m in caught_up} == {""}
    assert min(m.speed_scale for m in caught_up) > 0.99


class Overloaded(PtompNode):
    """A planner whose first plans all come too late."""

    dropped = 25

    def _publish(self, now_ns: int, plan: Any, cycle: Any, due_ns: int) -> None:
        if self.dropped:
            self.dropped -= 1
            self.replanning.planner.restore(cycle.before)
            return
        super()._publish(now_ns, plan, cycle, due_ns)


def test_a_first_plan_that_comes_late_begins_where_the_robot_is(
    make_graph: Callable[..., Graph], scenario: Scenario, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(scenes.NODES, "ptomp", Overloaded)
    graph = make_graph()
    graph.run(0.4)
    start = joints(graph)[1][-1]
    handle = start_reach(graph, scenario)
    assert finish(graph, handle).outcome == ReachTarget.Result.REACHED
    first = graph.messages("/joint_trajectory_controller/joint_trajectory")[0]
    assert np.abs(np.array(first.points[0].positions) - start).max() < 1e-3
    assert largest_reference_step(graph) < 0.02


def fail_replans(graph: Graph, monkeypatch: pytest.MonkeyPatch, error: Exception) -> None:
    """From now on, every replan raises."""

    def replan(*_: Any, **__: Any) -> None:
        raise error

    monkeypatch.setattr(graph.nodes["ptomp"].replanning.planner, "replan", replan)


WITHOUT_TIMEOUT = {"simulator": {"command_timeout": 0.0}}
"""The controller does not notice that plans stay away: the ptomp node must."""


@pytest.mark.parametrize("error", [PlanningError("no such plan"), DataError("no such forecast")])
def test_replans_that_keep_failing_stop_the_robot(
    make_graph: Callable[..., Graph],
    scenario: Scenario,
    monkeypatch: pytest.MonkeyPatch,
    error: Exception,
) -> None:
    graph = make_graph(parameters=WITHOUT_TIMEOUT)
    graph.run(0.4)
    handle = start_reach(graph, scenario)
    run_into_motion(graph)
    since = graph.now_s
    fail_replans(graph, monkeypatch, error)
    graph.run(0.5)
    # 36 ms to the next replan, 120 ms late_timeout, 70 ms ramp; ticks and the time to settle.
    assert stop_time_ms(graph, since) <= 36 + 120 + 70 + 74
    assert largest_reference_step(graph) < 0.02
    status = graph.messages("/ptomp/status")[-1]
    assert status.stage == PlannerStatus.STOPPING
    assert "late" in status.reason
    assert str(error) in status.reason
    assert graph.messages("/separation/speed_scale")[-1].data == 0.0
    result = finish(graph, handle, 3.0)
    assert result.outcome == ReachTarget.Result.FAILED
    assert str(error) in result.reason
    assert np.abs(newest_speed(graph)).max() < 1e-3
    # As soon as replans work again, so does the node.
    monkeypatch.undo()
    assert finish(graph, start_reach(graph, scenario)).outcome == ReachTarget.Result.REACHED


def test_replans_that_fail_for_a_while(
    make_graph: Callable[..., Graph], scenario: Scenario, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The robot stops and goes on; while it holds the goal, failures are noticed in the same way."""
    graph = make_graph(parameters=WITHOUT_TIMEOUT)
    graph.run(0.4)
    handle = start_reach(graph, scenario)
    run_into_motion(graph)
    fail_replans(graph, monkeypatch, PlanningError("no such plan"))
    graph.run(0.6)
    monkeypatch.undo()
    assert finish(graph, handle).outcome == ReachTarget.Result.REACHED
    assert largest_reference_step(graph) < 0.02
    fail_replans(graph, monkeypatch, PlanningError("no such plan"))
    graph.run(0.3)
    assert graph.messages("/separation/speed_scale")[-1].data == 0.0
    monkeypatch.undo()
    graph.run(0.3)
    assert graph.messages("/separation/speed_scale")[-1].data == 1.0
    assert graph.messages("/ptomp/status")[-1].stage == PlannerStatus.HOLDING
    node = graph.nodes["ptomp"]
    assert node.health()[2]["failed_replans"] > 10


def test_plans_that_leave_the_limits_are_never_followed(
    make_graph: Callable[..., Graph], scenario: Scenario, monkeypatch: pytest.MonkeyPatch
) -> None:
    graph = make_graph(parameters=WITHOUT_TIMEOUT)
    graph.run(0.4)
    handle = start_reach(graph, scenario)
    run_into_motion(graph)
    since = graph.now_s
    monkeypatch.setattr(planner, "keeps_limits", lambda robot, plan: False)
    result = finish(graph, handle, 4.0)
    assert result.outcome == ReachTarget.Result.FAILED
    assert "joint limits" in result.reason
    assert stop_time_ms(graph, since) <= 300
    assert largest_reference_step(graph) < 0.02


def test_without_a_heartbeat_of_its_own_the_planner_stops_the_robot_too(
    make_graph: Callable[..., Graph], scenario: Scenario
) -> None:
    """Where a separation monitor supplies the heartbeat, the planner stops by an empty trajectory."""
    parameters = {"simulator": {"command_timeout": 0.0}, "ptomp": {"heartbeat": False}}
    graph = make_graph(parameters=parameters)
    graph.run(0.4)
    handle = start_reach(graph, scenario)
    run_into_motion(graph)
    since = graph.now_s
    graph.kill("predictor")
    graph.run(0.5)
    with pytest.raises(GraphError, match="no node announces /separation/speed_scale"):
        graph.messages("/separation/speed_scale")
    assert stop_time_ms(graph, since) <= 200
    assert graph.messages("/joint_trajectory_controller/joint_trajectory")[-1].points == []
    result = finish(graph, handle, 4.0)
    assert result.outcome == ReachTarget.Result.LOST_INPUT
    assert largest_reference_step(graph) < 0.02


def test_the_planner_s_clock_goes_back(graph: Graph, scenario: Scenario) -> None:
    graph.run(2.0)
    handle = start_reach(graph, scenario)
    run_into_motion(graph)
    node, since = graph.nodes["ptomp"], graph.now_s
    node.tick(seconds_to_ns(graph.now_s - 1.5))
    graph.run_until(lambda: handle.done, 1.0)
    assert handle.result is not None
    assert handle.result.outcome == ReachTarget.Result.FAILED
    assert "clock went back" in handle.result.reason
    assert any("clock went back" in fault for fault in node.faults)
    graph.run(0.5)
    assert stop_time_ms(graph, since) <= 200
    assert largest_reference_step(graph) < 0.02
    assert finish(graph, start_reach(graph, scenario)).outcome == ReachTarget.Result.REACHED


def test_the_reason_of_a_stop_follows_its_cause(graph: Graph, scenario: Scenario) -> None:
    graph.run(0.4)
    handle = start_reach(graph, scenario)
    run_into_motion(graph)
    graph.kill("predictor")
    graph.run(0.5)
    assert "person1" in graph.messages("/ptomp/status")[-1].reason
    graph.kill("simulator")
    graph.run(0.4)
    newest = graph.messages("/ptomp/status")[-1]
    assert "/joint_states" in newest.reason
    assert newest.stage == PlannerStatus.STOPPING
    # Told again and again, but not with every tick.
    told = [m for m in graph.messages("/ptomp/status") if m.stage == PlannerStatus.STOPPING]
    assert len(told) < 15
    assert finish(graph, handle, 4.0).outcome == ReachTarget.Result.LOST_INPUT


def test_kill_names_the_nodes_there_are(graph: Graph) -> None:
    with pytest.raises(GraphError, match="person, predictor, ptomp, simulator"):
        graph.kill("nobody")


def test_plans_that_are_always_late_stop_the_robot_for_good(
    graph: Graph, scenario: Scenario
) -> None:
    graph.run(0.4)
    handle = start_reach(graph, scenario)
    run_into_motion(graph)
    node = graph.nodes["ptomp"]
    assert isinstance(node, PtompNode)
    node.replanning.worker = SlowWorker(node, 0.06)  # type: ignore[assignment]
    begin = graph.now_s
    result = finish(graph, handle, 6.0)
    assert result.outcome == ReachTarget.Result.FAILED
    assert "late" in result.reason
    assert graph.messages("/ptomp/status")[-1].deadline_misses > 20
    stamps, _, qd = joints(graph)
    # Not only stopped, but never started again.
    assert np.abs(qd[stamps > begin + 0.4]).max() < 1e-2


def test_a_cancelled_robot_that_is_not_seen_any_more(graph: Graph, scenario: Scenario) -> None:
    graph.run(0.4)
    handle = start_reach(graph, scenario)
    run_into_motion(graph)
    graph.kill("simulator")
    graph.cancel(handle)
    result = finish(graph, handle, 4.0)
    assert result.outcome == ReachTarget.Result.LOST_INPUT
    assert "not seen to come to rest" in result.reason


def test_every_interval_without_a_plan_counts(graph: Graph, scenario: Scenario) -> None:
    """Also those in which no replan began, as the one before took so long."""
    graph.run(0.4)
    start_reach(graph, scenario)
    run_into_motion(graph)
    node = graph.nodes["ptomp"]
    assert isinstance(node, PtompNode)
    before = graph.messages("/ptomp/status")[-1].deadline_misses
    # Just short of what stops the robot: 36 ms intervals, of which one plan takes 80 ms.
    node.replanning.worker = SlowWorker(node, 0.08)  # type: ignore[assignment]
    graph.run(0.036 + 0.088)
    node.replanning.worker = SlowWorker(node, 0.0)  # type: ignore[assignment]
    graph.run(0.1)
    assert graph.messages("/ptomp/status")[-1].deadline_misses - before == 2
