"""The launch script with real processes: a run, Ctrl-C, deaths of nodes, wrong arguments."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import psutil
import pytest
from launched import Launched, addresses, wait_until_moving
from mcap_ros2.reader import read_ros2_messages
from rosbags.rosbag2 import Reader
from typer.testing import CliRunner

from hri_prediction.bags.reader import BagReader
from hri_prediction.bags.salvage import salvage
from hri_prediction.bags.structure import is_closed
from hri_prediction.errors import HriError
from hri_prediction.ros.this_machine import CHOICES
from hri_prediction.ros.time import to_ns
from hri_sim.launch.ptomp import app

Launch = Callable[..., Launched]
REST = 0.02


def still_running(processes: dict[str, psutil.Process], timeout_s: float = 3.0) -> list[str]:
    """Names of those that still run after a time."""
    _, alive = psutil.wait_procs(list(processes.values()), timeout=timeout_s)
    return [name for name, process in processes.items() if process in alive]


def joint_speeds(bag: Path) -> tuple[np.ndarray, np.ndarray]:
    """Stamps (N,) on the wall clock [s] and largest joint speeds (N,) [rad/s]."""
    reader = BagReader(bag, allow_unclosed=True)
    messages = [message.decode() for message in reader.messages({"/joint_states"})]
    stamps = np.array([to_ns(m.header.stamp) * 1e-9 for m in messages])
    return stamps, np.array([np.abs(m.velocity).max() for m in messages])


def assert_at_rest_within(bag: Path, since_s: float, limit_ms: float) -> float:
    stamps, speeds = joint_speeds(bag)
    moving = (speeds >= REST) & (stamps > since_s)
    assert moving.any(), "the robot did not move to begin with"
    assert not moving[-1], "the bag ends while the robot moves"
    took = (stamps[np.flatnonzero(moving)[-1] + 1] - since_s) * 1e3
    assert took <= limit_ms
    return float(took)


def nodes_of_moving_robot(launched: Launched) -> dict[str, psutil.Process]:
    """The node processes as soon as the robot moves; looking for them first, as that takes a while."""
    launched.wait_for("waiting for")
    nodes = launched.nodes()
    wait_until_moving(launched)
    return nodes


def listen_from_a_terminal_of_the_users(launched: Launched, topic: str) -> subprocess.Popen[str]:
    """A process in which nothing is set for discovery; ends when it has heard one message."""
    environment = {name: value for name, value in os.environ.items() if name not in CHOICES}
    environment["ROS_DOMAIN_ID"] = str(launched.domain)
    command = [sys.executable, "-m", "hri_sim.tools.echo_topic", topic, "--once", "--timeout", "30"]
    return subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True)


def test_a_run_from_start_to_end(launch: Launch) -> None:
    run = launch("--reaches", "1", "--seed", "100")
    terminal = listen_from_a_terminal_of_the_users(run, "/joint_states")
    nodes = nodes_of_moving_robot(run)
    assert len(nodes) == 5
    assert "velocity" in terminal.communicate(timeout=30.0)[0]
    assert run.end() == 0, run.text
    assert not still_running(nodes)

    summary = json.loads((run.out / "summary.json").read_text())
    assert summary["outcome"] == "reached"
    (reach,) = summary["reaches"]
    assert summary["person"] is None
    assert summary["interaction_costs"] is None
    assert reach["goal_error_m"] <= 0.01
    assert reach["min_clearance_m"] > 0.0
    assert reach["max_handover_jump_rad"] < 1e-3
    assert summary["prediction_rate_hz"] >= 25.0
    assert summary["mocap_rate_hz"] == pytest.approx(250.0, rel=0.05)
    assert (run.out / "picture.png").stat().st_size > 10_000

    with Reader(run.out / "bag") as reader:
        by_rosbags = {topic: info.msgcount for topic, info in reader.topics.items()}
    (file,) = (run.out / "bag").glob("*.mcap")
    by_mcap: dict[str, int] = {}
    first_ns: dict[str, int] = {}
    # Its parser refuses the names of an action's hidden types (ReachTarget_FeedbackMessage).
    plain = [topic for topic in by_rosbags if "/_action/" not in topic]
    for message in read_ros2_messages(str(file), topics=plain):
        topic = message.channel.topic
        by_mcap[topic] = by_mcap.get(topic, 0) + 1
        first_ns.setdefault(topic, message.log_time_ns)
    scheduled: dict[str, set[str]] = {}
    for message in read_ros2_messages(str(file), topics=["/diagnostics"]):
        for status in message.ros_msg.status:
            figures = {value.key: value.value for value in status.values}
            assert figures.get("compiled_late", "") == "", f"{status.name} waited for a compiler"
            scheduled.setdefault(status.hardware_id, set()).add(figures.get("scheduling"))
    assert scheduled["ptomp"] == {"shared"}
    assert by_mcap == {topic: by_rosbags[topic] for topic in plain if by_rosbags[topic]}
    wanted = {
        "/joint_states",
        "/humans/bodies/person1/arm",
        "/humans/bodies/person1/prediction",
        "/joint_trajectory_controller/joint_trajectory",
        "/ptomp/status",
        "/sim/state",
        "/robot_description",
    }
    assert wanted <= by_mcap.keys()
    # The begin of the first reach is in the bag.
    assert max(first_ns["/sim/state"], first_ns["/joint_states"]) < first_ns["/sim/cue"]
    print(f"{sum(by_mcap.values())} messages, latency {summary['latency_ms']}")


@pytest.mark.parametrize(("number", "wanted"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_signal_stops_the_robot_then_all_nodes(
    launch: Launch, number: signal.Signals, wanted: int
) -> None:
    run = launch("--reaches", "2", "--seed", "101")
    nodes = nodes_of_moving_robot(run)
    begin, clock = time.monotonic(), time.time()
    run.process.send_signal(number)
    code = run.end(8.0)
    took = time.monotonic() - begin
    assert code == wanted, run.text
    assert not still_running(nodes, 0.5)
    assert "Traceback" not in run.text
    assert "had to be killed" not in run.text
    assert str(run.out) in run.text
    (file,) = (run.out / "bag").glob("*.mcap")
    assert is_closed(file)
    with Reader(run.out / "bag") as reader:
        assert reader.message_count > 500
    summary = json.loads((run.out / "summary.json").read_text())
    assert summary["outcome"] == "interrupted"
    assert summary["reaches"][-1]["outcome"] == "interrupted"
    assert summary["reaches"][-1]["min_clearance_m"] is not None
    assert "Reaches" in run.text
    stopped = assert_at_rest_within(run.out / "bag", clock, 400.0)
    for log in (run.out / "log").glob("*.log"):
        assert "Traceback" not in log.read_text(), log.read_text()
    print(f"all ended {took:.1f} s after {number.name}, the robot at rest after {stopped:.0f} ms")


def test_ctrl_c_twice_keeps_recording_and_summary(launch: Launch) -> None:
    run = launch("--reaches", "1", "--seed", "101")
    nodes = nodes_of_moving_robot(run)
    run.process.send_signal(signal.SIGINT)
    run.wait_for("Ctrl-C again")
    run.process.send_signal(signal.SIGINT)
    assert run.end(20.0) == 130, run.text
    assert not still_running(nodes, 0.5)
    assert "Traceback" not in run.text
    (file,) = (run.out / "bag").glob("*.mcap")
    assert is_closed(file)
    summary = json.loads((run.out / "summary.json").read_text())
    assert summary["outcome"] == "interrupted"
    assert summary["reaches"][-1]["min_clearance_m"] is not None
    assert "Reaches" in run.text


@pytest.mark.parametrize(
    ("name", "number", "how"),
    [
        ("predictor", signal.SIGKILL, "was ended by SIGKILL"),
        ("person", signal.SIGKILL, "was ended by SIGKILL"),
        ("ptomp", signal.SIGKILL, "was ended by SIGKILL"),
        # In order, with all that a node says in parting.
        ("person", signal.SIGTERM, "ended with exit code 0"),
    ],
)
def test_a_killed_node_stops_the_robot(
    launch: Launch, name: str, number: signal.Signals, how: str
) -> None:
    run = launch("--reaches", "1", "--seed", "100")
    nodes = nodes_of_moving_robot(run)
    killed = time.time()
    nodes[name].send_signal(number)
    code = run.end(15.0)
    assert code == 1, run.text
    assert f"node {name} {how}" in run.text
    assert "Traceback" not in run.text
    assert not still_running(nodes, 0.5)
    (reach,) = json.loads((run.out / "summary.json").read_text())["reaches"]
    assert reach["outcome"] == "interrupted"
    assert reach["reason"] == f"node {name} {how}"
    took = assert_at_rest_within(run.out / "bag", killed, 200.0)
    print(f"{name} killed: at rest after {took:.0f} ms")


def test_a_killed_simulator_is_named(launch: Launch) -> None:
    run = launch("--reaches", "1", "--seed", "100")
    nodes = nodes_of_moving_robot(run)
    nodes["simulator"].send_signal(signal.SIGKILL)
    assert run.end(15.0) == 1, run.text
    assert "node simulator was ended by SIGKILL" in run.text
    assert not still_running(nodes, 0.5)


def test_a_killed_recorder_does_not_end_the_run(launch: Launch, tmp_path: Path) -> None:
    run = launch("--reaches", "1", "--seed", "100")
    nodes = nodes_of_moving_robot(run)
    killed = time.time()
    nodes["recorder"].send_signal(signal.SIGKILL)
    run.wait_for("node recorder was ended by SIGKILL; the run goes on", 1.0)
    code = run.end()
    assert code == 0, run.text
    assert "Traceback" not in run.text
    assert not still_running(nodes, 0.5)
    (file,) = (run.out / "bag").glob("*.mcap")
    assert not is_closed(file)
    report = salvage(run.out / "bag", tmp_path / "salvaged")
    with Reader(tmp_path / "salvaged") as reader:
        assert reader.message_count > 500
    stamps, _ = joint_speeds(tmp_path / "salvaged")
    lost = killed - stamps[-1]
    assert lost <= 1.0
    assert report.metadata.message_count > 500
    print(f"salvaged up to {lost:.2f} s before the kill")


def test_a_recorder_killed_before_it_recorded_does_not_end_the_run(launch: Launch) -> None:
    run = launch("--reaches", "1", "--seed", "100")
    run.wait_for("waiting for")
    while "recorder" not in (nodes := run.nodes()):
        assert run.process.poll() is None, run.text
    nodes["recorder"].send_signal(signal.SIGKILL)
    run.wait_for("node recorder was ended by SIGKILL; the run goes on", 1.0)
    assert run.end() == 0, run.text
    assert "Traceback" not in run.text
    assert "no figures of the recording" in run.text
    summary = json.loads((run.out / "summary.json").read_text())
    assert summary["outcome"] == "reached"
    (reach,) = summary["reaches"]
    assert reach["goal_error_m"] is None
    assert reach["min_clearance_m"] > 0.0  # as seen live
    assert summary["touched"] is False
    assert reach["replans"] > 0
    assert not still_running(nodes, 0.5)


def test_a_killed_launcher_leaves_no_orphans(launch: Launch) -> None:
    run = launch("--reaches", "3", "--seed", "100")
    nodes = nodes_of_moving_robot(run)
    assert len(nodes) == 5
    # Here, as a look at a process' memory stalls it for longer than a motion lasts.
    for name, node in nodes.items():
        # On this machine alone, and over nothing that a killed node could leave locked.
        assert not [m.path for m in node.memory_maps() if m.path.startswith("/dev/shm/fast")], name
        assert addresses(node) == {"127.0.0.1"}, name
    run.process.send_signal(signal.SIGKILL)
    assert not still_running(nodes, 8.0)


def _not_empty(folder: Path) -> Path:
    (folder / "old").mkdir()
    (folder / "old" / "notes.txt").write_text("mine")
    return folder / "old"


def _a_file(folder: Path) -> Path:
    (folder / "file").write_text("mine")
    return folder / "file"


@pytest.mark.parametrize("make", [_not_empty, _a_file, lambda _: Path("/proc/nowhere/run")])
def test_a_folder_that_cannot_be_used(
    launch: Launch, tmp_path: Path, make: Callable[[Path], Path]
) -> None:
    folder = make(tmp_path)
    run = launch(out=folder)
    assert run.end(20.0) == 1
    assert str(folder) in run.text
    assert "error:" in run.text
    assert run.text.count("\n") == 1
    assert "--out" in run.text
    if folder.is_dir():
        assert [path.name for path in folder.iterdir()] == ["notes.txt"]


@pytest.mark.parametrize(
    ("options", "words"),
    [(["--planner", "rrt"], "ptomp"), (["--human", "replay"], "--human-file")],
)
def test_wrong_arguments_end_the_script(launch: Launch, options: list[str], words: str) -> None:
    run = launch(*options)
    assert run.end(20.0) == 1, run.text
    assert words in run.text
    assert "error:" in run.text
    assert run.text.count("\n") == 1, run.text


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--human", "ghost"], "simulated, replay"),
        (["--human", "replay", "--human-file", "/nowhere/run.npz"], "/nowhere/run.npz"),
        (["--human", "replay", "--human-file", __file__], "test_launch.py"),
        (["--human-file", __file__], "--human replay"),
        (["--place", "1,2,3,4"], "--human replay"),
        (["--scenario", "/nowhere/scenario.yaml"], "/nowhere/scenario.yaml"),
        (["--scenario", __file__], "test_launch.py"),
        (["--library", "/nowhere/library.npz"], "/nowhere/library.npz"),
        (["--parameters", "/nowhere/parameters.yaml"], "/nowhere/parameters.yaml"),
        (["--reaches", "0"], "--reaches 0"),
        (["--record", "/proc/nowhere/bag"], "/proc/nowhere/bag"),
    ],
)
def test_wrong_arguments_are_one_clear_line(options: list[str], words: str, tmp_path: Path) -> None:
    """The same command in this process, which takes a hundredth of the time."""
    done = CliRunner().invoke(app, [*options, "--out", str(tmp_path / "run")])
    assert done.exit_code == 1
    text = str(done.exception) if isinstance(done.exception, HriError) else done.output.strip()
    assert words in text
    assert options[0] in text
    assert "\n" not in text
    assert list(tmp_path.iterdir()) == []  # the next try finds the folder as it was


def test_the_bag_has_a_folder_of_its_own(tmp_path: Path) -> None:
    for out, bag in (("run", "run"), ("run/inner", "run")):
        options = ["--out", str(tmp_path / out), "--record", str(tmp_path / bag)]
        done = CliRunner().invoke(app, options)
        assert done.exit_code == 1
        assert "--record" in done.output
        assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("predictor: {period: 7.0}", ["predictor: period = 7.0", "at most 0.04 s"]),
        ("ptomp: {planner.margin: -1.0}", ["ptomp: planner.margin = -1.0", "at least"]),
        ("ptomp: {replan_interval: fast}", ["ptomp: replan_interval = 'fast'", "float"]),
        ("ptomp: {planner.margn: 0.1}", ["'planner.margn'", "planner.margin"]),
        ("simulator: {ramp_down: -2}", ["simulator: ramp_down = -2"]),
        ("recorder: {depth: 1}", ["recorder: depth = 1", "at least 1000"]),
        ("predictr: {period: 0.02}", ["'predictr'", "predictor"]),
        ("simulator: {scenario: x.yaml}", ["give --scenario"]),
        ("predictor: {library: x.npz}", ["give --library"]),
        ("ptomp: {use_sim_time: true}", ["use_sim_time = True", "wall clock"]),
        ("simulator: {realtime_factor: 0.5}", ["realtime_factor = 0.5", "wall clock"]),
        ("simulator: {publish_clock: true}", ["publish_clock = True", "wall clock"]),
        ("[1, 2]", ["node: {parameter: value}"]),
        ("ptomp: 3", ["node: {parameter: value}"]),
    ],
)
def test_parameters_that_do_not_fit_are_refused_before_the_launch(
    text: str, words: list[str], tmp_path: Path
) -> None:
    path = tmp_path / "parameters.yaml"
    path.write_text(text)
    options = ["--parameters", str(path), "--reaches", "1", "--out", str(tmp_path / "run")]
    done = CliRunner().invoke(app, options)
    assert done.exit_code == 1
    for word in [f"--parameters {path}", *words]:
        assert word in done.output, done.output
    assert done.output.count("\n") == 1, done.output
    assert list(tmp_path.iterdir()) == [path]
