from __future__ import annotations

import json
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import yaml

rclpy = pytest.importorskip("rclpy")

from rclpy.node import Node  # noqa: E402
from sensor_msgs.msg import JointState  # noqa: E402
from std_msgs.msg import String  # noqa: E402

from hri_msgs.msg import InteractionCase  # noqa: E402
from hri_prediction.bags import BagWriter, TopicInfo, inspect_bag  # noqa: E402
from hri_prediction.bags.metadata import OfferedQos  # noqa: E402
from hri_prediction.errors import ConfigError  # noqa: E402
from hri_prediction.ros.messages import PlannerStatus  # noqa: E402
from hri_sim.testing.domain import own_domain  # noqa: E402
from hri_sim.tools import echo_topic  # noqa: E402
from hri_sim.tools import inspect_bag as inspect_tool  # noqa: E402
from hri_sim.tools.fields import columns, follow, parse_field, to_text  # noqa: E402

DOMAIN = own_domain("bag_tools")


@pytest.fixture
def bag(tmp_path: Path) -> Path:
    with BagWriter(tmp_path / "run", custom_data={"seed": "7"}) as writer:
        channel = writer.add_topic(TopicInfo("/a", "std_msgs/msg/String"))
        for index in range(100):
            writer.write(channel, b"\x00\x01\x00\x00\x01\x00\x00\x00\x00", index * 10**7)
    return tmp_path / "run"


