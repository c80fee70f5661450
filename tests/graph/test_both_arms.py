"""A body with two arms: each is predicted, planned around and waited for on its own."""

from collections.abc import Callable, Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from motions import finish, run_into_motion, start_reach, stop_time_ms
from tampering import BothArms

from hri_planner.nodes.policy_node import PolicyNode
from hri_planner.nodes.ptomp_node import PtompNode
from hri_planner.nodes.separation_monitor_node import SeparationMonitorNode
from hri_planner.separation.config import (
    BOTH as BOTH_ARMS,
)
from hri_planner.separation.config import (
    BodyConfig,
    ProtectiveDistanceConfig,
    ReleaseConfig,
)
from hri_prediction.nodes.predictor_node import PredictorNode
from hri_prediction.ros.messages import (
    HumanArm,
    HumanPrediction,
    LoadModel,
    ReachTarget,
    Reset,
    SeparationStatus,
)
from hri_prediction.ros.node import ERROR, OK
from hri_prediction.ros.time import seconds_to_ns, to_ns
from hri_sim.scenario.schema import Scenario, save_scenario
from hri_sim.testing import Graph, node_factory, spoiling
from hri_sim.testing.spoiling import STILL, Tamper

RIGHT = STILL - np.array([0.0, 0.3, 0.0])
BOTH = {"left": STILL, "right": RIGHT}
PREDICTION = "/humans/bodies/ann/prediction"
MONITOR = "separation_monitor"
STATUS = "/separation/status"
OWN_DEFAULTS: dict[str, Any] = {
    **asdict(ProtectiveDistanceConfig()),
    **asdict(BodyConfig()),
    **asdict(ReleaseConfig()),
}
"""Of the monitor, where a launched run has others."""


@pytest.fixture
def predicted() -> Iterator[Graph]:
    with Graph([node_factory(BothArms, BOTH), PredictorNode], timeout_s=5.0) as graph:
        graph.run(0.3)
        yield graph


def newest(graph: Graph, side: str) -> HumanPrediction:
    return [message for message in graph.messages(PREDICTION) if message.side == side][-1]


def test_each_arm_of_a_body_is_predicted(predicted: Graph) -> None:
    for side, keypoints in BOTH.items():
        message = newest(predicted, side)
        assert message.state == HumanPrediction.IDLE
        mean = np.array(message.mean).reshape(-1, 4, 3)
        np.testing.assert_allclose(mean, np.broadcast_to(keypoints, mean.shape), atol=1e-9)
    sides = [message.side for message in predicted.messages(PREDICTION)]
    assert sides.count("left") == sides.count("right") > 10
    level, text, figures = predicted.nodes["predictor"].health()
    assert (level, text) == (OK, "ann left idle; ann right idle")
    assert figures["ann left samples"] == figures["ann right samples"] > 50
    assert not any("side changed" in name for name in figures)


def test_markers_of_both_arms_stand_beside_each_other(predicted: Graph) -> None:
    markers = predicted.messages("/humans/markers")[-1].markers
    assert len({(marker.ns, marker.id) for marker in markers}) == len(markers) == 2 * (1 + 8)
    ends = {
        marker.ns: marker.points[-1].y for marker in markers if marker.type == marker.LINE_STRIP
    }
    assert ends == pytest.approx({"ann left/arm": 0.31, "ann right/arm": 0.01})


def test_an_arm_that_falls_silent_is_invalid_and_the_other_is_not(predicted: Graph) -> None:
    source = predicted.nodes["both_arms"]
    assert isinstance(source, BothArms)
    del source.seen["left"]
    predicted.run(0.5)
    assert newest(predicted, "left").state == HumanPrediction.INVALID
    assert newest(predicted, "right").state == HumanPrediction.IDLE
    level, text, _ = predicted.nodes["predictor"].health()
    assert level == ERROR
    assert text.startswith("ann left invalid: no usable sample")
    assert text.endswith("; ann right idle")
    source.seen["left"] = STILL
    predicted.run(0.1)
    assert newest(predicted, "left").state == HumanPrediction.IDLE


def test_one_arm_has_the_name_of_its_body() -> None:
    with Graph([node_factory(BothArms, {"left": STILL}), PredictorNode], timeout_s=5.0) as graph:
        graph.run(0.3)
        _, text, figures = graph.nodes["predictor"].health()
        assert text == "ann idle"
        assert figures["ann samples"] > 50
        assert {m.ns for m in graph.messages("/humans/markers")[-1].markers} == {
            "ann/arm",
            "ann/prediction",
        }


