from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

rclpy = pytest.importorskip("rclpy")
pytest.importorskip("hri_msgs.msg")

from rclpy.experimental.events_executor import EventsExecutor  # noqa: E402
from rclpy.node import Node  # noqa: E402
from rclpy.parameter import Parameter  # noqa: E402
from rclpy.serialization import serialize_message  # noqa: E402
from std_msgs.msg import Header, String  # noqa: E402

from hri_prediction.bags import BagWriter, TopicInfo  # noqa: E402
from hri_prediction.errors import ConfigError  # noqa: E402
from hri_prediction.ros.messages import Cue, HumanArm, IdsList  # noqa: E402
from hri_prediction.ros.qos import LATCHED, SENSOR  # noqa: E402
from hri_prediction.ros.time import to_ns, to_time  # noqa: E402
from hri_prediction.tracks.files import save_tracks  # noqa: E402
from hri_prediction.tracks.track import ArmTrack  # noqa: E402
from hri_sim.nodes.replayer_node import ReplayerNode  # noqa: E402
from hri_sim.scenario.schema import BACK  # noqa: E402
from hri_sim.testing.domain import own_domain  # noqa: E402
from hri_sim.tools import replay_mocap  # noqa: E402

DOMAIN = own_domain("replayer_node")
NS = 10**9
ARM = np.array([[0.0, 0.0, 0.4], [0.0, 0.0, 0.11], [-0.25, 0.0, 0.11], [-0.34, 0.0, 0.11]])
POINTS = ARM + np.random.default_rng(1).normal(scale=0.02, size=(40, 4, 3))


@pytest.fixture
def track_file(tmp_path: Path) -> Path:
    path = tmp_path / "tracks.npz"
    save_tracks(path, [ArmTrack(np.arange(40) / 100.0, POINTS, subject="ann")])
    return path


class Rig:
    """A context, a listener, and replayers that are ticked by their timers."""

    def __init__(self) -> None:
        self.context = rclpy.Context()
        rclpy.init(context=self.context, domain_id=DOMAIN)
        self.node = Node("listener", context=self.context)
        self.executor = EventsExecutor(context=self.context)
        self.executor.add_node(self.node)
        self.heard: dict[str, list] = {}
        self.replayers: list[ReplayerNode] = []

    def listen(self, kind, topic: str, qos) -> list:
        heard = self.heard[topic] = []
        self.node.create_subscription(kind, topic, heard.append, qos)
        return heard

    def replayer(self, **values) -> ReplayerNode:
        overrides = [Parameter(name, value=value) for name, value in values.items()]
        node = ReplayerNode(context=self.context, parameter_overrides=overrides)
        self.replayers.append(node)
        self.executor.add_node(node)
        return node

    def spin_until(self, done: Callable[[], bool], timeout: float = 10.0) -> None:
        end = time.monotonic() + timeout
        while not done():
            assert time.monotonic() < end, "timed out"
            self.executor.spin_once(timeout_sec=0.02)

    def spin(self, seconds: float) -> None:
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self.executor.spin_once(timeout_sec=0.02)

    def close(self) -> None:
        for node in self.replayers:
            node.close()
        self.executor.shutdown()
        for node in [*self.replayers, self.node]:
            node.destroy_node()
        rclpy.try_shutdown(context=self.context)


@pytest.fixture
def rig() -> Iterator[Rig]:
    made = Rig()
    yield made
    made.close()


def keypoints(messages: list[HumanArm]) -> np.ndarray:
    return np.array([message.keypoints for message in messages]).reshape(-1, 4, 3)


def test_a_track_is_played_now(rig: Rig, track_file: Path) -> None:
    arms = rig.listen(HumanArm, "/humans/bodies/person1/arm", SENSOR)
    true = rig.listen(HumanArm, "/sim/bodies/person1/arm", SENSOR)
    ids = rig.listen(IdsList, "/humans/bodies/tracked", LATCHED)
    node = rig.replayer(file=str(track_file), place="1,0,0,0", hold=False)
    before = time.time_ns()
    rig.spin_until(lambda: node.finished)
    rig.spin(0.2)
    np.testing.assert_allclose(keypoints(arms), POINTS + np.array([1, 0, 0]))
    np.testing.assert_allclose(keypoints(true), POINTS + np.array([1, 0, 0]))
    stamps = np.array([to_ns(message.header.stamp) for message in arms])
    np.testing.assert_allclose(np.diff(stamps), 10_000_000, atol=1)
    assert before < stamps[0] < before + 3 * NS
    assert arms[0].header.frame_id == "world"
    assert ids[-1].ids == ["person1"]
    node.close()
    rig.spin(0.1)
    assert ids[-1].ids == ["person1"]  # nobody tracked would let a robot go on