def test_a_whole_bag_is_shown(bag: Path, capsys) -> None:
    assert inspect_tool.main([str(bag)]) == 0
    out = capsys.readouterr().out
    for part in ("closed in order", "/a", "std_msgs/msg/String", "100", "seed", "0.990 s"):
        assert part in out
    assert inspect_tool.main([str(bag), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["messages"] == 100


@pytest.mark.parametrize("width", [80, 100, 250])
def test_the_report_is_not_wider_than_a_page(
    tmp_path: Path, width: int, monkeypatch: pytest.MonkeyPatch, capsys
) -> None:
    """Long names, many topics: the tables stay within the terminal, and within 100 columns."""
    names = ("/joint_trajectory_controller/joint_trajectory", "/humans/bodies/person1/prediction")
    qos = OfferedQos("keep_last", 5, "best_effort", "transient_local")
    with BagWriter(tmp_path / "run", custom_data={"command": "launch_ptomp.py " * 20}) as writer:
        for name in names:
            info = TopicInfo(name, "trajectory_msgs/msg/JointTrajectory", qos=(qos,))
            channel = writer.add_topic(info)
            for index in range(1200):
                writer.write(channel, b"\x00\x01\x00\x00" + bytes(8), index * 10**8, index * 10**8)
    monkeypatch.setenv("COLUMNS", str(width))
    monkeypatch.chdir(tmp_path)
    assert inspect_tool.main(["run"]) == 0
    out = capsys.readouterr().out
    assert max(map(len, out.splitlines())) <= min(width, 100)
    for part in ("[Hz]", "[s]", "later than [ms]", "1,200", "10.0"):
        assert part in out
    for part in (*names, "trajectory_msgs/msg/JointTrajectory", "best_effort, transient_local"):
        assert part in out


def test_a_cut_bag_is_shown_and_salvaged(bag: Path, tmp_path: Path, capsys) -> None:
    file = bag / "run_0.mcap"
    file.write_bytes(file.read_bytes()[:-100])
    assert inspect_tool.main([str(bag)]) == 3
    out = capsys.readouterr().out
    assert "NOT CLOSED" in out
    assert "--salvage" in out
    assert inspect_tool.main([str(bag), "--salvage", str(tmp_path / "new")]) == 0
    out = capsys.readouterr().out
    assert "100 messages of 1 topics" in out
    assert "run_0.mcap was not closed" in out
    assert "closed in order, salvaged from run" in out
    assert inspect_bag(tmp_path / "new").closed


def test_what_can_be_salvaged_and_what_cannot_have_their_exit_codes(
    bag: Path, tmp_path: Path, capsys
) -> None:
    file = bag / "run_0.mcap"
    content = file.read_bytes()
    metadata = (bag / "metadata.yaml").read_text()
    (bag / "metadata.yaml").write_text(metadata[:30])
    assert inspect_tool.main([str(bag)]) == 3
    out = capsys.readouterr().out
    assert "DAMAGED" in out
    assert f"scripts/inspect_bag.py {bag} --salvage {bag}_salvaged" in out
    assert inspect_tool.main([str(bag), "--salvage", str(tmp_path / "new")]) == 0
    (bag / "metadata.yaml").write_text(metadata)
    # Its recorder was killed before the first message: there is nothing to salvage.
    file.write_bytes(content[:60])
    assert inspect_tool.main([str(bag)]) == 1
    said = capsys.readouterr()
    assert "has no message that can be read" in said.out
    assert "--salvage" not in said.out
    assert said.err == f"inspect_bag.py: no message of {bag} can be read\n"
    assert inspect_tool.main([str(bag), "--salvage", str(tmp_path / "nothing")]) == 1
    file.write_bytes(b"")
    assert inspect_tool.main([str(bag)]) == 1
    assert "is no MCAP file" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["missing", "text.mcap", "empty"])
def test_what_is_no_bag_gives_one_line(tmp_path: Path, name: str, capsys) -> None:
    (tmp_path / "empty").mkdir()
    (tmp_path / "text.mcap").write_text("hello, this is some text")
    for extra in ([], ["--salvage", str(tmp_path / "out")]):
        assert inspect_tool.main([str(tmp_path / name), *extra]) == 1
        err = capsys.readouterr().err
        assert err.startswith("inspect_bag.py: ")
        assert err.count("\n") == 1


def test_field_paths() -> None:
    message = JointState(name=["a", "b"], position=[1.0, 2.0])
    assert follow(message, parse_field("position[1]")) == 2.0
    assert follow(message, parse_field("header.stamp.sec")) == 0
    assert follow(message, parse_field("name[-1]")) == "b"
    for text in ("", "a..b", "[x]", "a b"):
        with pytest.raises(ConfigError, match=r"field"):
            parse_field(text)
    with pytest.raises(ConfigError, match=r"one of header, name, position"):
        follow(message, parse_field("positions"))
    with pytest.raises(ConfigError, match=r"2 elements"):
        follow(message, parse_field("position[2]"))


def test_numbers_that_stand_for_nothing() -> None:
    status = PlannerStatus(predicted_clearance=1e9, clearance=0.25, first_contact=-1.0)
    text = to_text(status)
    assert "predicted_clearance: 1000000000.0  # nobody" in text
    assert "\nclearance: 0.25\n" in text
    assert "first_contact: -1.0  # none" in text
    assert yaml.safe_load(text)["predicted_clearance"] == 1e9
    row = columns(status)
    assert (row["predicted_clearance"], row["clearance"], row["first_contact"]) == ("", 0.25, "")
    assert to_text(status.predicted_clearance, "predicted_clearance") == "nobody"
    assert columns(1e9, "clearance") == {"clearance": ""}
    assert to_text(-1.0, "header.x") == "-1.0"


def test_messages_as_text_and_columns() -> None:
    message = JointState(name=["a"], position=np.array([0.5, 1.5]))
    assert "position: [0.5, 1.5]" in to_text(message)
    row = columns(message)
    assert row["position[1]"] == 1.5
    assert row["header.stamp.sec"] == 0
    assert to_text(2.5) == "2.5"


@pytest.fixture
def talker(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Publishes /joint_states (best effort) and /robot_description (latched) meanwhile."""
    from hri_prediction.ros.qos import LATCHED, SENSOR

    monkeypatch.setenv("ROS_DOMAIN_ID", str(DOMAIN))
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=DOMAIN)
    node = Node("talker", context=context)
    joints = node.create_publisher(JointState, "/joint_states", SENSOR)
    node.create_publisher(String, "/robot_description", LATCHED).publish(String(data="<robot/>"))
    stop = threading.Event()

    def talk() -> None:
        count = 0
        while not stop.wait(0.01):
            count += 1
            joints.publish(JointState(name=["a"], position=[float(count)]))

    thread = threading.Thread(target=talk)
    thread.start()
    yield
    stop.set()
    thread.join()
    node.destroy_node()
    rclpy.try_shutdown(context=context)


@pytest.fixture
def silent() -> Iterator[None]:
    """A publisher that says nothing."""
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=DOMAIN)
    node = Node("quiet", context=context)
    node.create_publisher(String, "/silent", 1)
    yield
    node.destroy_node()
    rclpy.try_shutdown(context=context)


def test_echo(talker: None, capfd) -> None:
    assert echo_topic.main(["/joint_states", "--once", "--timeout", "10"]) == 0
    out = capfd.readouterr().out
    assert "name: [a]" in out
    assert out.rstrip().endswith("---")
    # Latched: the QoS of the publisher is taken over.
    options = ["/robot_description", "--once", "--field", "data", "--timeout", "10"]
    assert echo_topic.main(options) == 0
    assert capfd.readouterr().out == "<robot/>\n"
    options = ["/joint_states", "--csv", "--field", "position", "--count", "3", "--timeout", "10"]
    assert echo_topic.main(options) == 0
    header, *rows = capfd.readouterr().out.splitlines()
    assert header == "received_s,position[0]"
    values = [float(row.split(",")[1]) for row in rows]
    assert values == [values[0], values[0] + 1, values[0] + 2]
    never = ["/joint_states", "--only", "name[0]=z", "--once", "--timeout", "1"]
    assert echo_topic.main(never) == 1
    said = capfd.readouterr().err
    assert "no message on /joint_states for 1 s with name[0]=z (" in said
    assert "others, the latest with name[0]=a)" in said
    options = [
        "/joint_states",
        "--only",
        "name[0]=a",
        "--field",
        "name",
        "--once",
        "--timeout",
        "10",
    ]
    assert echo_topic.main(options) == 0
    assert "a" in capfd.readouterr().out
    assert echo_topic.main(["/joint_states", "--hz", "--count", "130", "--timeout", "10"]) == 0
    rate = float(capfd.readouterr().out.split()[0])
    assert 50 < rate < 110


def test_echo_of_some_messages_alone(capfd) -> None:
    shown = echo_topic._Printer(echo_topic._options(["/joint_states", "--only", "name[0]=b"]))
    for name in ("a", "b", "a"):
        shown.show(JointState(name=[name]))
    assert shown.count == 1
    assert "name: [b]" in capfd.readouterr().out
    # By the name of a constant of the message, as its documentation has it.
    shown = echo_topic._Printer(echo_topic._options(["/case", "--only", "state=COMPLETE"]))
    for state in (InteractionCase.RUNNING, InteractionCase.COMPLETE):
        shown.show(InteractionCase(state=state))
    assert (shown.count, shown.others, shown.last_other) == (1, 1, "1")
    for wrong in (["--only", "name"], ["--only", "=a"], ["--only", "a=b", "--hz"]):
        with pytest.raises(SystemExit):
            echo_topic.main(["/joint_states", *wrong])


def test_echo_says_what_it_waits_for(talker: None, capfd) -> None:
    start = time.monotonic()
    assert echo_topic.main(["/joint_state", "--timeout", "4"]) == 1
    assert time.monotonic() - start < 6
    waiting, failed = capfd.readouterr().err.splitlines()
    assert waiting.startswith("waiting for /joint_state: nobody publishes it yet")
    assert waiting.endswith("did you mean /joint_states?")
    assert failed.startswith("echo_topic.py: nobody publishes /joint_state")
    assert echo_topic.main(["/joint_states", "--field", "nothing", "--timeout", "9"]) == 1
    assert "has no field 'nothing'" in capfd.readouterr().err
    assert echo_topic.main(["/joint_states", "--field", "a b"]) == 1
    assert echo_topic.main(["bad topic"]) == 1
    assert "topic 'bad topic': no valid name" in capfd.readouterr().err


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_echo_ends_quietly(talker: None, number: int) -> None:
    process = subprocess.Popen(
        [sys.executable, "-m", "hri_sim.tools.echo_topic", "/joint_states"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        assert process.stdout is not None
        assert "header:" in process.stdout.readline()
        process.send_signal(number)
        _, err = process.communicate(timeout=10)
    finally:
        if process.poll() is None:
            process.kill()
            process.communicate()
    assert process.returncode == 0
    assert err == ""


def test_echo_waits_for_a_silent_publisher(talker: None, silent: None, capfd) -> None:
    assert echo_topic.main(["/silent", "--timeout", "2.3"]) == 1
    waiting, failed = capfd.readouterr().err.splitlines()
    assert waiting == "waiting for /silent: no message yet; its publisher is quiet"
    assert "no message on /silent for 2.3 s" in failed


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--hz", "--once"], "two messages"),
        (["--hz", "--count", "1"], "two messages"),
        (["--hz", "--field", "name"], "--field"),
        (["--count", "-1"], "positive"),
        (["--timeout", "nan"], "seconds"),
    ],
)
def test_echo_refuses_options_that_make_no_sense(options: list[str], words: str, capsys) -> None:
    with pytest.raises(SystemExit) as ended:
        echo_topic.main(["/joint_states", *options])
    assert ended.value.code == 2
    assert words in capsys.readouterr().err


def test_what_there_is_instead() -> None:
    known = ["/rosout", "/parameter_events", "/joint_states"]
    assert echo_topic.what_there_is("/xyz", known[:2]).startswith("no graph is running")
    assert echo_topic.what_there_is("/xyz", known) == "there is /joint_states"
    assert echo_topic.what_there_is("/joint", known) == "did you mean /joint_states?"
    many = [f"/t{index}" for index in range(10)]
    assert echo_topic.what_there_is("/xyz", many).endswith("/t7 and 2 more")


def test_near_names() -> None:
    known = ["/joint_states", "/rosout", "/humans/bodies/person1/arm"]
    assert echo_topic.near_names("/joint_state", known)[0] == "/joint_states"
    assert echo_topic.near_names("/arm", known) == ["/humans/bodies/person1/arm"]
    assert echo_topic.near_names("/xyz", known) == []
