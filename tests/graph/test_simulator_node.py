"""The simulator node by itself: a plain trajectory controller, its refusals, reset, and /clock."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pinocchio
import pytest
import rclpy
from builtin_interfaces.msg import Duration
from motions import joints
from rclpy.context import Context
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from std_msgs.msg import Float64
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from hri_planner.robot.model import load_robot
from hri_prediction.errors import ConfigError
from hri_prediction.ros.messages import ControllerState, Reset
from hri_prediction.ros.node import HriNode
from hri_prediction.ros.qos import reliable
from hri_prediction.ros.time import to_ns, to_time
from hri_sim.nodes.simulator_node import SimulatorNode
from hri_sim.scenario.schema import Scenario
from hri_sim.simulator.stopchain import NO_HEARTBEAT
from hri_sim.testing import Graph, node_factory
from hri_sim.testing.domain import own_domain

COMMAND = "joint_trajectory_controller/joint_trajectory"


@pytest.fixture
def simulator() -> Iterator[Graph]:
    with Graph([SimulatorNode]) as graph:
        graph.run(0.1)
        yield graph


def ramp(graph: Graph, to: np.ndarray, seconds: float, names: Any = None) -> JointTrajectory:
    start = joints(graph)[1][-1]
    message = JointTrajectory(joint_names=list(names or load_robot().joint_names))
    for share in (0.0, 0.5, 1.0):
        whole, rest = divmod(round((0.1 + share * seconds) * 1e9), 10**9)
        message.points.append(
            JointTrajectoryPoint(
                positions=start + share * (to - start),
                velocities=np.zeros(7) if share in (0.0, 1.0) else (to - start) / seconds,
                time_from_start=Duration(sec=whole, nanosec=rest),
            )
        )
    return message


def send(graph: Graph, message: JointTrajectory) -> None:
    graph.publish(JointTrajectory, COMMAND, message, reliable(1))


def test_plain_trajectory_client(simulator: Graph) -> None:
    goal = joints(simulator)[1][-1] + np.array([0.3, 0.1, 0.2, -0.2, 0.1, 0.1, 0.4])
    send(simulator, ramp(simulator, goal, 1.0))
    simulator.run(1.5)
    stamps, q, qd = joints(simulator)
    assert np.abs(q[-1] - goal).max() < 1e-3
    assert np.abs(qd[-1]).max() < 1e-2
    assert np.allclose(np.diff(stamps), 0.004)
    assert len(simulator.log["/joint_states"]) == 400
    states = {m.state for m in simulator.messages("/joint_trajectory_controller/reference")}
    assert states == {ControllerState.IDLE, ControllerState.TRACKING}


def test_a_stop_right_after_a_plan_is_the_last_word(simulator: Graph) -> None:
    """Its stamp is zero, that of the plan lies ahead: the order is that of arrival all the same."""
    start = joints(simulator)[1][-1]
    plan = ramp(simulator, start + 0.3, 1.0)
    plan.header.stamp = to_time(round((simulator.now_s + 0.02) * 1e9))
    send(simulator, plan)
    send(simulator, JointTrajectory(joint_names=list(load_robot().joint_names)))
    simulator.run(0.5)
    assert np.abs(joints(simulator)[1][-1] - start).max() < 1e-3
    newest = simulator.messages("/joint_trajectory_controller/reference")[-1]
    assert newest.state == ControllerState.IDLE


def test_joints_in_another_order(simulator: Graph) -> None:
    names = load_robot().joint_names
    goal = joints(simulator)[1][-1] + np.array([0.3, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    message = ramp(simulator, goal, 1.0)
    message.joint_names = list(reversed(names))
    for point in message.points:
        point.positions = list(reversed(point.positions))
        point.velocities = list(reversed(point.velocities))
    send(simulator, message)
    simulator.run(1.5)
    assert np.abs(joints(simulator)[1][-1] - goal).max() < 1e-3


def test_a_stop_counts_though_the_plan_after_it_is_refused(simulator: Graph) -> None:
    """Both come between two ticks."""
    start = joints(simulator)[1][-1]
    send(simulator, ramp(simulator, start + 0.3, 1.0))
    simulator.run(0.5)
    moving = joints(simulator)[1][-1]
    refused = ramp(simulator, start + 0.3, 1.0)
    refused.points[1].positions = np.full(7, np.nan)
    send(simulator, JointTrajectory(joint_names=list(load_robot().joint_names)))
    send(simulator, refused)
    simulator.run(0.5)
    assert np.abs(moving - start).max() > 0.02
    assert np.abs(joints(simulator)[1][-1] - moving).max() < 0.05
    newest = simulator.messages("/joint_trajectory_controller/reference")[-1]
    assert newest.state == ControllerState.IDLE


def test_what_waits_for_a_tick_is_forgotten_with_a_reset(simulator: Graph) -> None:
    node = simulator.nodes["simulator"]
    node._on_command(ramp(simulator, joints(simulator)[1][-1] + 0.3, 1.0), 0)
    assert node._on_reset(Reset.Request(), Reset.Response()).success
    simulator.run(0.5)
    newest = simulator.messages("/joint_trajectory_controller/reference")[-1]
    assert newest.state == ControllerState.IDLE


def _other_names(message: JointTrajectory) -> None:
    message.joint_names = [f"panda_joint{i}" for i in range(7)]


def _too_few(message: JointTrajectory) -> None:
    message.joint_names = message.joint_names[:5]


def _not_a_number(message: JointTrajectory) -> None:
    message.points[1].positions = np.full(7, np.nan)


def _beyond_the_limits(message: JointTrajectory) -> None:
    message.points[2].positions = np.full(7, 9.0)


def _times_go_back(message: JointTrajectory) -> None:
    message.points[2].time_from_start = Duration()


def _missing_velocities(message: JointTrajectory) -> None:
    message.points[1].velocities = []


@pytest.mark.parametrize(
    "spoil",
    [
        _other_names,
        _too_few,
        _not_a_number,
        _beyond_the_limits,
        _times_go_back,
        _missing_velocities,
    ],
)
def test_unusable_trajectories_are_refused(
    simulator: Graph, spoil: Callable[[JointTrajectory], None]
) -> None:
    before = joints(simulator)[1][-1]
    message = ramp(simulator, before + 0.2, 1.0)
    spoil(message)
    send(simulator, message)
    simulator.run(0.5)
    assert np.abs(joints(simulator)[1][-1] - before).max() < 1e-3
    assert any("refused" in fault for fault in simulator.nodes["simulator"].faults)
    newest = simulator.messages("/joint_trajectory_controller/reference")[-1]
    assert newest.state == ControllerState.IDLE
    assert newest.reason
    print(simulator.nodes["simulator"].faults)


def test_reset_with_a_seed_brings_the_same_state(simulator: Graph) -> None:
    postures = []
    for seed in (7, 8, 7):
        send(simulator, ramp(simulator, joints(simulator)[1][-1] + 0.1, 0.3))
        simulator.run(0.2)
        answer = simulator.call(Reset, "/simulator/reset", Reset.Request(seed=seed))
        assert answer.success, answer.message
        count = len(simulator.log["/joint_states"])
        simulator.run(0.1)
        stamps, q, qd = joints(simulator)
        postures.append((q[count:], qd[count:]))
        assert np.all(np.diff(stamps) > 0.0)
        assert simulator.messages("/sim/state")[-1].time == pytest.approx(0.1)
    assert np.array_equal(postures[0][0], postures[2][0])
    assert np.array_equal(postures[0][1], postures[2][1])


def test_reset_refuses_what_it_cannot_load(simulator: Graph) -> None:
    request = Reset.Request(seed=1, scenario="/nowhere/at/all.yaml")
    answer = simulator.call(Reset, "/simulator/reset", request)
    assert not answer.success
    assert "/nowhere/at/all.yaml" in answer.message
    simulator.run(0.05)


def test_robot_description_is_a_urdf(simulator: Graph) -> None:
    (message,) = simulator.messages("/robot_description")
    model = pinocchio.buildModelFromXML(message.data)
    names = [name for name in model.names if name != "universe"]
    assert tuple(names) == load_robot().joint_names


def test_publish_clock_excludes_following_it() -> None:
    factory = node_factory(SimulatorNode, parameters={"publish_clock": True, "use_sim_time": True})
    with pytest.raises(ConfigError, match="publish_clock"):
        Graph([factory])


class Stalling(SimulatorNode):
    """A simulator that hears, but does not simulate for a while."""

    stalled = False

    def on_tick(self, now_ns: int) -> None:
        if not self.stalled:
            super().on_tick(now_ns)


@pytest.mark.parametrize(
    ("died_s", "reason"), [(0.6, NO_HEARTBEAT), (1.0, "")], ids=["long ago", "just now"]
)
def test_heartbeats_of_a_time_that_is_not_made_up_for(died_s: float, reason: str) -> None:
    """Of a second half is made up for. Who sent them is gone when simulated time goes on, or was not."""
    parameters = {"command_timeout": 10.0, "heartbeat_timeout": 0.032}
    with Graph([node_factory(Stalling, parameters=parameters)]) as graph:
        node = graph.nodes["simulator"]
        assert isinstance(node, Stalling)

        def beat(seconds: float) -> None:
            for _ in range(round(seconds / 0.008)):
                graph.publish(Float64, "separation/speed_scale", Float64(data=1.0), reliable(1))
                graph.run(0.008)

        beat(0.1)
        send(graph, ramp(graph, joints(graph)[1][-1] + 0.3, 4.0))
        beat(0.4)
        stalled_s = graph.now_s
        node.stalled = True
        beat(died_s)
        graph.run(1.0 - died_s)
        node.stalled = False
        graph.run(0.004)
        references = graph.messages("/joint_trajectory_controller/reference")
    reasons = {
        round(to_ns(m.header.stamp) * 1e-9 - stalled_s, 3): (m.reason, m.state) for m in references
    }
    made_up = {said for after_s, said in reasons.items() if 0.0 < after_s <= 0.5}
    assert made_up == {("", ControllerState.TRACKING)}
    assert max(reasons) == pytest.approx(1.004)
    assert reasons[max(reasons)][0] == reason


def test_with_the_clock_of_somebody_else_all_that_came_counts_right_after_the_last_tick() -> None:
    """That may go at any speed: what a wall clock says of when something came is no help."""
    parameters = {"command_timeout": 10.0, "heartbeat_timeout": 0.032, "use_sim_time": True}
    with Graph([node_factory(Stalling, parameters=parameters)]) as graph:
        node = graph.nodes["simulator"]
        assert isinstance(node, Stalling)
        graph.run(0.1)
        stalled_s = graph.now_s
        node.stalled = True
        for _ in range(10):
            graph.publish(Float64, "separation/speed_scale", Float64(data=1.0), reliable(1))
            graph.run(0.008)
        node.stalled = False
        graph.run(0.004)
        scales = {
            round(to_ns(m.header.stamp) * 1e-9 - stalled_s, 3): m.speed_scale
            for m in graph.messages("/joint_trajectory_controller/reference")
        }
    assert {scale for after_s, scale in scales.items() if 0.0 < after_s <= 0.032} == {1.0}
    assert {scale for after_s, scale in scales.items() if 0.036 < after_s <= 0.08} == {0.0}


def test_a_plain_controller_goes_by_the_last_word_however_long_ago_that_was_said() -> None:
    with Graph([node_factory(Stalling, parameters={"heartbeat_timeout": 0.032})]) as graph:
        node = graph.nodes["simulator"]
        assert isinstance(node, Stalling)
        graph.run(0.1)
        node.stalled = True
        for scale in (0.25, 0.75):
            graph.run(0.6)
            graph.publish(Float64, "separation/speed_scale", Float64(data=scale), reliable(1))
        graph.run(0.6)
        node.stalled = False
        graph.run(0.1)
        newest = graph.messages("/joint_trajectory_controller/reference")[-1]
    assert newest.speed_scale == 0.75


class Counter(HriNode):
    """Notes the times of its ticks."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("counter", period_s=0.02, **kwargs)
        self.times: list[float] = []

    def on_tick(self, now_ns: int) -> None:
        self.times.append(now_ns * 1e-9)


