from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hri_prediction.bags import BagWriter, TopicInfo
from hri_prediction.bags.cdr import read_stamp
from hri_prediction.errors import ConfigError, DataError
from hri_prediction.tracks.files import save_tracks
from hri_prediction.tracks.placement import Placement
from hri_prediction.tracks.track import ArmTrack
from hri_sim.recording.playback import (
    Playback,
    Player,
    ScheduledArm,
    ScheduledMessage,
    load_playback,
    track_playback,
)

NS = 10**9


ARM = np.array([[0.0, 0.0, 0.4], [0.0, 0.0, 0.11], [-0.25, 0.0, 0.11], [-0.34, 0.0, 0.11]])


def make_track(count: int = 50, trial: int = 0) -> ArmTrack:
    rng = np.random.default_rng(trial)
    points = ARM + rng.normal(scale=0.02, size=(count, 4, 3))
    return ArmTrack(np.arange(count) / 100.0 + 3.0, points, trial=trial)


def messages(offsets: list[int]) -> Playback:
    items = tuple(ScheduledMessage(offset, "/a", b"", False) for offset in sorted(offsets))
    return Playback("test", items, {"/a": "std_msgs/msg/Empty"}, {}, ())


@given(
    offsets=st.lists(st.integers(0, 10**10), min_size=1, max_size=30),
    steps=st.lists(st.integers(0, 10**9), max_size=60),
    rate=st.sampled_from([0.5, 1.0, 3.0]),
)
def test_each_item_is_played_once_in_order_and_never_early(offsets, steps, rate: float) -> None:
    player = Player(messages(offsets), rate=rate)
    assert player.due(10**15) == []
    start = 10**12
    player.start(start)
    now, played = start - 10**8, []
    for step in [*steps, 10**11]:
        now += step
        for when, item in player.due(now):
            assert when <= now + 1
            assert when == start + round(item.offset_ns / rate)
            played.append(item.offset_ns)
    assert played == sorted(offsets)
    assert player.finished


def test_a_loop_goes_on_with_increasing_times() -> None:
    player = Player(messages([0, 10, 20]), loop=True)
    player.start(1000)
    period = 4_000_000
    times = [when for when, _ in player.due(1000 + 3 * (20 + period))]
    assert times[:6] == [1000, 1010, 1020, 1020 + period, 1030 + period, 1040 + period]
    assert not player.finished


def test_a_second_start_begins_again() -> None:
    player = Player(messages([0, 10, 20]))
    player.start(0)
    assert len(player.due(10)) == 2
    player.start(100)
    assert player.waiting
    assert [when for when, _ in player.due(1000)] == [100, 110, 120]
    player.stop()
    assert player.due(10**9) == []


def test_bad_players_are_refused() -> None:
    with pytest.raises(ConfigError, match=r"nothing to play"):
        Player(Playback("x", (), {}, {}, ()))
    with pytest.raises(ConfigError, match=r"rate"):
        Player(messages([0]), rate=0.0)


def test_a_track_is_placed_and_timed_from_its_start() -> None:
    track = make_track()
    placement = Placement(0.9, 0.1, 0.2, math.pi / 2)
    playback = track_playback(track, "bob", placement)
    tracked = [item for item in playback.items if item.topic == "humans/bodies/bob/arm"]
    true = [item for item in playback.items if item.topic == "sim/bodies/bob/arm"]
    assert len(tracked) == len(true) == 50
    assert [item.offset_ns for item in tracked] == [i * 10_000_000 for i in range(50)]
    assert playback.period_ns == 10_000_000
    expected = placement.apply(track.keypoints)
    np.testing.assert_allclose([item.sample.keypoints for item in tracked], expected)
    assert [item.sample.keypoints.tolist() for item in playback.poses_at(end=False)] == [
        expected[0].tolist()
    ] * 2
    np.testing.assert_array_equal(playback.poses_at(end=True)[0].sample.keypoints, expected[-1])
    assert not any("sim/" in item.topic for item in track_playback(track, "b", truth=False).items)


def test_the_true_arm_has_no_gaps() -> None:
    points = np.array(make_track(6).keypoints)
    points[:2, 3] = np.nan
    points[4, 1] = np.nan
    playback = track_playback(ArmTrack(np.arange(6.0), points), "p")
    true = [item for item in playback.items if item.topic.startswith("sim/")]
    assert [item.offset_ns for item in true] == [i * NS for i in range(2, 6)]
    assert all(item.sample.valid.all() for item in true)
    np.testing.assert_array_equal(true[2].sample.keypoints[1], points[3, 1])
    tracked = [item for item in playback.items if item.topic.startswith("humans/")]
    assert not tracked[4].sample.valid[1]


def test_track_files_and_their_trials(tmp_path: Path) -> None:
    path = tmp_path / "tracks.npz"
    save_tracks(path, [make_track(20, 0), make_track(30, 1)])
    assert load_playback(path).duration_ns == 190_000_000
    assert load_playback(path, trial=1).duration_ns == 290_000_000
    assert load_playback(path, resample_hz=200.0).period_ns == 5_000_000
    assert load_playback(path, body_id="eve").bodies == ("eve",)
    with pytest.raises(ConfigError, match=r"from 0 to 1"):
        load_playback(path, trial=2)
    with pytest.raises(ConfigError, match=r"no bag"):
        load_playback(path, topics=["/a"])


