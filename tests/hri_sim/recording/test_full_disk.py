"""A disk that really is full: what is said of it, and what of the recording can be read."""

from __future__ import annotations

import os
import random
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from rosbags.highlevel import AnyReader

from hri_prediction.bags import BagReader, BagWriter, TopicInfo, inspect_bag, salvage
from hri_prediction.errors import DataError
from hri_sim.recording.recorder_core import RecorderConfig, RecorderCore
from hri_sim.testing.domain import own_domain

INFO = TopicInfo("/noise", "std_msgs/msg/ByteMultiArray")
DOMAIN = own_domain("full_disk")


@pytest.fixture
def disk(tmp_path: Path) -> Iterator[Path]:
    """A disk of 2 MB."""
    folder = tmp_path / "disk"
    folder.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", "size=2m", "tmpfs", str(folder)]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        pytest.skip(f"a small disk cannot be mounted here: {done.stderr.strip()}")
    yield folder
    subprocess.run(["umount", "--lazy", str(folder)], check=True)


def noise(core: RecorderCore, count: int) -> None:
    """Messages of 1 kB that no compression makes smaller."""
    rng = random.Random(5)
    topic = core.add_topic(INFO)
    for index in range(count):
        core.push(topic, rng.randbytes(1000), 1000 + index, index, index + 1)
        if index % 100 == 0:
            time.sleep(0.01)


def wait(done, what: str) -> None:
    end = time.monotonic() + 5.0
    while not done():
        assert time.monotonic() < end, what
        time.sleep(0.01)


def config(**values: object) -> RecorderConfig:
    return RecorderConfig(
        **{"flush_period": 0.05, "chunk_kilobytes": 64, "min_free_megabytes": 0, **values}
    )


def test_what_was_recorded_before_the_disk_was_full(disk: Path) -> None:
    core = RecorderCore(disk / "run", config(), custom_data={"seed": "1"})
    noise(core, 3000)
    wait(lambda: core.must_end, "an error")
    assert "No space left on device" in core.state.error
    try:
        core.close()
    except DataError:  # even the index found no room
        folder = disk.parent / "saved"
        salvage(disk / "run", folder)
    else:
        folder = disk / "run"
    messages = list(BagReader(folder).messages())
    assert [m.sequence for m in messages] == list(range(1, len(messages) + 1))
    assert 1000 < len(messages) < 2100
    assert core.missing_by_topic == {"/noise": 3000 - len(messages)}
    with AnyReader([folder]) as reader:
        assert sum(1 for _ in reader.messages()) == len(messages)


def test_room_for_the_end_is_kept(disk: Path) -> None:
    core = RecorderCore(disk / "run", config(min_free_megabytes=1))
    noise(core, 3000)
    wait(lambda: core.must_end, "an error")
    assert "MB left" in core.state.error
    metadata = core.close()
    assert inspect_bag(disk / "run").closed
    assert 900 < metadata.message_count < 1300
    with AnyReader([disk / "run"]) as reader:
        assert reader.message_count == metadata.message_count


def test_one_that_stays_goes_on_when_there_is_room_again(disk: Path) -> None:
    filler = disk / "filler"
    filler.write_bytes(bytes(1_500_000))
    core = RecorderCore(disk / "run", config(on_error="stay"))
    noise(core, 1000)
    wait(lambda: core.state.error, "an error")
    assert not core.must_end
    filler.unlink()
    wait(lambda: core.state.written == 1000, "the rest")
    assert core.state.error == ""
    assert core.close().message_count == 1000
    assert core.missing_by_topic == {}


def test_salvage_to_a_full_disk(disk: Path, tmp_path: Path) -> None:
    rng = random.Random(6)
    with BagWriter(tmp_path / "run") as writer:
        channel = writer.add_topic(INFO)
        for index in range(3000):
            writer.write(channel, rng.randbytes(1000), index)
    file = tmp_path / "run" / "run_0.mcap"
    before = file.read_bytes()
    with pytest.raises(DataError, match=r"messages did not fit the disk of .*out|No space left"):
        salvage(tmp_path / "run", disk / "out")
    assert file.read_bytes() == before


def test_the_process_says_so_at_once(disk: Path) -> None:
    rclpy = pytest.importorskip("rclpy")
    from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
    from std_msgs.msg import ByteMultiArray

    process = subprocess.Popen(
        [
            *(sys.executable, "-m", "hri_sim.nodes.recorder_node", "--ros-args"),
            *("-p", f"output:={disk / 'run'}", "-p", "flush_period:=0.1"),
            *("-p", "min_free_megabytes:=0"),
        ],
        env={
            "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
            **os.environ,
            "ROS_DOMAIN_ID": str(DOMAIN),
        },
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=DOMAIN)
    node = rclpy.create_node("talker", context=context)
    executor = rclpy.executors.SingleThreadedExecutor(context=context)
    executor.add_node(node)
    heard: list[tuple[int, DiagnosticStatus]] = []
    node.create_subscription(
        DiagnosticArray,
        "/diagnostics",
        lambda array: heard.extend((time.time_ns(), status) for status in array.status),
        10,
    )
    publisher = node.create_publisher(ByteMultiArray, "/noise", 1000)
    rng = random.Random(3)
    head = b"\x00\x01\x00\x00" + bytes(8) + (8192).to_bytes(4, "little")
    try:
        end = time.monotonic() + 30.0
        while publisher.get_subscription_count() == 0:
            assert time.monotonic() < end
            executor.spin_once(timeout_sec=0.05)
        while process.poll() is None:
            assert time.monotonic() < end
            publisher.publish(head + rng.randbytes(8192))
            executor.spin_once(timeout_sec=0.005)
        output, _ = process.communicate(timeout=10)
    finally:
        if process.poll() is None:
            process.kill()
            process.communicate()
        executor.shutdown()
        node.destroy_node()
        rclpy.try_shutdown(context=context)
    assert process.returncode == 1
    # Twice: in the log, when it happens, and as the reason of the end.
    assert "not writing: cannot write to" in output
    said = next(line for line in output.splitlines() if line.startswith("recorder: "))
    assert "messages could not be written" in said
    assert "No space left on device" in said
    assert "/noise" in said
    assert "Traceback" not in output
    time_ns, status = next(item for item in heard if item[1].level == DiagnosticStatus.ERROR)
    assert "not writing" in status.message
    assert "No space left on device" in status.message
    assert {item.key: item.value for item in status.values}["troubles"] == "disk"
    last_ns = max(m.log_time_ns for m in BagReader(disk / "run", allow_unclosed=True).messages())
    assert (time_ns - last_ns) * 1e-9 < 1.0