@pytest.mark.alone
def test_clock_drives_a_node_with_use_sim_time() -> None:
    """Twice real time: 2 s of wall clock are 4 s of the node's. A busy machine must still keep up."""
    context = Context()
    rclpy.init(context=context, domain_id=own_domain())
    clock = SimulatorNode(
        context=context,
        parameter_overrides=[
            Parameter("publish_clock", value=True),
            Parameter("realtime_factor", value=2.0),
        ],
    )
    counter = Counter(context=context, parameter_overrides=[Parameter("use_sim_time", value=True)])
    executor = EventsExecutor(context=context)
    executor.add_node(clock)
    executor.add_node(counter)
    try:
        end = time.monotonic() + 0.5
        while time.monotonic() < end:
            executor.spin_once(timeout_sec=0.01)
        begin, first = time.monotonic(), clock.now_ns()
        counter.times.clear()
        while time.monotonic() < begin + 2.0:
            executor.spin_once(timeout_sec=0.01)
        wall, passed = time.monotonic() - begin, (clock.now_ns() - first) * 1e-9
    finally:
        executor.shutdown()
        clock.destroy_node()
        counter.destroy_node()
        rclpy.try_shutdown(context=context)
    ticks = np.array(counter.times)
    assert passed == pytest.approx(2.0 * wall, rel=0.02)
    assert ticks[-1] - ticks[0] == pytest.approx(passed, abs=0.5)
    assert len(ticks) == pytest.approx(passed / 0.02, rel=0.1)
    print(f"{passed:.2f} s of /clock in {wall:.2f} s, {len(ticks)} ticks")


