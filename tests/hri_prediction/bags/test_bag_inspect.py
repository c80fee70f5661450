from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from hri_prediction.bags import BagWriter, TopicInfo, inspect_bag
from hri_prediction.bags.condition import clock_time, salvage_command
from hri_prediction.errors import DataError

NS = 10**9


def stamped(stamp_ns: int) -> bytes:
    """CDR of a ``std_msgs/Header`` with an empty frame."""
    seconds, rest = divmod(stamp_ns, NS)
    head = b"\x00\x01\x00\x00" + seconds.to_bytes(4, "little") + rest.to_bytes(4, "little")
    return head + b"\x01\x00\x00\x00\x00"


def test_rates_gaps_and_latencies(tmp_path: Path) -> None:
    with BagWriter(tmp_path / "run") as writer:
        channel = writer.add_topic(TopicInfo("/h", "std_msgs/msg/Header"))
        for index in range(101):
            # 100 Hz with a gap of 0.5 s after sample 50; a stamp 8 ms, a sending 1 ms earlier.
            log = 5 * NS + index * 10_000_000 + (490_000_000 if index > 50 else 0)
            sequence = index + 1 + (49 if index > 50 else 0)
            writer.write(channel, stamped(log - 8_000_000), log, log - 1_000_000, sequence)
    report = inspect_bag(tmp_path / "run")
    (topic,) = report.topics
    assert report.closed
    assert report.duration_s == pytest.approx(1.49)
    assert topic.count == 101
    assert topic.rate_hz == pytest.approx(100 / 1.49)
    assert topic.period_s == pytest.approx(0.01)
    assert topic.longest_gap_s == pytest.approx(0.5)
    assert topic.longest_gap_at_s == pytest.approx(0.5)
    assert topic.missing == 49
    assert topic.transport is not None
    assert topic.transport.p99 == pytest.approx(0.001)
    assert topic.stamp is not None
    assert topic.stamp.worst == pytest.approx(0.008)
    assert report.warnings == ("/h: 49 messages are missing",)
    assert json.loads(json.dumps(report.to_mapping()))["topics"][0]["count"] == 101


@pytest.mark.parametrize(
    ("sequence", "missing"),
    [
        ([1, 2, 3], 0),
        ([1, 2, 5], 2),
        ([7, 8, 1, 2, 3], 0),  # the publisher was started again
        ([0, 0, 0], None),
        ([1, 1, 2, 2, 3, 3, 4, 4], None),  # two publishers
        ([4], 0),
    ],
)
def test_missing_messages(tmp_path: Path, sequence: list[int], missing: int | None) -> None:
    with BagWriter(tmp_path / "run") as writer:
        channel = writer.add_topic(TopicInfo("/a", "std_msgs/msg/Empty"))
        for index, number in enumerate(sequence):
            writer.write(channel, b"\x00\x01\x00\x00\x00", index, index, number)
    assert inspect_bag(tmp_path / "run").topics[0].missing == missing


@pytest.mark.parametrize("topic", ["/parameter_events", "/rosout"])
def test_every_node_counts_its_own_parameters_and_logs(tmp_path: Path, topic: str) -> None:
    with BagWriter(tmp_path / "run") as writer:
        channel = writer.add_topic(TopicInfo(topic, "std_msgs/msg/Empty"))
        for index, number in enumerate([3, 4, 5, 29, 30]):  # the end of one node's, and another's
            writer.write(channel, b"\x00\x01\x00\x00\x00", index, index, number)
    report = inspect_bag(tmp_path / "run")
    assert report.topics[0].missing is None
    assert report.warnings == ()


def test_stamps_of_another_clock_are_not_latencies(tmp_path: Path) -> None:
    with BagWriter(tmp_path / "run") as writer:
        channel = writer.add_topic(TopicInfo("/h", "std_msgs/msg/Header"))
        writer.write(channel, stamped(3 * NS), 1_700_000_000 * NS)
    assert inspect_bag(tmp_path / "run").topics[0].stamp is None


def _numbers(folder: Path) -> Path:
    """A bag of many chunks; its file."""
    with BagWriter(folder, chunk_bytes=1000) as writer:
        channel = writer.add_topic(TopicInfo("/a", "std_msgs/msg/UInt64"))
        for index in range(400):
            data = b"\x00\x01\x00\x00" + (index * 7919).to_bytes(8, "little")
            writer.write(channel, data, NS + index * 10**7, sequence=index + 1)
    return folder / f"{folder.name}_0.mcap"


def test_what_is_missing_from_a_file_that_was_not_closed(tmp_path: Path) -> None:
    file = _numbers(tmp_path / "run")
    file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])
    report = inspect_bag(tmp_path / "run")
    (condition,) = report.conditions
    assert (report.closed, report.damage, condition.closed) == (False, "", False)
    assert condition.read_bytes <= condition.size_bytes == file.stat().st_size
    assert condition.messages == report.messages
    assert condition.last_ns == NS + (report.messages - 1) * 10**7
    said = " | ".join(report.warnings)
    assert "run_0.mcap was not closed" in said
    assert f"has no message after {clock_time(condition.last_ns)}" in said
    assert salvage_command(tmp_path / "run") in said
    assert report.to_mapping()["conditions"][0]["read_bytes"] == condition.read_bytes


