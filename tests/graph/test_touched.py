"""A hand that comes to rest on a robot that stands: it is waited for, and taken back; cues by hand."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from motions import finish, joints, run_into_motion

from hri_planner.robot.model import load_robot
from hri_planner.supervision.touch import TOUCHED
from hri_prediction.ros.messages import Cue, PlannerStatus, ReachTarget
from hri_prediction.ros.qos import reliable
from hri_prediction.ros.time import seconds_to_ns
from hri_sim.launch.withdrawing import Withdrawing
from hri_sim.scenario.schema import BACK, Scenario
from hri_sim.testing import Graph, ReachHandle, cue, node_factory, reach
from hri_sim.testing.spoiling import EmptyRoom

DURATION_S = 0.8


def stopped(graph: Graph, scenario: Scenario) -> ReachHandle:
    """On its way to a goal the robot is stopped, by somebody who is said to be there."""
    room = graph.nodes["empty_room"]
    assert isinstance(room, EmptyRoom)
    room.says_so = True
    graph.run(0.4)
    handle = reach(graph, scenario, 0)
    run_into_motion(graph)
    room.ids = ["person1", "body-7"]
    graph.run(0.3)
    return handle


def test_a_hand_that_is_left_on_the_robot_is_taken_back(
    make_graph: Callable[..., Graph], scenario: Scenario
) -> None:
    first = make_graph(others=[node_factory(EmptyRoom)])
    stopped(first, scenario)
    tool = load_robot().frames(joints(first)[1][-1])[3]
    first.close()

    # Once more, with a person who reaches for where the robot stands then.
    to_it = scenario.reaches[0].model_copy(
        update={"person_target": "tool", "person_delay": 0.0, "person_duration": DURATION_S}
    )
    place = tuple(float(value) for value in tool)
    onto = scenario.model_copy(
        update={"targets": {**scenario.targets, "tool": place}, "reaches": (to_it,)}
    )
    graph = make_graph(scenario=onto, others=[node_factory(EmptyRoom)])
    handle = stopped(graph, onto)
    withdrawing = Withdrawing(
        onto.persons,
        lambda message: graph.publish(Cue, "sim/cue", message, reliable(10)),
        lambda text: None,
    )
    cue(graph, onto, 0)
    withdrawing.begin(0, to_it, seconds_to_ns(graph.now_s))
    graph.run(1.3 * DURATION_S)
    room = graph.nodes["empty_room"]
    assert isinstance(room, EmptyRoom)
    room.ids = ["person1"]

    def status() -> PlannerStatus:
        newest: PlannerStatus = graph.messages("/ptomp/status")[-1]
        return newest

    def taken_back() -> bool:
        nearest = graph.messages("/sim/state")[-1].human_part
        return withdrawing.look(seconds_to_ns(graph.now_s), status().reason, nearest)

    graph.run(0.5)
    assert status().reason == TOUCHED
    while not taken_back():
        graph.run(0.02)
        assert graph.now_s < 10.0
    references = graph.messages("/joint_trajectory_controller/reference")
    assert np.ptp([m.reference_position for m in references[-100:]], axis=0).max() < 1e-6
    result = finish(graph, handle)
    assert result.outcome == ReachTarget.Result.REACHED, result.reason
    hands = graph.messages("/sim/bodies/person1/arm")
    np.testing.assert_allclose(hands[-1].keypoints[9:], hands[0].keypoints[9:], atol=0.05)


def test_cues_by_hand_have_no_stamp(make_graph: Callable[..., Graph], scenario: Scenario) -> None:
    """As ``ros2 topic pub`` sends them: they mean now."""
    graph = make_graph()
    target = scenario.reaches[0].person_target
    assert target is not None

    def told(name: str) -> tuple[float, float]:
        """How far the hand is from the target 0.2 s after the cue, and 2 s after it [m]."""
        graph.publish(Cue, "sim/cue", Cue(person_target=name, duration=1.0), reliable(10))
        graph.run(0.2)
        begun = hand()
        graph.run(1.8)
        return begun, hand()

    def hand() -> float:
        tip = graph.messages("/sim/bodies/person1/arm")[-1].keypoints[9:]
        return float(np.linalg.norm(tip - np.array(scenario.targets[target])))

    graph.run(0.4)
    far = hand()
    begun, ended = told(target)
    assert 0.5 * far < begun < far
    assert ended < 0.05
    begun, ended = told(BACK)
    assert begun < 0.5 * far
    assert abs(ended - far) < 0.05
    assert not graph.nodes["person"].faults
