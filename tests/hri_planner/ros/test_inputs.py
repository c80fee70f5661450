"""What the planner node takes from the controller, and what it refuses."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from hri_planner.robot.model import load_robot
from hri_planner.ros.inputs import Inputs
from hri_planner.supervision import freshness
from hri_planner.supervision.freshness import HeardPerson
from hri_prediction.errors import DataError
from hri_prediction.ros.messages import ControllerState, HumanPrediction
from hri_prediction.ros.time import to_time

NAMES = load_robot().joint_names
Q = np.linspace(-0.6, 0.6, 7)
QD = np.linspace(0.1, 0.7, 7)
NOW_NS = 5_000_000_000
LIMITS = freshness.Limits(0.1, 0.085, require_tracking=False)


@pytest.fixture
def inputs() -> Inputs:
    return Inputs(radii=np.full(3, 0.05), joints_ns=NOW_NS)


def problem(inputs: Inputs, now_ns: int = NOW_NS) -> str:
    """What the supervisor says of them."""
    return freshness.problem(inputs.heard(now_ns), LIMITS, now_ns)


def reference(stamp_ns: int = NOW_NS) -> ControllerState:
    message = ControllerState(
        joint_names=list(NAMES), reference_position=Q, reference_velocity=QD, speed_scale=1.0
    )
    message.header.stamp = to_time(stamp_ns)
    return message


def test_joints_in_another_order_and_others_among_them(inputs: Inputs) -> None:
    message = reference()
    order = [3, 0, 6, 1, 5, 2, 4]
    message.joint_names = ["gripper", *(NAMES[i] for i in order)]
    message.reference_position = [9.0, *Q[order]]
    message.reference_velocity = [8.0, *QD[order]]
    inputs.take_reference(message, NAMES)
    assert inputs.reference is not None
    assert tuple(inputs.reference.joint_names) == NAMES
    np.testing.assert_array_equal(inputs.reference.reference_position, Q)
    np.testing.assert_array_equal(inputs.reference.reference_velocity, QD)
    assert problem(inputs) == ""


def _no_names(message: ControllerState) -> None:
    message.joint_names = []


def _another_robot(message: ControllerState) -> None:
    message.joint_names = [f"panda_joint{i}" for i in range(7)]


def _too_few_positions(message: ControllerState) -> None:
    message.reference_position = Q[:6]


def _no_velocities(message: ControllerState) -> None:
    message.reference_velocity = []


def _not_a_number(message: ControllerState) -> None:
    message.reference_position[2] = math.nan


def _endless_speed(message: ControllerState) -> None:
    message.reference_velocity[6] = math.inf


def _no_scale(message: ControllerState) -> None:
    message.speed_scale = math.nan


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (_no_names, r"has joints \(none\)"),
        (_another_robot, "has joints panda_joint0"),
        (_too_few_positions, "6 positions"),
        (_no_velocities, "0 velocities"),
        (_not_a_number, "not finite"),
        (_endless_speed, "not finite"),
        (_no_scale, "speed_scale = nan"),
    ],
)
def test_what_cannot_be_used_is_left_out_and_stops_the_robot(
    inputs: Inputs, spoil: Callable[[ControllerState], None], words: str
) -> None:
    bad = reference(NOW_NS + 150_000_000)
    spoil(bad)
    with pytest.raises(DataError, match=words):
        inputs.take_reference(bad, NAMES)
    # Never a usable one: the robot does not begin to move from where the joints are.
    assert inputs.reference is None
    assert problem(inputs) == inputs.reference_fault != ""

    good = reference()
    inputs.take_reference(good, NAMES)
    assert problem(inputs) == ""
    with pytest.raises(DataError, match=words):
        inputs.take_reference(bad, NAMES)
    # The one before stays in use until it is too old.
    assert inputs.reference is good
    assert problem(inputs) == ""
    inputs.joints_ns = NOW_NS + 150_000_000
    found = problem(inputs, NOW_NS + 150_000_000)
    assert "reference is 0.15 s old: the controller's reference" in found


def prediction(
    side: str, y: float, stamp_ns: int = NOW_NS, state: int = HumanPrediction.IDLE
) -> HumanPrediction:
    """Of an arm at rest, all of it at one place."""
    message = HumanPrediction(body_id="ann", side=side, state=state, reason="blind")
    message.header.stamp, message.header.frame_id = to_time(stamp_ns), "world"
    message.times = [0.0, 0.1]
    message.mean = np.tile([0.5, y, 0.2], 8)
    message.covariance = np.tile(1e-4 * np.eye(3), (8, 1, 1)).ravel()
    return message


def test_each_arm_of_a_body_is_planned_around(inputs: Inputs) -> None:
    inputs.lists.heard(0, ["ann"], NOW_NS)
    inputs.take_prediction(prediction("right", 0.0))
    inputs.take_prediction(prediction("left", 0.4))
    assert [arm[3, 1] for arm in inputs.arms_now()] == [0.0, 0.4]
    assert len(inputs.forecasts(NOW_NS)) == len(inputs.uncertainties) == 2
    # What the other arm is predicted to do says nothing of this one.
    for step in range(1, 40):
        stamp_ns = NOW_NS + step * 20_000_000
        inputs.take_prediction(prediction("right", 0.0, stamp_ns))
        inputs.take_prediction(prediction("left", 0.4, stamp_ns))
    assert inputs.errors == [0.0, 0.0]
    assert inputs.people_heard() == {"ann": HeardPerson(stamp_ns, reason="right arm: blind")}
    inputs.forget_body("ann")
    assert inputs.forecasts(NOW_NS) == []


def test_an_arm_that_is_invalid_or_silent_stops_the_robot(inputs: Inputs) -> None:
    inputs.lists.heard(0, ["ann"], NOW_NS)
    inputs.take_prediction(prediction("right", 0.0))
    assert problem(inputs) == ""
    inputs.take_prediction(prediction("left", 0.4, state=HumanPrediction.INVALID))
    assert problem(inputs) == "the prediction of ann is invalid: left arm: blind"
    assert len(inputs.forecasts(NOW_NS)) == len(inputs.errors) == 1
    inputs.take_prediction(prediction("left", 0.4, NOW_NS - 90_000_000))
    assert problem(inputs) == "the newest sample behind the prediction of ann is 0.090 s old"
    assert inputs.newest_sample_ns() == NOW_NS - 90_000_000
    inputs.take_prediction(prediction("left", 0.4))
    assert problem(inputs) == ""


def test_a_prediction_of_no_arm_is_refused(inputs: Inputs) -> None:
    with pytest.raises(DataError, match="has side ''; expected 'left' or 'right'"):
        inputs.take_prediction(prediction("", 0.0))
    assert inputs.people_heard() == {}
