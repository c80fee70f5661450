"""The recorder on a live graph, within one process and as a process of its own."""

from __future__ import annotations

import json
import os
import random
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

rclpy = pytest.importorskip("rclpy")

from builtin_interfaces.msg import Time  # noqa: E402
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus  # noqa: E402
from rclpy.experimental.events_executor import EventsExecutor  # noqa: E402
from rclpy.node import Node  # noqa: E402
from rclpy.parameter import Parameter  # noqa: E402
from rclpy.qos import (  # noqa: E402
    DurabilityPolicy,
    HistoryPolicy,
    QoSProfile,
    ReliabilityPolicy,
)
from rosbags.highlevel import AnyReader  # noqa: E402
from rosgraph_msgs.msg import Clock  # noqa: E402
from std_msgs.msg import ByteMultiArray, String, UInt64  # noqa: E402

from hri_prediction.bags import BagReader, inspect_bag, salvage  # noqa: E402
from hri_prediction.errors import ConfigError  # noqa: E402
from hri_sim.nodes.recorder_node import RecorderNode  # noqa: E402
from hri_sim.recording.sequence import SequenceGaps  # noqa: E402
from hri_sim.testing.domain import own_domain  # noqa: E402

DOMAIN = own_domain("recorder_node")
BEST_EFFORT = QoSProfile(
    history=HistoryPolicy.KEEP_LAST, depth=100, reliability=ReliabilityPolicy.BEST_EFFORT
)
LATCHED = QoSProfile(
    history=HistoryPolicy.KEEP_LAST,
    depth=1,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
)


class Rig:
    """A context with a node that publishes, and recorders."""

    def __init__(self) -> None:
        self.context = rclpy.Context()
        rclpy.init(context=self.context, domain_id=DOMAIN)
        self.node = Node("talker", context=self.context)
        self.executor = EventsExecutor(context=self.context)
        self.executor.add_node(self.node)
        self.recorders: list[RecorderNode] = []

    def recorder(self, folder: Path, **values) -> RecorderNode:
        overrides = [Parameter("output", value=str(folder))]
        overrides += [Parameter(name, value=value) for name, value in values.items()]
        node = RecorderNode(context=self.context, parameter_overrides=overrides)
        self.recorders.append(node)
        self.executor.add_node(node)
        return node

    def spin(self, seconds: float) -> None:
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self.executor.spin_once(timeout_sec=0.02)

    def spin_until(self, done: Callable[[], bool], timeout: float = 10.0) -> None:
        end = time.monotonic() + timeout
        while not done():
            assert time.monotonic() < end, "timed out"
            self.executor.spin_once(timeout_sec=0.02)

    def close(self) -> None:
        for node in self.recorders:
            node.close()
        self.executor.shutdown()
        for node in [*self.recorders, self.node]:
            node.destroy_node()
        rclpy.try_shutdown(context=self.context)


@pytest.fixture
def rig() -> Iterator[Rig]:
    made = Rig()
    yield made
    made.close()


def test_a_misspelled_parameter_is_refused_before_there_is_a_bag(tmp_path: Path, rig: Rig) -> None:
    with pytest.raises(ConfigError, match=r"no parameter 'flush_perod'; expected one like flush_"):
        rig.recorder(tmp_path / "run", flush_perod=0.1)
    assert not (tmp_path / "run").exists()


def test_every_topic_is_recorded_also_a_later_one(tmp_path: Path, rig: Rig) -> None:
    latched = rig.node.create_publisher(String, "/latched", LATCHED)
    latched.publish(String(data="before the recorder"))
    numbers = rig.node.create_publisher(UInt64, "/numbers", BEST_EFFORT)
    feedback = rig.node.create_publisher(String, "/x/_action/feedback", 10)
    recorder = rig.recorder(tmp_path / "run", provenance='{"seed": 5, "models": {"m": 1}}')
    rig.spin_until(
        lambda: numbers.get_subscription_count() == feedback.get_subscription_count() == 1
    )
    for index in range(200):
        numbers.publish(UInt64(data=index))
        rig.executor.spin_once(timeout_sec=0.001)
    feedback.publish(String(data="hidden"))
    late = rig.node.create_publisher(String, "/late", 10)
    rig.spin_until(lambda: late.get_subscription_count() == 1)
    late.publish(String(data="late"))
    rig.node.get_logger().info("a line for /rosout")
    rig.spin(1.5)
    recorder.close()

    report = inspect_bag(tmp_path / "run")
    topics = {topic.topic: topic for topic in report.topics}
    assert {"/rosout", "/parameter_events", "/diagnostics", "/x/_action/feedback"} <= set(topics)
    assert topics["/numbers"].count == 200
    assert topics["/numbers"].missing == 0
    assert topics["/numbers"].reliability == "best_effort"
    assert topics["/latched"].durability == "transient_local"
    assert topics["/latched"].count == topics["/late"].count == 1
    assert topics["/rosout"].count >= 1
    assert topics["/diagnostics"].count >= 1
    assert all(topic.type_hash.startswith("RIHS01_") for topic in report.topics)
    assert topics["/numbers"].transport is not None
    assert 0 <= topics["/numbers"].transport.p50 < 0.5
    assert report.custom_data["seed"] == "5"
    (attachment,) = BagReader(tmp_path / "run").attachments()
    assert json.loads(attachment.data)["models"] == {"m": 1}
    # An independent library verifies the type hashes against the definitions and decodes.
    with AnyReader([tmp_path / "run"]) as reader:
        wanted = [c for c in reader.connections if c.topic == "/numbers"]
        found = [reader.deserialize(raw, c.msgtype).data for c, _, raw in reader.messages(wanted)]
    assert found == list(range(200))
    decoded = [m.decode().data for m in BagReader(tmp_path / "run").messages(["/latched", "/late"])]
    assert decoded == ["before the recorder", "late"]


