from __future__ import annotations

import importlib
import json
from dataclasses import replace

import pytest
from mcap_ros2._dynamic import generate_dynamic
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from hri_prediction.bags.cdr import read_stamp, starts_with_stamp, with_stamp
from hri_prediction.bags.reader import BagMessage
from hri_prediction.bags.schemas import (
    as_installed,
    message_class,
    message_definition,
    share_folders,
)
from hri_prediction.errors import DataError

TYPES = [
    "std_msgs/msg/String",
    "sensor_msgs/msg/JointState",
    "trajectory_msgs/msg/JointTrajectory",
    "diagnostic_msgs/msg/DiagnosticArray",
    "visualization_msgs/msg/MarkerArray",
    "rcl_interfaces/msg/ParameterEvent",
    "rcl_interfaces/msg/Log",
    "action_msgs/msg/GoalStatusArray",
]
ACTIONS = [
    "hri_msgs/msg/HumanArm",
    "hri_msgs/msg/HumanPrediction",
    "hri_msgs/action/ReachTarget_FeedbackMessage",
    "hri_msgs/action/ReachTarget_SendGoal_Request",
    "hri_msgs/action/ReachTarget_SendGoal_Response",
    "hri_msgs/action/ReachTarget_GetResult_Request",
    "hri_msgs/action/ReachTarget_GetResult_Response",
]
# rosbags computes another hash for the ``char`` in service_msgs/ServiceEventInfo.
EVENTS = [
    "hri_msgs/action/ReachTarget_SendGoal_Event",
    "hri_msgs/action/ReachTarget_GetResult_Event",
    "hri_msgs/srv/Reset_Event",
]


@pytest.mark.parametrize("name", TYPES)
def test_mcap_ros2_understands_the_definitions(name: str) -> None:
    definition = message_definition(name)
    assert definition.encoding == "ros2msg"
    assert name in generate_dynamic(name, definition.text)


@pytest.mark.parametrize("name", TYPES + ACTIONS)
def test_definitions_have_the_type_hash_that_ros_computed(name: str) -> None:
    """The hash covers names and types of all fields, nested ones included."""
    package, kind, short = name.split("/")
    if package == "hri_msgs":
        pytest.importorskip("hri_msgs.msg")
    base = short if kind == "msg" else short.split("_")[0]
    description = next(
        path
        for share in share_folders()
        if (path := share / package / kind / f"{base}.json").is_file()
    )
    hashes = {
        entry["type_name"]: entry["hash_string"]
        for entry in json.loads(description.read_text())["type_hashes"]
    }
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(message_definition(name).text, name))
    assert store.hash_rihs01(name) == hashes[name]


@pytest.mark.parametrize("name", TYPES)
def test_fields_agree_with_an_independent_type_store(name: str) -> None:
    parsed = get_types_from_msg(message_definition(name).text, name)
    store = get_typestore(Stores.ROS2_JAZZY)
    for found, (_, fields) in parsed.items():
        assert fields == store.fielddefs[found][1], found


@pytest.mark.parametrize("name", EVENTS)
def test_service_events_are_defined_with_all_they_contain(name: str) -> None:
    pytest.importorskip("hri_msgs.msg")
    text = message_definition(name).text
    base = name.removesuffix("_Event")
    for part in (f"{base}_Request", f"{base}_Response", "service_msgs/ServiceEventInfo"):
        assert f"MSG: {part}\n" in text


@pytest.mark.parametrize("name", TYPES + ACTIONS + EVENTS)
def test_classes_are_found(name: str) -> None:
    if name.startswith("hri_msgs"):
        pytest.importorskip("hri_msgs.msg")
    assert hasattr(message_class(name), "get_fields_and_field_types")


@pytest.mark.parametrize("name", ["nowhere/msg/Thing", "std_msgs/msg/Nothing", "String", "a/b/c/d"])
def test_unknown_types(name: str) -> None:
    assert message_definition(name).encoding == ""
    with pytest.raises(DataError, match=r"not installed"):
        message_class(name)


@pytest.mark.parametrize("name", ["os/path/join", "evil/msg/Boom", "../msg/String", "a.b/msg/C"])
def test_only_messages_are_imported(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A type is named by a file, and what is imported is executed."""
    monkeypatch.setattr(importlib, "import_module", lambda module: pytest.fail(f"imports {module}"))
    with pytest.raises(DataError, match=r"not installed"):
        message_class(name)


def test_stamps_are_read_and_changed_in_the_bytes() -> None:
    rclpy_serialization = pytest.importorskip("rclpy.serialization")
    from builtin_interfaces.msg import Time
    from sensor_msgs.msg import JointState
    from std_msgs.msg import Header

    message = JointState(
        header=Header(stamp=Time(sec=12, nanosec=34), frame_id="world"), position=[1.0, 2.0]
    )
    data = rclpy_serialization.serialize_message(message)
    assert read_stamp(data) == 12 * 10**9 + 34
    changed = rclpy_serialization.deserialize_message(with_stamp(data, 5 * 10**9 + 6), JointState)
    assert changed.header.stamp == Time(sec=5, nanosec=6)
    assert changed.position == message.position
    assert changed.header.frame_id == "world"


def test_which_types_begin_with_a_stamp() -> None:
    assert starts_with_stamp(message_definition("sensor_msgs/msg/JointState").text)
    assert starts_with_stamp(message_definition("rosgraph_msgs/msg/Clock").text)
    assert starts_with_stamp(message_definition("rcl_interfaces/msg/Log").text)
    assert not starts_with_stamp(message_definition("std_msgs/msg/String").text)
    assert not starts_with_stamp("std_msgs/String a\nstd_msgs/Header b\n")
    assert not starts_with_stamp("")


def test_short_data_has_no_stamp() -> None:
    assert read_stamp(b"\x00\x01\x00\x00\x01") is None
    assert with_stamp(b"\x00\x01", 3) == b"\x00\x01"


def test_another_version_of_a_message_is_recognised() -> None:
    name = "sensor_msgs/msg/JointState"
    text = message_definition(name).text
    assert as_installed(name, text)
    assert as_installed(name, "")
    assert as_installed("nobody_msgs/msg/Unknown", text)
    assert as_installed(name, text.replace("std_msgs/Header", "Header").replace("# ", "#"))
    assert as_installed(name, "uint8 SOMETHING=3\n" + text)
    assert not as_installed(name, text.replace("float64[] effort", "float64[] torque"))
    assert not as_installed(name, text.replace("float64[] effort", "float32[] effort"))
    assert not as_installed(name, "float64 more\n" + text)
    assert not as_installed(name, text.replace("uint32 nanosec", "uint64 nanosec"))


def test_a_message_of_another_version_is_not_decoded() -> None:
    pytest.importorskip("rclpy")
    text = message_definition("sensor_msgs/msg/JointState").text
    data = b"\x00\x01\x00\x00" + bytes(64)
    message = BagMessage("/joint_states", "sensor_msgs/msg/JointState", data, 0, 0, 0, text)
    assert list(message.decode().name) == []
    changed = replace(message, definition="float64 more\n" + text)
    with pytest.raises(DataError, match="another version of sensor_msgs/msg/JointState"):
        changed.decode()