def test_a_damaged_bag_is_reported_where_that_is_asked_for(tmp_path: Path) -> None:
    file = _numbers(tmp_path / "run")
    content = bytearray(file.read_bytes())
    place = content.index(b"\x28\xb5\x2f\xfd", len(content) // 3)  # magic of a zstd frame
    content[place + 20] ^= 0xFF
    file.write_bytes(content)
    with pytest.raises(DataError, match=r"is damaged.*run --salvage .*run_salvaged"):
        inspect_bag(tmp_path / "run")
    report = inspect_bag(tmp_path / "run", allow_damaged=True)
    assert report.closed
    assert "is damaged" in report.damage
    (condition,) = report.conditions
    assert condition.damaged_chunks == 1
    (topic,) = report.topics
    assert topic.missing == 400 - report.messages > 0
    said = " | ".join(report.warnings)
    assert "the messages of 1 of its chunks are lost" in said
    assert f"/a: {topic.missing} messages are missing" in said


def test_a_bag_with_half_a_metadata_file_is_reported(tmp_path: Path) -> None:
    _numbers(tmp_path / "run")
    (tmp_path / "run" / "metadata.yaml").write_text("rosbag2_bagfile_information: [")
    report = inspect_bag(tmp_path / "run", allow_damaged=True)
    assert (report.closed, report.messages) == (True, 400)
    assert "metadata.yaml" in report.damage
    assert report.conditions[0].words() == ()


@pytest.mark.parametrize(
    ("path", "command"),
    [
        ("runs/bag", "runs/bag --salvage runs/bag_salvaged"),
        ("a b", "'a b' --salvage 'a b_salvaged'"),
        ("x/one.mcap", "x/one.mcap --salvage x/one_salvaged"),
        ("bag/bag_0.mcap", "bag --salvage bag_salvaged"),
    ],
)
def test_the_command_that_salvages(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, path: str, command: str
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bag").mkdir()
    (tmp_path / "bag" / "metadata.yaml").touch()
    assert salvage_command(Path(path)) == f"scripts/inspect_bag.py {command}"


def test_an_empty_bag(tmp_path: Path) -> None:
    BagWriter(tmp_path / "run").close()
    report = inspect_bag(tmp_path / "run")
    assert (report.messages, report.duration_s, report.topics) == (0, 0.0, ())


def test_both_arms_of_a_body_come_back_as_two_tracks(tmp_path: Path) -> None:
    pytest.importorskip("hri_msgs.msg")
    from rclpy.serialization import serialize_message

    from hri_prediction.bags.arms import arm_tracks
    from hri_prediction.ros.conversions import message_from_sample
    from hri_prediction.tracks.track import ArmSample

    points = {"right": np.ones((4, 3)), "left": np.zeros((4, 3))}
    with BagWriter(tmp_path / "run") as writer:
        channel = writer.add_topic(TopicInfo("/humans/bodies/ann/arm", "hri_msgs/msg/HumanArm"))
        for index in range(40):
            stamp = NS + index * 4_000_000
            for side, keypoints in points.items():
                sample = ArmSample(stamp, keypoints, np.ones(4, dtype=bool), side)
                data = serialize_message(message_from_sample(sample, "ann"))
                writer.write(channel, data, stamp)
    tracks = arm_tracks(tmp_path / "run")
    assert [(track.side, len(track), track.trial) for track in tracks] == [
        ("right", 40, 0),
        ("left", 40, 1),
    ]
    for track in tracks:
        np.testing.assert_array_equal(track.keypoints, np.tile(points[track.side], (40, 1, 1)))


def test_arms_come_back_as_tracks(tmp_path: Path) -> None:
    pytest.importorskip("hri_msgs.msg")
    from rclpy.serialization import serialize_message

    from hri_prediction.bags.arms import arm_tracks
    from hri_prediction.ros.conversions import message_from_sample
    from hri_prediction.tracks.track import ArmSample

    rng = np.random.default_rng(3)
    points = rng.normal(size=(60, 4, 3))
    valid = np.ones((60, 4), dtype=bool)
    valid[10, 2] = False
    with BagWriter(tmp_path / "run") as writer:
        channel = writer.add_topic(TopicInfo("/humans/bodies/ann/arm", "hri_msgs/msg/HumanArm"))
        for index in range(60):
            stamp = NS + index * 4_000_000 + (3 * NS if index >= 40 else 0)
            sample = ArmSample(stamp, points[index], valid[index], "left")
            data = serialize_message(message_from_sample(sample, "ann"))
            writer.write(channel, data, stamp + 8_000_000)
    first, second = arm_tracks(tmp_path / "run")
    assert (len(first), len(second)) == (40, 20)
    assert (first.subject, first.side, second.trial) == ("ann", "left", 1)
    np.testing.assert_allclose(second.keypoints, points[40:])
    np.testing.assert_array_equal(first.valid, valid[:40])
    np.testing.assert_allclose(np.diff(first.time_s), 0.004)
