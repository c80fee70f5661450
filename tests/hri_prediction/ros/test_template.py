"""Numbers written into serialised messages: the same bytes as of messages made anew."""

from typing import Any

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import PoseStamped
from hypothesis import given
from hypothesis import strategies as st
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64, Header

from hri_prediction.errors import DataError
from hri_prediction.ros import template as module
from hri_prediction.ros.conversions import ArmEncoder, message_from_sample
from hri_prediction.ros.messages import ControllerState, HumanArm, SimState
from hri_prediction.ros.template import KEPT, MessageTemplate, templates
from hri_prediction.ros.time import NANO, to_time
from hri_prediction.tracks.track import ArmSample

NAMES = st.text(alphabet="abcdé/_1", max_size=9)
NUMBERS = st.floats(allow_nan=False, width=64)
STAMPS = st.integers(0, 2**31 * NANO - 1)


@given(st.lists(NAMES, max_size=8), NAMES, STAMPS, st.data())
def test_joint_states(names: list[str], frame: str, stamp_ns: int, data: st.DataObject) -> None:
    size = len(names)
    some = st.lists(NUMBERS, min_size=size, max_size=size)
    first, second = ({k: data.draw(some) for k in ("position", "effort")} for _ in range(2))
    template = MessageTemplate(JointState(header=Header(frame_id=frame), name=names, **first))
    template.stamp(stamp_ns)
    if size:
        template.write(**second)
    wanted = JointState(
        header=Header(stamp=to_time(stamp_ns), frame_id=frame),
        name=names,
        **(second if size else first),
    )
    assert template.encoded() == MessageTemplate(wanted).encoded()
    assert deserialize_message(template.encoded(), JointState) == wanted
    assert len(template.encoded()) == len(serialize_message(wanted))


@given(
    NAMES,
    NAMES,
    st.lists(NUMBERS, min_size=12, max_size=12),
    st.lists(st.booleans(), min_size=4, max_size=4),
)
def test_arrays_of_fixed_length(
    body: str, side: str, keypoints: list[float], valid: list[bool]
) -> None:
    template = MessageTemplate(HumanArm(body_id=body, side=side))
    template.write(keypoints=keypoints, valid=valid)
    wanted = HumanArm(body_id=body, side=side, keypoints=keypoints, valid=valid)
    found = deserialize_message(template.encoded(), HumanArm)
    np.testing.assert_array_equal(found.keypoints, wanted.keypoints)
    assert (found.body_id, found.side, list(found.valid)) == (body, side, valid)
    assert len(template.encoded()) == len(serialize_message(wanted))


@given(NAMES, st.integers(0, 255), NUMBERS, STAMPS)
def test_numbers_of_all_sizes(reason: str, state: int, scale: float, stamp_ns: int) -> None:
    template = MessageTemplate(ControllerState(reason=reason, joint_names=["a", "bcd"]))
    template.write(state=state, speed_scale=scale)
    template.stamp(stamp_ns, "trajectory")
    wanted = ControllerState(
        reason=reason,
        joint_names=["a", "bcd"],
        state=state,
        speed_scale=scale,
        trajectory=to_time(stamp_ns),
    )
    assert deserialize_message(template.encoded(), ControllerState) == wanted


def test_what_differs_in_more_than_numbers_has_a_template_of_its_own() -> None:
    made: list[tuple[str, str]] = []

    def make(robot_part: str, human_part: str) -> SimState:
        made.append((robot_part, human_part))
        return SimState(robot_part=robot_part, human_part=human_part)

    of = templates(make)
    assert of("hand", "p/hand") is of("hand", "p/hand")
    assert of("forearm", "") is not of("hand", "p/hand")
    assert made == [("hand", "p/hand"), ("forearm", "")]
    for number in range(KEPT):
        of("hand", str(number))
    of("forearm", "")
    assert made.count(("forearm", "")) == 2  # they are not kept for ever


def test_wrong_fields_and_lengths_are_refused() -> None:
    template = MessageTemplate(JointState(name=["a"], position=[0.0]))
    with pytest.raises(KeyError, match="speed"):
        template.write(speed=1.0)
    with pytest.raises(ValueError, match="2 numbers for position, which has 1"):
        template.write(position=[1.0, 2.0])
    with pytest.raises(ValueError, match="1 numbers for keypoints, which has 12"):
        MessageTemplate(HumanArm()).write(keypoints=0.0)


def test_nested_messages_and_sequences_of_them() -> None:
    pose = PoseStamped()
    pose.pose.position.x, pose.pose.orientation.w = 1.5, -2.0
    template = MessageTemplate(pose)
    template.numbers["pose.position.y"][0] = 4.0
    pose.pose.position.y = 4.0
    assert deserialize_message(template.encoded(), PoseStamped) == pose
    status = DiagnosticStatus(name="n", values=[KeyValue(key="k", value="value")])
    array = DiagnosticArray(header=Header(frame_id="abc"), status=[status, status])
    assert set(MessageTemplate(array).numbers) == {"header.stamp.sec", "header.stamp.nanosec"}
    level = DiagnosticStatus(level=b"\x02", name="n")
    assert not MessageTemplate(level).numbers
    assert deserialize_message(MessageTemplate(level).encoded(), DiagnosticStatus) == level


def test_equal_messages_have_equal_bytes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever a serializer leaves in bytes that mean nothing."""
    message = JointState(header=Header(frame_id="ab"), name=["a", "bcdefg"], position=[1.0, 2.0])
    dirty = bytearray(serialize_message(message))
    # Behind "ab", "a" and "bcdefg", each with its zero, and before the positions.
    idle = [module.HEAD + offset for offset in (15, 26, 27, 39, *range(44, 48))]
    for index in idle:
        dirty[index] = 0xA5
    assert deserialize_message(bytes(dirty), JointState) == message
    monkeypatch.setattr(module, "serialize_message", lambda _: bytes(dirty))
    encoded = MessageTemplate(message).encoded()
    assert deserialize_message(encoded, JointState) == message
    assert not any(encoded[index] for index in idle)


def test_bytes_that_are_no_plain_cdr_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    def other(message: Any) -> bytes:
        return serialize_message(message)[:4] + b"\0" * 8

    monkeypatch.setattr(module, "serialize_message", other)
    with pytest.raises(DataError, match="data of Float64 is not where plain CDR has it"):
        MessageTemplate(Float64(data=1.0))


@pytest.mark.parametrize("seen", [(True,) * 4, (True, False, True, False), (False,) * 4])
def test_arms_are_encoded_as_their_messages_are(seen: tuple[bool, ...]) -> None:
    keypoints = np.arange(12.0).reshape(4, 3)
    keypoints[~np.array(seen)] = np.nan
    encoder = ArmEncoder()
    for body in ("person1", "p2"):
        for side in ("left", "right"):
            sample = ArmSample(12 * NANO + 7, keypoints, np.array(seen), side)
            wanted = message_from_sample(sample, body)
            assert encoder.encoded(sample, body) == MessageTemplate(wanted).encoded()
