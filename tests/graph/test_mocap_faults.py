"""Motion capture goes wrong in every known way: no wild prediction, no NaN, no surprise."""

from collections.abc import Callable

import numpy as np
import pytest
from motions import (
    PREDICTION,
    assert_finite,
    finish,
    largest_reference_step,
    run_into_motion,
    start_reach,
    stop_time_ms,
)

from hri_prediction.ros.messages import ControllerState, HumanPrediction, ReachTarget
from hri_prediction.ros.time import to_ns
from hri_sim.scenario.schema import Scenario
from hri_sim.testing import Graph, ReachHandle, node_factory, spoiling
from hri_sim.testing.spoiling import ARM, REMAP, STILL, Bystander, Tamper

REACH_M = 0.29 + 0.26 + 0.09


@pytest.fixture
def spoilt(make_graph: Callable[..., Graph]) -> Graph:
    """The graph with :class:`Tamper` between person and predictor, run until it is quiet."""
    graph = make_graph(remappings=REMAP, sensors=[Tamper])
    graph.run(0.4)
    return graph


def spoil_in_motion(
    graph: Graph, scenario: Scenario, how: spoiling.Spoil, seconds: float
) -> tuple[ReachHandle, float]:
    """Spoil the capture once robot and person move; the time at which it began."""
    handle = start_reach(graph, scenario)
    graph.run(scenario.reaches[0].person_delay + 0.35)
    run_into_motion(graph)
    begin = graph.now_s
    tamper = graph.nodes["tamper"]
    assert isinstance(tamper, Tamper)
    tamper.spoil(how, seconds)
    return handle, begin


def predictions_since(graph: Graph, since_s: float) -> list[HumanPrediction]:
    return [
        graph_message
        for (now_ns, _), graph_message in zip(
            graph.log[PREDICTION], graph.messages(PREDICTION), strict=True
        )
        if now_ns * 1e-9 > since_s
    ]


def assert_tame(messages: list[HumanPrediction]) -> None:
    """Means stay within an arm's reach of the shoulder."""
    for message in messages:
        mean = np.array(message.mean).reshape(-1, 4, 3)
        assert np.linalg.norm(mean - mean[:, :1], axis=2).max() < 1.15 * REACH_M


def reasons(messages: list[HumanPrediction]) -> str:
    return "; ".join({m.reason for m in messages if m.reason})


@pytest.mark.parametrize("how", [spoiling.blind, spoiling.not_a_number])
def test_half_a_second_without_the_arm(
    spoilt: Graph, scenario: Scenario, how: spoiling.Spoil
) -> None:
    handle, begin = spoil_in_motion(spoilt, scenario, how, 0.5)
    spoilt.run(0.48)
    took = stop_time_ms(spoilt, begin)
    assert took <= 200.0
    invalid = [m for m in predictions_since(spoilt, begin) if m.state == HumanPrediction.INVALID]
    assert invalid
    assert all("no usable sample" in m.reason for m in invalid)
    assert any("person1" in fault for fault in spoilt.nodes["predictor"].faults)
    assert any("newest sample" in fault for fault in spoilt.nodes["ptomp"].faults)

    result = finish(spoilt, handle)
    assert result.outcome == ReachTarget.Result.REACHED, result.reason
    assert predictions_since(spoilt, spoilt.now_s - 0.05)[-1].state != HumanPrediction.INVALID
    assert largest_reference_step(spoilt) < 0.02
    assert min(m.clearance for m in spoilt.messages("/sim/state")) > 0.0
    assert_finite(spoilt, besides=("/" + ARM,))
    print(f"{how.__name__}: at rest after {took:.0f} ms, reached after {result.duration:.2f} s")


@pytest.mark.parametrize("silence_s", [0.06, 0.08, 0.1, 0.12, 0.16])
def test_a_stop_that_is_taken_back_in_between(
    spoilt: Graph, scenario: Scenario, silence_s: float
) -> None:
    """However far the stop has come: the robot goes on without a jump."""
    handle, _ = spoil_in_motion(spoilt, scenario, lambda _: None, silence_s)
    assert finish(spoilt, handle).outcome == ReachTarget.Result.REACHED
    references = spoilt.messages("/joint_trajectory_controller/reference")
    assert max(m.max_handover_jump for m in references) < 1e-3
    assert largest_reference_step(spoilt) < 0.02
    slowest = min(m.speed_scale for m in references if m.state != ControllerState.IDLE)
    print(f"silent for {silence_s} s: slowed to {slowest:.2f}")


@pytest.mark.parametrize(
    ("how", "word"), [(spoiling.swapped, "swapped"), (spoiling.wrist_jump, "jump")]
)
def test_markers_that_cannot_be_believed(
    spoilt: Graph, scenario: Scenario, how: spoiling.Spoil, word: str
) -> None:
    handle, begin = spoil_in_motion(spoilt, scenario, how, 0.3)
    spoilt.run(0.3)
    seen = predictions_since(spoilt, begin)
    assert_tame(seen)
    assert word in reasons(seen)
    assert any(word in fault for fault in spoilt.nodes["predictor"].faults)
    result = finish(spoilt, handle)
    assert result.outcome == ReachTarget.Result.REACHED, result.reason
    assert_tame(predictions_since(spoilt, begin))
    assert min(m.clearance for m in spoilt.messages("/sim/state")) > 0.0
    assert largest_reference_step(spoilt) < 0.02
    print(f"{how.__name__}: {reasons(seen)}; reached after {result.duration:.2f} s")


