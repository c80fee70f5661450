"""What launched runs make of a person with both arms: the monitor, the record, the coverage, the goals."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("hri_msgs.msg")

from rclpy.serialization import serialize_message

from hri_prediction.bags import BagWriter, TopicInfo
from hri_prediction.ros.messages import HumanArm, HumanPrediction, SimState
from hri_prediction.ros.time import to_time
from hri_sim.launch.coverage import prediction_coverage
from hri_sim.launch.leading import Leading
from hri_sim.launch.record import read_run
from hri_sim.launch.run_bags import RunBags
from hri_sim.launch.separation import OFF, separation_specs
from hri_sim.scenario.schema import Scenario
from hri_sim.scenario.shipped import load_shipped

MS = 1_000_000
TIMES = range(1000, 2000, 4)
PLACES = {"right": 1.0, "left": 2.0}


@pytest.fixture
def scenario() -> Scenario:
    return load_shipped("table_reach")


@pytest.fixture
def whole(scenario: Scenario) -> Scenario:
    (person,) = scenario.persons
    return scenario.model_copy(update={"persons": (person.model_copy(update={"both_arms": True}),)})


def test_both_arms_are_waited_for_where_all_people_have_both(
    scenario: Scenario, whole: Scenario
) -> None:
    def arms(one: Scenario) -> Any:
        (spec,) = separation_specs("measured", one)
        return spec.parameters["arms"]

    assert (arms(scenario), arms(whole)) == ("seen", "both")
    mixed = whole.model_copy(update={"persons": (*whole.persons, *scenario.persons)})
    assert arms(mixed) == "seen"
    assert arms(scenario.model_copy(update={"persons": (), "reaches": ()})) == "seen"
    assert separation_specs(OFF, whole) == []


def test_beside_real_people_the_monitor_is_as_it_starts(scenario: Scenario) -> None:
    """No evasion, no touch, trunk and head and both arms, whatever people the scene has."""
    (spec,) = separation_specs("measured", scenario, real=True)
    assert spec.parameters == {"human": "measured"}
    assert separation_specs(OFF, scenario, real=True) == []


def arm(side: str, stamp_ns: int) -> HumanArm:
    points = np.full((4, 3), PLACES[side]) + 0.1 * np.arange(4)[:, None]
    message = HumanArm(body_id="person1", side=side, keypoints=points.ravel(), valid=[True] * 4)
    message.header.stamp = to_time(stamp_ns)
    return message


def prediction(side: str, stamp_ns: int) -> HumanPrediction:
    """What is true, known to a centimetre."""
    points = np.array(arm(side, stamp_ns).keypoints)
    message = HumanPrediction(body_id="person1", side=side, state=HumanPrediction.REACHING)
    message.header.stamp = to_time(stamp_ns)
    message.times = [0.0, 0.1]
    message.mean = np.tile(points, 2)
    message.covariance = np.tile(1e-4 * np.eye(3), (8, 1, 1)).ravel()
    return message


@pytest.fixture
def bag(tmp_path: Path) -> Path:
    """Of a run in which the two arms rest a metre apart."""
    from sensor_msgs.msg import JointState

    from hri_prediction.ros.messages import ControllerState, PlannerStatus

    make: dict[str, tuple[str, Callable[[int], list[Any]]]] = {
        "/sim/state": ("hri_msgs/msg/SimState", lambda ns: [stamped(SimState(clearance=1.0), ns)]),
        "/joint_states": (
            "sensor_msgs/msg/JointState",
            lambda ns: [stamped(JointState(position=[0.0] * 7), ns)],
        ),
        "/ptomp/status": (
            "hri_msgs/msg/PlannerStatus",
            lambda ns: [stamped(PlannerStatus(), ns)],
        ),
        "/joint_trajectory_controller/reference": (
            "hri_msgs/msg/ControllerState",
            lambda ns: [stamped(ControllerState(), ns)],
        ),
        "/sim/bodies/person1/arm": (
            "hri_msgs/msg/HumanArm",
            lambda ns: [arm(side, ns) for side in PLACES],
        ),
        "/humans/bodies/person1/prediction": (
            "hri_msgs/msg/HumanPrediction",
            lambda ns: [prediction(side, ns) for side in PLACES],
        ),
    }
    with BagWriter(tmp_path / "bag") as writer:
        for topic, (kind, messages) in make.items():
            channel = writer.add_topic(TopicInfo(topic, kind))
            for ms in TIMES:
                for message in messages(ms * MS):
                    writer.write(channel, serialize_message(message), ms * MS)
    return tmp_path / "bag"


def stamped(message: Any, stamp_ns: int) -> Any:
    message.header.stamp = to_time(stamp_ns)
    return message


def read(bag: Path, scenario: Scenario) -> Any:
    return read_run(RunBags.of([bag]), scenario, [], sensor_delay_s=0.0, title="").record


def test_a_record_has_a_row_for_each_arm(bag: Path, whole: Scenario, scenario: Scenario) -> None:
    record = read(bag, whole)
    assert record.arms.shape == (len(TIMES), 2, 4, 3)
    np.testing.assert_allclose(record.arms[:, 0, 0], PLACES["right"])
    np.testing.assert_allclose(record.arms[:, 1, 0], PLACES["left"])
    # Pictures show one prediction: that of the arm that reaches.
    assert {mark.mean[0, 0, 0] for mark in record.predictions} == {PLACES["right"]}
    # Of a person of one arm the first that is heard of is the one that is shown.
    alone = read(bag, scenario)
    assert alone.arms.shape == (len(TIMES), 1, 4, 3)
    np.testing.assert_allclose(alone.arms[:, 0, 0], PLACES["right"])


def test_predictions_are_held_against_the_arm_that_they_are_of(bag: Path) -> None:
    coverage = prediction_coverage(bag, "person1")
    assert coverage is not None
    assert coverage.predictions == 2 * len(TIMES)
    assert coverage.share_95 == 1.0
    assert coverage.error_m == pytest.approx(0.0, abs=1e-9)


def test_goals_follow_the_hand_that_reaches(scenario: Scenario, whole: Scenario) -> None:
    node = SimpleNamespace(create_publisher=lambda *a: None, create_subscription=lambda *a: None)
    for one, sides in ((whole, ["right"]), (scenario, ["left"])):
        seen: list[Any] = []

        def leader(index: int, elapsed_s: float, hand: Any, seen: list[Any] = seen) -> None:
            seen.append(hand)

        leading = Leading(node, "policy/goal", one, leader)
        for side in ("right", "left"):
            leading._on_arm(arm(side, 0))
        leading.lead(0, 0.0)
        (hand,) = seen
        np.testing.assert_allclose(hand, [PLACES[sides[0]] + 0.3] * 3)