def test_another_library_is_for_both_arms(predicted: Graph, library: Path) -> None:
    predictor = predicted.nodes["predictor"]
    assert isinstance(predictor, PredictorNode)
    response = predictor._on_load_model(LoadModel.Request(path=str(library)), LoadModel.Response())
    assert response.success, response.message
    predicted.run(0.1)
    for side in BOTH:
        message = newest(predicted, side)
        assert (message.library, len(message.tasks) > 0) == (str(library), True)
        assert to_ns(message.header.stamp) > 0


# ------------------------------------------------------------------ a simulated person with both
@pytest.fixture
def whole(scenario: Scenario) -> Scenario:
    """The scenario, its person with both arms."""
    (person,) = scenario.persons
    both = person.model_copy(update={"both_arms": True})
    return scenario.model_copy(update={"persons": (both,)})


def moved(scenario: Scenario, away: float) -> Scenario:
    """Its person farther back by so much [m], and at rest."""
    (person,) = scenario.persons

    def back(point: tuple[float, float, float]) -> tuple[float, float, float]:
        return point[0] + away, point[1], point[2]

    far = person.model_copy(update={"shoulder": back(person.shoulder), "home": back(person.home)})
    quiet = tuple(r.model_copy(update={"person_target": None}) for r in scenario.reaches)
    return scenario.model_copy(update={"persons": (far,), "reaches": quiet})


def test_a_person_with_both_arms_is_planned_around(
    make_graph: Callable[..., Graph], whole: Scenario
) -> None:
    graph = make_graph(scenario=whole)
    graph.run(0.6)
    result = finish(graph, start_reach(graph, whole))
    assert result.outcome == ReachTarget.Result.REACHED, result.reason
    planner = graph.nodes["ptomp"]
    assert isinstance(planner, PtompNode)
    right, left = whole.arms.values()
    wrists = [
        forecast.mean[0, 2] for forecast in planner._heard.forecasts(seconds_to_ns(graph.now_s))
    ]
    assert len(wrists) == 2
    resting = left.arm.posture(left.home, left.swivel)[2]
    assert min(np.linalg.norm(wrist - resting) for wrist in wrists) < 0.02
    # The one reaches, the other does not.
    said = graph.messages("/humans/bodies/person1/prediction")
    assert {m.side for m in said if m.state == HumanPrediction.REACHING} == {right.side}
    # Truth and capture are of both; the scene knows both.
    for topic in ("/humans/bodies/person1/arm", "/sim/bodies/person1/arm"):
        sides = [message.side for message in graph.messages(topic)]
        assert abs(sides.count("left") - sides.count("right")) <= 1
    simulator: Any = graph.nodes["simulator"]
    placed = simulator._simulation.arm(f"person1/{left.side}")
    np.testing.assert_allclose(placed, left.arm.posture(left.home, left.swivel), atol=1e-9)
    assert not any(graph.nodes[name].faults for name in ("simulator", "person", "predictor"))


def test_what_is_said_of_the_first_arm_is_the_same_with_the_second(
    make_graph: Callable[..., Graph], scenario: Scenario, whole: Scenario
) -> None:
    said = []
    for one in (scenario, whole):
        graph = make_graph(scenario=one)
        graph.run(0.3)
        start_reach(graph, one)
        graph.run(0.5)
        messages = graph.messages("/humans/bodies/person1/arm")
        side = one.persons[0].side
        said.append([(to_ns(m.header.stamp), *m.keypoints) for m in messages if m.side == side])
        graph.close()
    assert len(said[0]) > 150
    assert said[0] == said[1]


@pytest.mark.parametrize("what", ["planner", "monitor"])
def test_one_arm_that_falls_silent_stops_the_robot(
    make_graph: Callable[..., Graph], whole: Scenario, what: str
) -> None:
    separation = "measured" if what == "monitor" else "off"
    graph = make_graph(
        scenario=whole, remappings=spoiling.REMAP, sensors=[Tamper], separation=separation
    )
    graph.run(0.6)
    start_reach(graph, whole)
    run_into_motion(graph)
    begin = graph.now_s
    tamper = graph.nodes["tamper"]
    assert isinstance(tamper, Tamper)
    other = list(whole.arms.values())[1].side

    def silent(message: HumanArm) -> HumanArm | None:
        return None if message.side == other else message

    tamper.spoil(silent, 0.5)
    graph.run(0.45)
    assert stop_time_ms(graph, begin) <= 200.0
    reason = graph.messages("/ptomp/status")[-1].reason
    assert "person1" in reason
    if what == "monitor":
        assert f"the {other} arm of person1 was last seen" in graph.messages(STATUS)[-1].reason
    graph.run(0.5)
    assert "person1" not in graph.messages("/ptomp/status")[-1].reason