def test_a_cue_plays_at_its_stamp_and_the_pose_is_held_around(rig: Rig, track_file: Path) -> None:
    arms = rig.listen(HumanArm, "/humans/bodies/bob/arm", SENSOR)
    node = rig.replayer(file=str(track_file), body_id="bob", start="cue", rate=2.0)
    cues = rig.node.create_publisher(Cue, "/sim/cue", 10)
    rig.spin_until(lambda: len(arms) > 20 and cues.get_subscription_count() == 1)
    np.testing.assert_allclose(keypoints(arms), np.broadcast_to(POINTS[0], (len(arms), 4, 3)))
    # One is for nobody, the other for who can go back.
    for target in ("", BACK):
        cues.publish(Cue(header=Header(stamp=to_time(node.now_ns())), person_target=target))
    rig.spin(0.2)
    assert node.player.start_ns is None
    start = node.now_ns() + 300_000_000
    cues.publish(Cue(header=Header(stamp=to_time(start)), person_target="t", delay=0.1))
    rig.spin_until(lambda: node.finished)
    rig.spin(0.2)
    stamps = np.array([to_ns(message.header.stamp) for message in arms])
    played = (stamps >= start + 100_000_000) & (stamps <= start + 100_000_000 + 39 * 5_000_000)
    np.testing.assert_allclose(keypoints(arms)[played], POINTS)
    np.testing.assert_allclose(keypoints(arms)[-5:], np.broadcast_to(POINTS[-1], (5, 4, 3)))
    assert (np.diff(stamps) > 0).all()
    assert np.median(np.diff(stamps)) == 5_000_000


def test_a_cue_without_a_stamp_plays_now(rig: Rig, track_file: Path) -> None:
    node = rig.replayer(file=str(track_file), body_id="bob", start="cue")
    cues = rig.node.create_publisher(Cue, "/sim/cue", 10)
    rig.spin_until(lambda: cues.get_subscription_count() == 1)
    before = node.now_ns()
    cues.publish(Cue(person_target="t", delay=0.1))
    rig.spin_until(lambda: node.player.start_ns is not None)
    assert before + NS // 10 <= node.player.start_ns <= node.now_ns() + NS // 10


def test_lock_step_ticks_decide_what_is_said(rig: Rig, track_file: Path) -> None:
    overrides = [
        Parameter(name, value=value)
        for name, value in {"file": str(track_file), "start_delay": 0.1, "hold": False}.items()
    ]
    node = ReplayerNode(context=rig.context, lockstep_ns=NS, parameter_overrides=overrides)
    rig.replayers.append(node)
    for step in range(200):
        node.tick(NS + step * 4_000_000)
    assert node.finished
    assert node.publishers_by_topic["/humans/bodies/person1/arm"].sent == 40


def test_other_topics_of_a_bag(tmp_path: Path, rig: Rig) -> None:
    with BagWriter(tmp_path / "bag") as writer:
        head = writer.add_topic(TopicInfo("/head", "std_msgs/msg/Header"))
        text = writer.add_topic(TopicInfo("/text", "std_msgs/msg/String"))
        writer.write(head, serialize_message(Header(stamp=to_time(9 * NS))), 10 * NS)
        writer.write(text, serialize_message(String(data="hi")), 10 * NS + 100_000_000)
    heads = rig.listen(Header, "/head", 10)
    texts = rig.listen(String, "/text", 10)
    node = rig.replayer(file=str(tmp_path / "bag"), topics=["/.*"])
    rig.spin_until(lambda: node.finished and len(texts) == 1)
    assert texts[0].data == "hi"
    assert to_ns(heads[0].stamp) == node.player.start_ns - NS


