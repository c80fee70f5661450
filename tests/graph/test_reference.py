"""The controller's reference comes in another order, or in a way that cannot be used."""

from collections.abc import Callable
from typing import Any

import pytest
from motions import finish, largest_reference_step, run_into_motion, start_reach, stop_time_ms

from hri_prediction.ros.messages import ControllerState, ReachTarget
from hri_prediction.ros.node import HriNode
from hri_prediction.ros.qos import SENSOR
from hri_sim.scenario.schema import Scenario
from hri_sim.testing import Graph

REFERENCE = "joint_trajectory_controller/reference"
RAW = "raw/reference"


class OtherController(HriNode):
    """Passes the reference on in reversed order, with a gripper in front; for a time without numbers."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__("controller", period_s=0.004, **kwargs)
        self._out = self.announce(ControllerState, REFERENCE, SENSOR)
        self._ready: list[ControllerState] = []
        self.broken = False
        self.listen(ControllerState, RAW, self._ready.append, SENSOR)

    def on_tick(self, now_ns: int) -> None:
        for message in self._ready:
            message.joint_names = ["gripper", *reversed(message.joint_names)]
            message.reference_position = [7.0, *reversed(message.reference_position)]
            message.reference_velocity = [7.0, *reversed(message.reference_velocity)]
            if self.broken:
                message.reference_position[3] = float("nan")
            self._out.publish(message)
        self._ready.clear()


@pytest.fixture
def other(make_graph: Callable[..., Graph]) -> Graph:
    graph = make_graph(remappings={"simulator": {REFERENCE: RAW}}, others=[OtherController])
    graph.run(0.4)
    return graph


def test_another_order_and_a_while_without_numbers(other: Graph, scenario: Scenario) -> None:
    controller = other.nodes["controller"]
    assert isinstance(controller, OtherController)
    handle = start_reach(other, scenario)
    run_into_motion(other)
    controller.broken = True
    broken = other.now_s
    other.run(0.5)
    took = stop_time_ms(other, broken)
    assert took <= 200.0
    assert any("not finite" in fault for fault in other.nodes["ptomp"].faults)
    assert "not finite" in other.messages("/ptomp/status")[-1].reason
    controller.broken = False
    assert finish(other, handle).outcome == ReachTarget.Result.REACHED
    raw = other.messages("/" + RAW)
    assert max(message.max_handover_jump for message in raw) < 1e-3
    assert largest_reference_step(other, "/" + RAW) < 0.02
    print(f"reference without numbers: at rest after {took:.0f} ms")