def test_a_publisher_that_offers_less_is_recorded_too(tmp_path: Path, rig: Rig) -> None:
    first = rig.node.create_publisher(String, "/mixed", LATCHED)
    first.publish(String(data="latched"))
    recorder = rig.recorder(tmp_path / "run")
    rig.spin_until(lambda: first.get_subscription_count() == 1)
    second = rig.node.create_publisher(String, "/mixed", BEST_EFFORT)
    rig.spin_until(lambda: second.get_subscription_count() == 1)
    rig.spin(0.3)
    second.publish(String(data="best effort"))
    first.publish(String(data="reliable"))
    rig.spin(0.5)
    recorder.close()
    decoded = [m.decode().data for m in BagReader(tmp_path / "run").messages(["/mixed"])]
    assert sorted(decoded) == ["best effort", "latched", "reliable"]


def test_simulated_time_is_what_is_logged(tmp_path: Path, rig: Rig) -> None:
    clock = rig.node.create_publisher(Clock, "/clock", BEST_EFFORT)
    numbers = rig.node.create_publisher(UInt64, "/numbers", 10)
    recorder = rig.recorder(tmp_path / "run", use_sim_time=True)
    # Once for the node's own clock, once for the bag.
    rig.spin_until(
        lambda: clock.get_subscription_count() == 2 and numbers.get_subscription_count() == 1
    )
    for second in (5, 6, 7):
        clock.publish(Clock(clock=Time(sec=second)))
        rig.spin(0.1)
        numbers.publish(UInt64(data=second))
        rig.spin(0.1)
    recorder.close()
    found = list(BagReader(tmp_path / "run").messages(["/numbers"]))
    assert [m.log_time_ns for m in found] == [5 * 10**9, 6 * 10**9, 7 * 10**9]
    assert len(list(BagReader(tmp_path / "run").messages(["/clock"]))) == 3


def test_excluded_topics_are_left_out(tmp_path: Path, rig: Rig) -> None:
    rig.node.create_publisher(String, "/camera/image", 10)
    kept = rig.node.create_publisher(String, "/camera_info", 10)
    recorder = rig.recorder(tmp_path / "run", exclude="/camera/.*|/rosout")
    rig.spin_until(lambda: kept.get_subscription_count() == 1)
    recorder.close()
    names = set(BagReader(tmp_path / "run").topics)
    assert "/camera_info" in names
    assert not names & {"/camera/image", "/rosout"}


def test_the_recorder_tells_how_it_is(tmp_path: Path, rig: Rig) -> None:
    heard: list[DiagnosticStatus] = []
    rig.node.create_subscription(
        DiagnosticArray, "/diagnostics", lambda array: heard.extend(array.status), 10
    )
    recorder = rig.recorder(tmp_path / "run", queue_megabytes=1)
    rig.spin_until(lambda: len(heard) >= 2)
    figures = {item.key: item.value for item in heard[-1].values}
    assert heard[-1].level == DiagnosticStatus.OK
    assert {"messages_per_s", "queue", "file_bytes", "dropped", "lost_in_transport"} <= set(figures)
    number = recorder.core.add_topic(recorder._recorded["/rosout"].info)
    recorder.core.push(number, bytes(2_000_000), 1, 1)
    heard.clear()
    rig.spin_until(lambda: any(item.level == DiagnosticStatus.ERROR for item in heard))
    assert "1 messages dropped" in heard[-1].message
    assert "(/rosout 1)" in heard[-1].message


