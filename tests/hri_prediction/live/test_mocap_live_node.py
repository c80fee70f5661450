"""The node: a simulated QTM on one side, the topics of motion capture on the other."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from hri_prediction.live.qtm_server import QtmServer

rclpy = pytest.importorskip("rclpy")
pytest.importorskip("hri_msgs.msg")
pytest.importorskip("qtm_rt")

from diagnostic_msgs.msg import DiagnosticArray  # noqa: E402
from rclpy.experimental.events_executor import EventsExecutor  # noqa: E402
from rclpy.node import Node  # noqa: E402
from rclpy.parameter import Parameter  # noqa: E402

from hri_prediction.errors import ConfigError  # noqa: E402
from hri_prediction.nodes.mocap_live_node import MocapLiveConfig, MocapLiveNode  # noqa: E402
from hri_prediction.ros.conversions import sample_from_message  # noqa: E402
from hri_prediction.ros.messages import HumanArm, IdsList  # noqa: E402
from hri_prediction.ros.node import ERROR, OK  # noqa: E402
from hri_prediction.ros.qos import LATCHED, SENSOR  # noqa: E402
from hri_prediction.ros.time import to_ns  # noqa: E402
from hri_prediction.tracks.importers.convert import (  # noqa: E402
    ImportOptions,
    convert,
    plan_import,
)
from hri_prediction.tracks.importers.recognise import read_markers  # noqa: E402
from hri_prediction.tracks.placement import Placement  # noqa: E402
from hri_sim.testing.domain import own_domain  # noqa: E402

DOMAIN = own_domain("mocap_live_node")
LABELS = ("RSHO", "RELB", "RWRA", "RWRB", "RFIN")
MAP = "shoulder=RSHO,elbow=RELB,wrist=RWRA+RWRB,hand_tip=RFIN"
REST = np.array(
    [[0, 10, 1400], [20, 250, 1250], [40, 480, 1200], [0, 480, 1210], [10, 570, 1190.0]]
)
PLACES = REST + np.arange(100)[:, None, None] * np.array([0.5, 1.0, -0.25])
PLACES[10:20, 2] = np.nan
PLACE = "0.9,0.1,-1,170"


class Rig:
    """A context, a listener, and nodes that are ticked by their timers."""

    def __init__(self, domain: int = DOMAIN) -> None:
        self.context = rclpy.Context()
        rclpy.init(context=self.context, domain_id=domain)
        self.node = Node("listener", context=self.context)
        self.executor = EventsExecutor(context=self.context)
        self.executor.add_node(self.node)
        self.arms: list[HumanArm] = []
        self.ids: list[IdsList] = []
        self.status: list = []
        self.node.create_subscription(HumanArm, "humans/bodies/ann/arm", self.arms.append, SENSOR)
        self.node.create_subscription(IdsList, "humans/bodies/tracked", self.ids.append, LATCHED)
        self.node.create_subscription(
            DiagnosticArray, "/diagnostics", lambda m: self.status.extend(m.status), 10
        )
        self.nodes: list[MocapLiveNode] = []

    def start(self, server: QtmServer, **values) -> MocapLiveNode:
        given = {"port": server.port, "bodies": ["ann"], "maps": [MAP], "silence": 0.3, **values}
        overrides = [Parameter(name, value=value) for name, value in given.items()]
        node = MocapLiveNode(context=self.context, parameter_overrides=overrides)
        self.nodes.append(node)
        self.executor.add_node(node)
        return node

    def until(self, condition, what: str, seconds: float = 10.0) -> None:
        end = time.monotonic() + seconds
        while not condition():
            assert time.monotonic() < end, what
            self.executor.spin_once(timeout_sec=0.05)

    def close(self) -> None:
        for node in self.nodes:
            node.close()
        self.executor.shutdown()
        for node in self.nodes:
            node.destroy_node()
        self.node.destroy_node()
        rclpy.try_shutdown(context=self.context)


@pytest.fixture
def rig() -> Iterator[Rig]:
    rig = Rig()
    yield rig
    rig.close()


@pytest.fixture
def server() -> Iterator[QtmServer]:
    with QtmServer(PLACES, LABELS) as server:
        yield server


def test_frames_become_arms_on_the_topics_of_motion_capture(rig: Rig, server: QtmServer) -> None:
    rig.start(server, place=PLACE)
    rig.until(lambda: len(rig.arms) >= 120, "arms")
    assert {tuple(m.ids) for m in rig.ids} == {("ann",)}
    place = Placement.parse(PLACE)
    begin_ns = time.time_ns() - time.monotonic_ns() + round(server.begin * 1e9)
    stamps = [to_ns(message.header.stamp) for message in rig.arms]
    assert (np.diff(stamps) > 0).all()
    keypoints = PLACES[:, [0, 1, 2, 4]]
    keypoints[:, 2] = PLACES[:, 2:4].mean(axis=1)
    keypoints = place.apply(1e-3 * keypoints)
    late, cycle = [], len(PLACES) / server.rate_hz
    for message, stamp_ns in zip(rig.arms, stamps, strict=True):
        assert (message.header.frame_id, message.body_id, message.side) == ("world", "ann", "right")
        assert np.isfinite(message.keypoints).all()
        sample = sample_from_message(message)
        # The place of the shoulder tells the frame.
        row = int(np.argmin(np.linalg.norm(keypoints[:, 0] - sample.keypoints[0], axis=1)))
        np.testing.assert_array_equal(sample.valid, np.isfinite(keypoints[row]).all(axis=1))
        np.testing.assert_allclose(sample.keypoints, keypoints[row], atol=1e-6)
        after = (stamp_ns - begin_ns) * 1e-9 - row / server.rate_hz
        late.append((after + 0.5 * cycle) % cycle - 0.5 * cycle)
    # Capture times: not before the frame, and later only by what the fastest packet took.
    assert min(late) > -1e-3
    assert np.median(late) < 20e-3
    assert np.ptp(late[20:]) < 20e-3


def test_both_arms_of_a_body_come_on_its_topic(rig: Rig) -> None:
    other = PLACES - np.array([400.0, 0.0, 0.0])
    labels = (*LABELS, *(name.replace("R", "L", 1) for name in LABELS))
    maps = [MAP, "shoulder=LSHO,elbow=LELB,wrist=LWRA+LWRB,hand_tip=LFIN"]
    with QtmServer(np.concatenate((PLACES, other), axis=1), labels) as server:
        node = rig.start(server, bodies=["ann", "ann"], maps=maps, sides=["right", "left"])
        rig.until(lambda: len(rig.arms) >= 60, "arms")
    assert {tuple(m.ids) for m in rig.ids} == {("ann",)}
    shoulders: dict[int, dict[str, np.ndarray]] = {}
    for message in rig.arms:
        assert message.body_id == "ann"
        sample = sample_from_message(message)
        shoulders.setdefault(sample.stamp_ns, {})[sample.side] = sample.keypoints[0]
    both = [each for each in shoulders.values() if len(each) == 2]
    assert len(both) >= 25
    for each in both:
        np.testing.assert_allclose(each["right"] - each["left"], [0.4, 0.0, 0.0], atol=1e-6)
    assert {"ann right", "ann left"} <= node.health()[2].keys()


def test_lost_stream_goes_on_and_the_bodies_stay_tracked(rig: Rig, server: QtmServer) -> None:
    node = rig.start(server)
    rig.until(lambda: len(rig.arms) >= 20, "arms")
    server.hang_up()
    server.restart()
    rig.arms.clear()
    rig.until(lambda: len(rig.arms) >= 20, "arms again")
    stamps = [to_ns(message.header.stamp) for message in rig.arms]
    assert (np.diff(stamps) > 0).all()
    assert abs(time.time_ns() - stamps[-1]) < 0.5e9
    server.close()
    rig.until(lambda: any("cannot connect" in f for f in node.faults), "the loss is told")
    rig.until(
        lambda: any(s.name == "/mocap_live" and s.level == b"\x02" for s in rig.status),
        "an error on /diagnostics",
    )
    rig.nodes.pop().close()
    assert {tuple(m.ids) for m in rig.ids} == {("ann",)}


def test_a_client_that_has_ended_is_an_error(rig: Rig, server: QtmServer) -> None:
    node = rig.start(server)
    rig.until(lambda: rig.arms, "frames")
    assert node.health()[0] == OK
    node._client.close()  # as if its thread had died
    level, text, _ = node.health()
    assert (level, "has ended" in text) == (ERROR, True)
    rig.until(lambda: any("has ended" in fault for fault in node.faults), "the fault")


def test_the_body_is_named_as_by_every_other_source() -> None:
    assert MocapLiveConfig().bodies == ("person1",)


def test_guess_is_reported_and_not_used(rig: Rig, server: QtmServer) -> None:
    node = rig.start(server, maps=[""])
    rig.until(lambda: bool(node.health()[1].startswith("guessed")), "the guess")
    assert MAP in node.health()[1]
    assert not rig.arms
    rig.nodes.pop().close()
    rig.executor.remove_node(node)
    node.destroy_node()
    rig.start(server, maps=[""], accept_guess=True)
    rig.until(lambda: len(rig.arms) >= 5, "arms")


def test_labels_that_do_not_fit_any_more(rig: Rig, server: QtmServer) -> None:
    node = rig.start(server)
    rig.until(lambda: len(rig.arms) >= 5, "arms")
    server.names[0] = "RSHO2"
    server.hang_up()
    rig.until(lambda: "there is no marker 'RSHO'" in node.health()[1], "it is told")
    server.names[0] = "RSHO"
    server.hang_up()
    rig.arms.clear()
    rig.until(lambda: len(rig.arms) >= 5, "arms again")


@pytest.mark.parametrize(
    ("values", "match"),
    [
        ({"maps": ["shoulder=A"]}, "the mapping has no elbow"),
        ({"bodies": ["a", "a"], "maps": [MAP, MAP]}, "different bodies, or left and right"),
        (
            {"bodies": ["a", "a"], "maps": [MAP, MAP], "sides": ["left", "left"]},
            "different bodies, or left and right",
        ),
        (
            {"bodies": ["a"] * 3, "maps": [MAP] * 3, "sides": ["left", "right", "left"]},
            "different bodies, or left and right",
        ),
        ({"bodies": ["a b"]}, "letters, digits and _"),
        ({"bodies": ["a", "b"], "maps": [MAP]}, "maps has 1 entries; expected 2"),
        ({"bodies": ["a", "b"], "maps": [""]}, "several bodies need maps"),
        ({"sides": ["both"]}, "side 'both'"),
        ({"place": "1,2"}, "placement '1,2'"),
        ({"axes": "up"}, "--axes up"),
        ({"port": 0}, "port"),
        ({"use_sim_time": True}, "not that of a simulation"),
    ],
)
def test_parameters_that_cannot_be(rig: Rig, server: QtmServer, values, match: str) -> None:
    with pytest.raises(ConfigError, match=match):
        rig.start(server, **values)


@pytest.mark.parametrize("extra", [True, False])
def test_as_a_process(rig: Rig, server: QtmServer, tmp_path: Path, extra: bool) -> None:
    code = "" if extra else "import sys; sys.modules['qtm_rt'] = None; "
    code += "from hri_prediction.nodes.mocap_live_node import main; raise SystemExit(main())"
    given = [f"port:={server.port}", "bodies:=['ann']", f"maps:=['{MAP}']"]
    command = [sys.executable, "-c", code, "--ros-args"]
    for each in given:
        command += ["-p", each]
    process = subprocess.Popen(
        command,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "ROS_DOMAIN_ID": str(DOMAIN)},
    )
    try:
        if extra:
            rig.until(lambda: len(rig.arms) >= 50, "arms", 30.0)
            process.terminate()
        _, said = process.communicate(timeout=30)
    finally:
        process.kill()
        process.wait()
    assert process.returncode == (0 if extra else 1)
    assert ("pip install -r requirements/qualisys.txt" in said) == (not extra)
    if not extra:
        assert said.strip().count("\n") == 0


def test_recorded_stream_is_the_import_of_the_same_recording(rig: Rig) -> None:
    folder = os.environ.get("HRI_DATA_DIR")
    if not folder:
        pytest.skip("HRI_DATA_DIR is not set")
    path = Path(folder) / "pickplace_dfki_qualisys" / "original" / "subject1_run1.tsv"
    data = read_markers(path)
    mapping = "shoulder=Shoulder,elbow=Elbow,wrist=Hand right+Hand left,hand_tip=Index"
    track = convert(plan_import(data, ImportOptions(mapping=mapping, side="right")))
    with QtmServer(data.positions, data.labels, rate_hz=240.0) as server:
        rig.start(server, maps=[mapping], sides=["right"])
        rig.until(lambda: len(rig.arms) >= 200, "arms")
    # Shoulder places are all different: they tell the row.
    shoulders = track.keypoints[:, 0]
    for message in rig.arms:
        sample = sample_from_message(message)
        row = int(np.nanargmin(np.linalg.norm(shoulders - sample.keypoints[0], axis=1)))
        np.testing.assert_array_equal(sample.valid, track.valid[row])
        np.testing.assert_allclose(sample.keypoints, track.keypoints[row], atol=1e-6)
