"""Plans that reach the controller too late, or not at all: the robot's path stays without a jump."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

import numpy as np
import pytest
from motions import finish, largest_reference_step, run_into_motion, start_reach
from trajectory_msgs.msg import JointTrajectory

from hri_prediction.ros.messages import ReachTarget
from hri_prediction.ros.node import HriNode
from hri_prediction.ros.qos import reliable
from hri_prediction.ros.time import seconds_to_ns
from hri_sim.nodes.simulator_node import SimulatorNode
from hri_sim.scenario.schema import Scenario
from hri_sim.testing import Graph, reach, scenes

COMMAND = "joint_trajectory_controller/joint_trajectory"
RAW = "raw/joint_trajectory"
REFERENCE = "/joint_trajectory_controller/reference"
JUMP = 1e-3


class SlowLine(HriNode):
    """Passes trajectories on, for a time late."""

    def __init__(self, **kwargs: object) -> None:
        super().__init__("line", period_s=0.004, **kwargs)  # type: ignore[arg-type]
        self.delay_s = 0.0
        self._out = self.announce(JointTrajectory, COMMAND, reliable(1))
        self._waiting: deque[tuple[int, JointTrajectory]] = deque()
        self.listen(JointTrajectory, RAW, self._take, reliable(1), command=True)

    def _take(self, message: JointTrajectory) -> None:
        self._waiting.append((self.now_ns() + seconds_to_ns(self.delay_s), message))

    def on_tick(self, now_ns: int) -> None:
        if self._waiting and self._waiting[0][0] <= now_ns:
            self._out.publish(self._waiting.popleft()[1])


def assert_no_jump(graph: Graph) -> None:
    jump = max(m.max_handover_jump for m in graph.messages(REFERENCE))
    print(f"largest step at a hand-over: {jump:.1e} rad")
    assert jump <= JUMP
    assert largest_reference_step(graph) < 0.02
    speed = np.array([m.reference_velocity for m in graph.messages(REFERENCE)])
    assert np.abs(np.diff(speed, axis=0)).max() / 0.004 < 40.0


def test_plans_that_begin_in_the_past(make_graph: Callable[..., Graph], scenario: Scenario) -> None:
    graph = make_graph(remappings={"ptomp": {COMMAND: RAW}}, others=[SlowLine])
    line = graph.nodes["line"]
    assert isinstance(line, SlowLine)
    graph.run(0.5)
    first = reach(graph, scenario, 0)
    run_into_motion(graph, 0.5)
    line.delay_s = 0.1
    second = reach(graph, scenario, 1)
    graph.run(0.4)
    line.delay_s = 0.0
    assert finish(graph, first).outcome == ReachTarget.Result.PREEMPTED
    assert finish(graph, second).outcome == ReachTarget.Result.REACHED
    assert_no_jump(graph)
    refused = graph.nodes["simulator"].health()[2]["trajectories_refused_as_late"]
    unfollowed = graph.nodes["ptomp"].health()[2]["plans_not_followed"]
    assert refused > 0
    assert unfollowed > 0
    print(f"{refused} plans refused as late, {unfollowed} not followed")


def test_a_first_plan_that_begins_in_the_past(
    make_graph: Callable[..., Graph], scenario: Scenario
) -> None:
    graph = make_graph(remappings={"ptomp": {COMMAND: RAW}}, others=[SlowLine])
    line = graph.nodes["line"]
    assert isinstance(line, SlowLine)
    graph.run(0.5)
    line.delay_s = 0.1
    handle = start_reach(graph, scenario)
    graph.run(0.12)
    line.delay_s = 0.0
    assert finish(graph, handle).outcome == ReachTarget.Result.REACHED
    assert_no_jump(graph)
    assert graph.nodes["simulator"].health()[2]["trajectories_refused_as_late"] > 0


class Stalling(SimulatorNode):
    """A simulator that is not run for a while, and whose plans then come as they were sent."""

    stall_s = (0.0, 0.0)

    def on_tick(self, now_ns: int) -> None:
        if not self._stalled(now_ns):
            super().on_tick(now_ns)

    def _stalled(self, now_ns: int) -> bool:
        return self.stall_s[0] <= now_ns * 1e-9 < self.stall_s[1]


class Stopped(Stalling):
    """One whose process is stopped: of the plans it then finds all at once, it takes the newest."""

    def tick(self, now_ns: int | None = None) -> None:
        if not self._stalled(self.now_ns() if now_ns is None else now_ns):
            super().tick(now_ns)


@pytest.mark.parametrize("kind", [Stalling, Stopped])
@pytest.mark.parametrize("stall_s", [0.05, 0.09])
def test_plans_that_overtake_each_other_in_a_stall(
    make_graph: Callable[..., Graph],
    scenario: Scenario,
    monkeypatch: pytest.MonkeyPatch,
    stall_s: float,
    kind: type[Stalling],
) -> None:
    monkeypatch.setitem(scenes.NODES, "simulator", kind)
    graph = make_graph()
    graph.run(0.5)
    reach(graph, scenario, 0)
    run_into_motion(graph, 0.5)
    monkeypatch.setattr(kind, "stall_s", (graph.now_s, graph.now_s + stall_s))
    second = reach(graph, scenario, 1)
    assert finish(graph, second).outcome == ReachTarget.Result.REACHED
    assert_no_jump(graph)
