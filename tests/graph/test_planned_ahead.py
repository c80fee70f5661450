"""A planner that plans once has, before the robot sets off, as long as the motion is to take."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import pytest
from motions import finish, joints, largest_reference_step, run_into_motion, start_reach

from hri_planner.ptomp.budget import START_S, VirtualTimeBudget, replan_charge
from hri_prediction.ros.messages import PlannerStatus, ReachTarget
from hri_prediction.ros.time import to_ns
from hri_sim.scenario.schema import Scenario
from hri_sim.testing import Graph

STOMP = {"ptomp": {"variant": "stomp"}}
Grants = list[tuple[float, int, int, float]]


@pytest.fixture
def grants(monkeypatch: pytest.MonkeyPatch) -> Grants:
    """What virtual time is asked for."""
    asked: Grants = []
    plain = VirtualTimeBudget.grant

    def note(self: VirtualTimeBudget, *given: Any) -> int | None:
        asked.append(given)
        return plain(self, *given)

    monkeypatch.setattr(VirtualTimeBudget, "grant", note)
    return asked


def beats_without_a_gap(graph: Graph) -> bool:
    ticks = [time_ns for time_ns, _ in graph.log["/separation/speed_scale"]]
    return max(b - a for a, b in pairwise(ticks)) <= 24_000_000


def test_stomp_plans_for_the_whole_duration_before_it_sets_off(
    make_graph: Callable[..., Graph], scenario: Scenario, grants: Grants
) -> None:
    graph = make_graph(parameters=STOMP)
    graph.run(0.4)
    begin_s = graph.now_s
    start_reach(graph, scenario)
    run_into_motion(graph, 0.1)
    duration = scenario.reaches[0].duration
    planner = graph.nodes["ptomp"].replanning.planner

    charge = replan_charge(planner.config) + START_S
    assert grants == [(pytest.approx(duration), 30, 42, pytest.approx(charge))]
    stamps, _, speeds = joints(graph)
    still = abs(speeds[stamps < begin_s + duration]).max()
    assert still < 0.02
    assert graph.now_s < begin_s + duration + 0.5
    told = graph.messages("/ptomp/status")
    planning = [m for m in told if "plans once" in m.reason]
    assert len(planning) >= 10 * duration - 1
    assert {m.stage for m in planning} == {PlannerStatus.WAITING}
    assert not any(m.stage == PlannerStatus.STOPPING or m.deadline_misses for m in told)
    first = next(m for m in told if m.costs)
    assert to_ns(first.handover) * 1e-9 == pytest.approx(begin_s + duration, abs=0.02)
    assert 0.0 < (to_ns(first.handover) - to_ns(first.header.stamp)) * 1e-9 < 0.0361
    assert beats_without_a_gap(graph)
    assert largest_reference_step(graph) < 0.02


def test_a_newer_goal_is_planned_for_from_rest(
    make_graph: Callable[..., Graph], scenario: Scenario
) -> None:
    graph = make_graph(parameters=STOMP)
    graph.run(0.4)
    first = start_reach(graph, scenario)
    run_into_motion(graph)
    second = start_reach(graph, scenario, 1)
    result = finish(graph, second)
    assert first.result is not None
    assert first.result.outcome == ReachTarget.Result.PREEMPTED
    assert result.outcome == ReachTarget.Result.REACHED, result.reason
    assert result.duration > 2.0 * scenario.reaches[1].duration
    assert largest_reference_step(graph) < 0.02
    assert not graph.nodes["ptomp"].health()[2]["plans_off_path"]


def test_lockstep_charges_what_the_benchmark_does(
    make_graph: Callable[..., Graph], scenario: Scenario, grants: Grants
) -> None:
    """Predictions and postures cost time too."""
    graph = make_graph()
    graph.run(0.4)
    finish(graph, start_reach(graph, scenario))
    planner = graph.nodes["ptomp"].replanning.planner
    charge = replan_charge(planner.config)
    assert grants[0] == (pytest.approx(0.036), 30, 42, pytest.approx(charge + START_S))
    assert {given[3] for given in grants[1:]} == {charge}


def test_a_replan_for_which_there_is_no_time_is_a_miss(
    make_graph: Callable[..., Graph], scenario: Scenario
) -> None:
    graph = make_graph(parameters={"ptomp": {"slowdown": 20.0, "late_timeout": 1.0}})
    graph.run(0.4)
    finish(graph, start_reach(graph, scenario))
    last = [m for m in graph.messages("/ptomp/status") if m.costs][-1]
    # 74 ms for what is fixed, of intervals of 36 ms: every second or third brings a plan.
    assert 0.8 * last.replan < last.deadline_misses < 3 * last.replan