class Hearing(SimulatorNode):
    """Notes how long before a tick each heartbeat came, and what it said."""

    def __init__(self, **kwargs: Any) -> None:
        self.heard: list[tuple[float, float]] = []
        super().__init__(**kwargs)

    def _on_command(self, message: Any, receipt_ns: int) -> None:
        self.heard.append(((self.tick_ns - receipt_ns) * 1e-9, message.data))
        super()._on_command(message, receipt_ns)


@pytest.mark.alone
@pytest.mark.parametrize("factor", [1.0, 10.0])
def test_when_a_command_came_is_told_by_the_clock_of_the_simulation(factor: float) -> None:
    """So much before a tick as it was sent before it, times the speed of that clock."""
    context = Context()
    rclpy.init(context=context, domain_id=own_domain())
    node = Hearing(
        context=context,
        parameter_overrides=[
            Parameter("publish_clock", value=True),
            Parameter("realtime_factor", value=factor),
        ],
    )
    sender = Node("sender", context=context)
    publisher = sender.create_publisher(Float64, "separation/speed_scale", reliable(10))
    executor = EventsExecutor(context=context)
    executor.add_node(node)
    try:
        end = time.monotonic() + 10.0
        while not publisher.get_subscription_count() and time.monotonic() < end:
            executor.spin_once(timeout_sec=0.01)
        node.heard.clear()
        sent = []
        for scale in (0.1, 0.2, 0.3):
            sent.append(time.monotonic())
            publisher.publish(Float64(data=scale))
            time.sleep(0.3)
        end = time.monotonic() + 1.0
        while len(node.heard) < 3 and time.monotonic() < end:
            executor.spin_once(timeout_sec=0.01)
    finally:
        executor.shutdown()
        node.destroy_node()
        sender.destroy_node()
        rclpy.try_shutdown(context=context)
    ages, scales = zip(*node.heard, strict=True)
    assert scales == (0.1, 0.2, 0.3)
    assert -np.diff(ages) == pytest.approx(factor * np.diff(sent), rel=0.2)


def test_how_fast_the_robot_comes_at_somebody_is_told(
    make_graph: Callable[..., Graph], scenario: Scenario
) -> None:
    """Distances of a robot that moves while the person rests shrink as fast as it says."""
    graph = make_graph(parameters={"simulator": {"command_timeout": 0.0}})
    graph.run(0.5)
    goal = joints(graph)[1][-1] + np.array([0.5, 0.2, 0.3, -0.3, 0.2, 0.2, 0.4])
    send(graph, ramp(graph, goal, 1.0))
    begun = len(graph.messages("/sim/state"))
    graph.run(1.0)
    states = graph.messages("/sim/state")[begun:]
    times = np.array([state.time for state in states])
    gaps = np.array([state.clearance for state in states])
    said = np.array([state.approach for state in states])
    pairs = [(state.robot_part, state.human_part) for state in states]
    same = np.array([a == b == c for a, b, c in zip(pairs, pairs[1:], pairs[2:], strict=False)])
    slope = -(gaps[2:] - gaps[:-2]) / (times[2:] - times[:-2])
    assert np.abs(said).max() > 0.1
    assert same.sum() > 100
    # The person at rest is not quite at rest: their hand trembles.
    assert np.median(np.abs(said[1:-1] - slope)[same]) < 0.01