def test_losses_on_the_way_are_counted(tmp_path: Path, rig: Rig) -> None:
    recorder = rig.recorder(tmp_path / "run")
    rig.spin_until(lambda: "/rosout" in recorder._recorded)
    topic = recorder._recorded["/rosout"]
    topic.gaps = SequenceGaps()
    for number in (1, 2, 5, 6):
        info = {
            "publication_sequence_number": number,
            "received_timestamp": number,
            "source_timestamp": number,
        }
        topic.take((b"\x00\x01\x00\x00", info))
    topic.gaps.settle(1)
    assert topic.gaps.lost == 2
    level, text, figures = recorder.health()
    assert (level, text) == (
        DiagnosticStatus.WARN,
        "2 messages lost in transport (/rosout 2)",
    )
    assert figures["lost_in_transport"] == 2


def test_bad_parameters_are_refused(tmp_path: Path, rig: Rig) -> None:
    with pytest.raises(ConfigError, match=r"output is empty"):
        RecorderNode(context=rig.context)
    with pytest.raises(ConfigError, match=r"regular expression"):
        rig.recorder(tmp_path / "a", exclude="(")
    (tmp_path / "taken").mkdir()
    (tmp_path / "taken" / "x").write_text("")
    with pytest.raises(ConfigError, match=r"exists already"):
        rig.recorder(tmp_path / "taken")


def start_recorder(folder: Path, domain: int) -> subprocess.Popen:
    return subprocess.Popen(
        [
            *(sys.executable, "-m", "hri_sim.nodes.recorder_node", "--ros-args"),
            *("-p", f"output:={folder}", "-p", "flush_period:=0.2"),
        ],
        env={
            "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
            **os.environ,
            "ROS_DOMAIN_ID": str(domain),
        },
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_the_process_ends_with_a_readable_bag(tmp_path: Path, rig: Rig, number: int) -> None:
    folder = tmp_path / "run"
    publisher = rig.node.create_publisher(UInt64, "/numbers", 1000)
    process = start_recorder(folder, DOMAIN)
    try:
        rig.spin_until(lambda: publisher.get_subscription_count() == 1, timeout=20.0)
        for index in range(1500):
            publisher.publish(UInt64(data=index))
            time.sleep(0.0005)
        if number == signal.SIGKILL:
            time.sleep(0.6)
        process.send_signal(number)
        _, err = process.communicate(timeout=20)
    finally:
        if process.poll() is None:
            process.kill()
            process.communicate()
    if number == signal.SIGKILL:
        assert not inspect_bag(folder).closed
        salvage(folder, tmp_path / "saved")
        folder = tmp_path / "saved"
    else:
        assert process.returncode == 0, err
    report = inspect_bag(folder)
    assert report.closed
    assert next(t for t in report.topics if t.topic == "/numbers").count == 1500


def test_the_process_says_what_is_wrong(tmp_path: Path) -> None:
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "x").write_text("")
    process = start_recorder(tmp_path / "run", DOMAIN)
    _, err = process.communicate(timeout=30)
    assert process.returncode == 1
    assert "exists already" in err
    assert "Traceback" not in err


def test_a_full_disk_ends_the_process_with_a_readable_bag(tmp_path: Path, rig: Rig) -> None:
    publisher = rig.node.create_publisher(ByteMultiArray, "/noise", 1000)
    process = start_recorder(tmp_path / "run", DOMAIN)
    rng = random.Random(3)
    head = b"\x00\x01\x00\x00" + bytes(8) + (8192).to_bytes(4, "little")
    try:
        rig.spin_until(lambda: publisher.get_subscription_count() == 1, timeout=20.0)
        resource.prlimit(process.pid, resource.RLIMIT_FSIZE, (700_000, 700_000))
        for _ in range(300):
            publisher.publish(head + rng.randbytes(8192))
            time.sleep(0.008)
        _, err = process.communicate(timeout=20)
    finally:
        if process.poll() is None:
            process.kill()
            process.communicate()
    assert process.returncode == 1
    assert "could not be written" in err
    assert "Traceback" not in err
    report = inspect_bag(tmp_path / "run")
    assert 0 < next(t for t in report.topics if t.topic == "/noise").count < 300


def test_five_thousand_messages_a_second_without_loss(tmp_path: Path) -> None:
    from hri_sim.recording.benchmark import benchmark_recorder

    result = benchmark_recorder(5000.0, 1.0, domain=DOMAIN, folder=tmp_path)
    assert (result.lost, result.gaps, result.duplicated) == (0, 0, 0)
    assert result.recorded == result.sent == 5000
    assert 0.0 < result.largest_lag_s < 1.0
    assert 0.0 < result.longest_unsaved_s < 1.0
    assert result.file_bytes > 5000
