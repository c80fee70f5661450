from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from hri_prediction.bags import BagWriter, TopicInfo, inspect_bag

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


def test_stamps_of_another_clock_are_not_latencies(tmp_path: Path) -> None:
    with BagWriter(tmp_path / "run") as writer:
        channel = writer.add_topic(TopicInfo("/h", "std_msgs/msg/Header"))
        writer.write(channel, stamped(3 * NS), 1_700_000_000 * NS)
    assert inspect_bag(tmp_path / "run").topics[0].stamp is None


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