def test_one_wild_sample_changes_nothing(spoilt: Graph, scenario: Scenario) -> None:
    handle, begin = spoil_in_motion(spoilt, scenario, spoiling.wrist_jump, 0.005)
    assert finish(spoilt, handle).outcome == ReachTarget.Result.REACHED
    seen = predictions_since(spoilt, begin)
    assert all(m.state != HumanPrediction.INVALID for m in seen)
    assert_tame(seen)


def test_samples_out_of_order_are_told(spoilt: Graph, scenario: Scenario) -> None:
    how = spoiling.late_and_reordered(np.random.default_rng(0))
    handle, begin = spoil_in_motion(spoilt, scenario, how, 0.3)
    spoilt.run(0.3)
    assert any("person1: late or repeated" in fault for fault in spoilt.nodes["predictor"].faults)
    assert_tame(predictions_since(spoilt, begin))
    assert finish(spoilt, handle).outcome == ReachTarget.Result.REACHED
    assert largest_reference_step(spoilt) < 0.02


def test_another_frame_is_refused(spoilt: Graph, scenario: Scenario) -> None:
    handle, begin = spoil_in_motion(spoilt, scenario, spoiling.in_frame("camera"), 0.5)
    spoilt.run(0.48)
    assert stop_time_ms(spoilt, begin) <= 200.0
    assert any("'camera'" in fault for fault in spoilt.nodes["predictor"].faults)
    assert predictions_since(spoilt, begin)[-1].state == HumanPrediction.INVALID
    assert finish(spoilt, handle).outcome == ReachTarget.Result.REACHED


@pytest.mark.parametrize("seconds", [10.0, 0.2])
def test_stamps_in_the_future_are_refused(
    spoilt: Graph, scenario: Scenario, seconds: float
) -> None:
    handle, begin = spoil_in_motion(spoilt, scenario, spoiling.shifted_clock(seconds), 0.5)
    spoilt.run(0.48)
    assert stop_time_ms(spoilt, begin) <= 200.0
    assert any("in the future" in fault for fault in spoilt.nodes["predictor"].faults)
    newest = predictions_since(spoilt, begin)
    assert all(to_ns(m.header.stamp) * 1e-9 <= spoilt.now_s for m in newest)
    assert finish(spoilt, handle).outcome == ReachTarget.Result.REACHED


def test_the_source_s_clock_goes_back(spoilt: Graph, scenario: Scenario) -> None:
    handle, begin = spoil_in_motion(spoilt, scenario, spoiling.shifted_clock(-1.0), 0.5)
    spoilt.run(0.48)
    assert stop_time_ms(spoilt, begin) <= 200.0
    assert any("stamps went back" in fault for fault in spoilt.nodes["predictor"].faults)
    assert_tame(predictions_since(spoilt, begin))
    # Back in time: the stamps are fresh again.
    assert finish(spoilt, handle).outcome == ReachTarget.Result.REACHED
    assert_finite(spoilt)


def test_a_source_that_stays_in_the_past_ends_the_motion(spoilt: Graph, scenario: Scenario) -> None:
    handle, _ = spoil_in_motion(spoilt, scenario, spoiling.shifted_clock(-1.0), 60.0)
    result = finish(spoilt, handle)
    assert result.outcome == ReachTarget.Result.LOST_INPUT
    assert "no usable sample" in result.reason


def test_two_bodies_are_both_kept_clear_of(
    make_graph: Callable[..., Graph], scenario: Scenario
) -> None:
    """A still arm next to the robot: predicted, seen as the nearest, and kept clear of."""
    graph = make_graph(sensors=[node_factory(Bystander, STILL)])
    graph.run(0.5)
    handle = start_reach(graph, scenario)
    result = finish(graph, handle, 25.0)
    other = graph.messages("/humans/bodies/bystander/prediction")
    mine = graph.messages(PREDICTION)
    assert len(other) >= 25.0 * (graph.now_s - 1.1)
    assert len(mine) >= 25.0 * (graph.now_s - 1.1)
    assert {m.state for m in other} == {HumanPrediction.IDLE}
    assert np.allclose(np.array(other[-1].mean).reshape(-1, 4, 3)[0], STILL, atol=1e-6)

    def clearance_to_bystander() -> float:
        from motions import joints

        from hri_planner.robot.model import load_robot
        from hri_prediction.geometry.segments import capsule_distances

        robot = load_robot()
        limbs = np.stack((STILL[:-1], STILL[1:]), axis=1)
        radii = np.array([0.05, 0.04, 0.05])
        return min(
            float(
                capsule_distances(robot.robot_capsules(q), robot.capsule_radii, limbs, radii).min()
            )
            for q in joints(graph)[1][::5]
        )

    nearest = clearance_to_bystander()
    true = min(m.clearance for m in graph.messages("/sim/state"))
    assert nearest > 0.0
    assert true > 0.0
    # The planner's own figure is the smaller of the two.
    assert result.min_separation <= min(nearest, true) + 0.02
    print(f"bystander {nearest * 100:.1f} cm, person {true * 100:.1f} cm, {result.reason}")


def test_more_bodies_than_are_followed(
    make_graph: Callable[..., Graph], scenario: Scenario
) -> None:
    graph = make_graph(
        sensors=[node_factory(Bystander, STILL)], parameters={"predictor": {"max_bodies": 1}}
    )
    graph.run(0.4)
    assert any("max_bodies" in fault for fault in graph.nodes["predictor"].faults)
    # Somebody is there whom nobody predicts: the robot does not move.
    result = finish(graph, start_reach(graph, scenario), 4.0)
    assert result.outcome == ReachTarget.Result.LOST_INPUT
    assert "bystander" in result.reason