@pytest.fixture
def arm_bag(tmp_path: Path) -> Path:
    pytest.importorskip("hri_msgs.msg")
    from rclpy.serialization import serialize_message
    from std_msgs.msg import Header, String

    from hri_prediction.ros.conversions import message_from_sample

    with BagWriter(tmp_path / "bag") as writer:
        arms = {
            body: writer.add_topic(TopicInfo(f"/humans/bodies/{body}/arm", "hri_msgs/msg/HumanArm"))
            for body in ("ann", "bob")
        }
        header = writer.add_topic(TopicInfo("/head", "std_msgs/msg/Header"))
        text = writer.add_topic(TopicInfo("/text", "std_msgs/msg/String"))
        for body, shift in (("ann", 0), ("bob", 2_000_000)):
            for sample in make_track(10).samples(5 * NS + shift):
                data = serialize_message(message_from_sample(sample, body))
                writer.write(arms[body], data, sample.stamp_ns + 8_000_000)
        stamp = Header(frame_id="x")
        stamp.stamp.sec = 4
        writer.write(header, serialize_message(stamp), 5 * NS)
        writer.write(text, serialize_message(String(data="hi")), 6 * NS)
    return tmp_path / "bag"


def test_a_bag_plays_its_arms_by_their_stamps(arm_bag: Path) -> None:
    playback = load_playback(arm_bag, placement=Placement(z=1.0))
    assert playback.bodies == ("ann", "bob")
    assert set(playback.types) == {
        "/humans/bodies/ann/arm",
        "/humans/bodies/bob/arm",
        "sim/bodies/ann/arm",
        "sim/bodies/bob/arm",
    }
    bob = [i for i in playback.items if i.topic == "/humans/bodies/bob/arm"]
    assert [item.offset_ns for item in bob] == [2_000_000 + i * 10_000_000 for i in range(10)]
    assert isinstance(bob[3], ScheduledArm)
    expected = make_track(10).keypoints[3] + [0, 0, 1]
    np.testing.assert_allclose(bob[3].sample.keypoints, expected)
    assert load_playback(arm_bag, body_id="ann", truth=False).types.keys() == {
        "/humans/bodies/ann/arm"
    }


def test_chosen_topics_keep_the_distance_of_their_stamps(arm_bag: Path) -> None:
    playback = load_playback(arm_bag, topics=["/head", "/te.*"])
    head, text = playback.items
    assert isinstance(head, ScheduledMessage)
    assert isinstance(text, ScheduledMessage)
    assert (head.stamped, head.lag_ns, head.offset_ns) == (True, -NS, 0)
    assert (text.stamped, text.lag_ns, text.offset_ns) == (False, 0, NS)
    assert read_stamp(head.data) == 4 * NS


def test_what_a_bag_does_not_have(arm_bag: Path) -> None:
    with pytest.raises(DataError, match=r"no topic humans/bodies/eve/arm"):
        load_playback(arm_bag, body_id="eve")
    with pytest.raises(ConfigError, match=r"no trials"):
        load_playback(arm_bag, trial=0)
    with pytest.raises(ConfigError, match=r"topics"):
        load_playback(arm_bag, topics=["("])


def test_both_arms_of_a_body_are_played_and_held_each_by_itself(tmp_path: Path) -> None:
    pytest.importorskip("hri_msgs.msg")
    from rclpy.serialization import serialize_message

    from hri_prediction.ros.conversions import message_from_sample
    from hri_prediction.tracks.track import ArmSample

    with BagWriter(tmp_path / "bag") as writer:
        channel = writer.add_topic(TopicInfo("/humans/bodies/ann/arm", "hri_msgs/msg/HumanArm"))
        for index in range(10):
            for side, place in (("right", 0.0), ("left", 1.0)):
                valid = np.array([True, True, index != 5, True])
                sample = ArmSample(NS + index * 10**7, ARM + place, valid, side)
                data = serialize_message(message_from_sample(sample, "ann"))
                writer.write(channel, data, sample.stamp_ns)
    playback = load_playback(tmp_path / "bag")
    assert playback.bodies == ("ann",)
    assert playback.period_ns == 10**7
    for end in (False, True):
        poses = playback.poses_at(end=end)
        assert len(poses) == 4
        for pose in poses:
            place = {"right": 0.0, "left": 1.0}[pose.sample.side]
            np.testing.assert_allclose(pose.sample.keypoints, ARM + place)
    truths = [item for item in playback.items if item.topic == "sim/bodies/ann/arm"]
    assert len(truths) == 20
    for item in truths:
        # Where a wrist is not seen it stays where it was, and not where that of the other arm is.
        place = {"right": 0.0, "left": 1.0}[item.sample.side]
        np.testing.assert_allclose(item.sample.keypoints, ARM + place)