def test_original_stamps(rig: Rig, tmp_path: Path) -> None:
    with BagWriter(tmp_path / "bag") as writer:
        head = writer.add_topic(TopicInfo("/head", "std_msgs/msg/Header"))
        writer.write(head, serialize_message(Header(stamp=to_time(9 * NS))), 10 * NS)
    heads = rig.listen(Header, "/head", 10)
    rig.replayer(file=str(tmp_path / "bag"), topics=["/head"], original_stamps=True)
    rig.spin_until(lambda: len(heads) == 1)
    assert to_ns(heads[0].stamp) == 9 * NS


def test_bad_parameters_are_refused(rig: Rig, track_file: Path) -> None:
    with pytest.raises(ConfigError, match=r"file is empty"):
        rig.replayer()
    with pytest.raises(ConfigError, match=r"placement"):
        rig.replayer(file=str(track_file), place="1,2")
    with pytest.raises(ConfigError, match=r"start"):
        rig.replayer(file=str(track_file), start="soon")


def test_the_command_plays_and_ends(
    rig: Rig, track_file: Path, monkeypatch: pytest.MonkeyPatch, capfd
) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", str(DOMAIN))
    arms = rig.listen(HumanArm, "/humans/bodies/person1/arm", SENSOR)
    assert replay_mocap.main([str(track_file), "--delay", "1", "--rate", "4", "--no-truth"]) == 0
    rig.spin(0.3)
    assert len(arms) == 40
    assert "ann" in capfd.readouterr().err
    assert replay_mocap.main([str(track_file), "--trial", "7"]) == 1
    assert "from 0 to 0" in capfd.readouterr().err
    assert replay_mocap.main(["/no/such/file.npz"]) == 1


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_the_command_ends_in_mid_motion(
    rig: Rig, track_file: Path, monkeypatch: pytest.MonkeyPatch, capfd, number: signal.Signals
) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", str(DOMAIN))
    arms = rig.listen(HumanArm, "/humans/bodies/person1/arm", SENSOR)
    before = signal.getsignal(number)

    def end_it() -> None:
        try:
            rig.spin_until(lambda: len(arms) > 3)
        finally:
            os.kill(os.getpid(), number)

    other = threading.Thread(target=end_it)
    other.start()
    assert replay_mocap.main([str(track_file), "--rate", "0.05", "--loop", "--no-truth"]) == 0
    other.join()
    assert len(arms) > 3
    assert signal.getsignal(number) == before
    said = capfd.readouterr().err
    assert "playing ann" in said
    assert "Traceback" not in said
    assert "invalid" not in said


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--body", "my body"], "body id 'my body'"),
        (["--body", "1st"], "digit"),
        (["--rate", "0"], "rate"),
        (["--rate", "nan"], "rate"),
        (["--place", "nonsense"], "X,Y,Z,YAW"),
        (["--place", "0,0,inf,0"], "X,Y,Z,YAW"),
        (["--trial", "1"], "from 0 to 0"),
        (["--trial", "-5"], "trial"),
        (["--resample", "-1"], "resample"),
        (["--resample", "nan"], "resample"),
        (["--delay", "-1"], "delay"),
        (["--delay", "inf"], "delay"),
        (["--topics", "/x"], "no topics"),
    ],
)
def test_wrong_options_give_one_clear_line(
    track_file: Path, options: list[str], words: str, monkeypatch: pytest.MonkeyPatch, capfd
) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", str(DOMAIN))
    assert replay_mocap.main([str(track_file), *options]) == 1
    err = capfd.readouterr().err
    assert err.startswith("replay_mocap.py: ")
    assert err.count("\n") == 1
    assert words in err


def test_a_bag_without_an_arm_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd
) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", str(DOMAIN))
    with BagWriter(tmp_path / "bag") as writer:
        channel = writer.add_topic(TopicInfo("/text", "std_msgs/msg/String"))
        writer.write(channel, serialize_message(String(data="hi")), NS)
    assert replay_mocap.main([str(tmp_path / "bag")]) == 1
    err = capfd.readouterr().err
    assert err.count("\n") == 1
    assert "has no topic humans/bodies/<id>/arm" in err
    assert "/text" in err