def test_a_policy_keeps_clear_of_both_arms(
    make_policy_graph: Callable[..., Graph], whole: Scenario
) -> None:
    graph = make_policy_graph(scenario=whole)
    policy = graph.nodes["policy"]
    assert isinstance(policy, PolicyNode)
    right, left = whole.arms.values()
    tips = [arm[3] for arm in policy.replanning._inputs.arms_now()]
    assert len(tips) == 2
    for spec in (right, left):
        assert min(np.linalg.norm(tip - spec.home) for tip in tips) < 0.02
    goal = ReachTarget.Goal(target=whole.reaches[0].robot_target)
    result = finish(graph, graph.reach(goal, "/policy/reach_target"), 20.0)
    assert result.outcome == ReachTarget.Result.REACHED, result.reason


def test_an_arm_of_a_person_does_not_vanish_with_a_reset(
    make_graph: Callable[..., Graph], scenario: Scenario, whole: Scenario, tmp_path: Path
) -> None:
    """Whoever knows of it would wait for it."""
    graph = make_graph(scenario=whole)
    for name, one in (("alone", scenario), ("whole", whole)):
        path = tmp_path / f"{name}.yaml"
        save_scenario(path, one)
        answer = graph.call(Reset, "person/reset", Reset.Request(seed=1, scenario=str(path)))
        assert answer.success == (one is whole)
        if one is scenario:
            assert "other persons, or arms, than this graph" in answer.message
    graph.run(0.1)


# ------------------------------------------------------------------ the monitor as it is by itself
def test_the_monitors_own_defaults_wait_for_both_arms() -> None:
    assert ReleaseConfig().arms == BOTH_ARMS
    assert BodyConfig().trunk
    assert ProtectiveDistanceConfig().intrusion == 0.05


def test_a_robot_goes_while_a_person_with_both_arms_is_far(
    make_graph: Callable[..., Graph], whole: Scenario
) -> None:
    far = moved(whole, 2.0)
    graph = make_graph(scenario=far, separation="measured", parameters={MONITOR: OWN_DEFAULTS})
    graph.run(0.6)
    assert graph.messages(STATUS)[-1].state == SeparationStatus.FREE
    result = finish(graph, start_reach(graph, far))
    assert result.outcome == ReachTarget.Result.REACHED, result.reason
    since = [m for m in graph.messages(STATUS) if m.state != SeparationStatus.FREE]
    assert all(to_ns(m.header.stamp) < seconds_to_ns(graph.now_s - 0.5) for m in since)


def test_a_robot_stands_while_a_person_with_both_arms_is_near(
    make_graph: Callable[..., Graph], whole: Scenario
) -> None:
    graph = make_graph(
        scenario=moved(whole, 0.0), separation="measured", parameters={MONITOR: OWN_DEFAULTS}
    )
    graph.run(0.6)
    newest = graph.messages(STATUS)[-1]
    assert (newest.state, newest.speed_scale) == (SeparationStatus.STOPPED, 0.0)
    assert "is" in newest.reason
    assert newest.margin < 0.0
    assert "never seen" not in newest.reason


def test_a_person_of_one_arm_is_waited_for_by_default(
    make_graph: Callable[..., Graph], scenario: Scenario
) -> None:
    far = moved(scenario, 2.0)
    graph = make_graph(scenario=far, separation="measured", parameters={MONITOR: OWN_DEFAULTS})
    graph.run(0.6)
    newest = graph.messages(STATUS)[-1]
    assert newest.state == SeparationStatus.STOPPED
    assert "arm of person1 was never seen" in newest.reason


def test_both_arms_are_predicted_for_the_monitor(
    make_graph: Callable[..., Graph], scenario: Scenario
) -> None:
    alone = moved(scenario, 0.0).model_copy(update={"persons": ()})
    graph = make_graph(
        scenario=alone,
        sensors=[node_factory(BothArms, BOTH)],
        separation="predicted",
        parameters={MONITOR: {**OWN_DEFAULTS, "human": "predicted"}},
    )
    source, monitor = graph.nodes["both_arms"], graph.nodes[MONITOR]
    assert isinstance(source, BothArms)
    assert isinstance(monitor, SeparationMonitorNode)
    near, far = STILL - np.array([0.0, 0.2, 0.0]), STILL + np.array([0.0, 0.6, 0.0])
    for side, other in (("left", "right"), ("right", "left")):
        source.seen = {side: near, other: far}
        graph.run(1.5)
        newest = graph.messages(STATUS)[-1]
        assert newest.human_part.startswith(side), newest
        assert newest.human_mode == "predicted", newest
        predictions = monitor._people.predictions(seconds_to_ns(graph.now_s))
        assert set(predictions) == {("ann", "left"), ("ann", "right")}
