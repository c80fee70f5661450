"""What of the nodes' health a run's user hears, and what is said of its recording at the end."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import pytest
from diagnostic_msgs.msg import DiagnosticStatus, KeyValue

from hri_prediction.bags import BagWriter, TopicInfo
from hri_prediction.ros.node import ERROR, OK, STANDSTILL, WARN
from hri_sim.launch.health import AGAIN_S, SILENT_S, GraphHealth
from hri_sim.launch.recording_end import recording_words
from hri_sim.launch.supervisor import Death
from hri_sim.recording.folders import bag_folders
from hri_sim.simulator.stopchain import NO_HEARTBEAT


def status(
    name: str, text: str = "running", level: bytes = OK, **values: object
) -> DiagnosticStatus:
    items = [KeyValue(key=key, value=str(value)) for key, value in values.items()]
    return DiagnosticStatus(hardware_id=name, message=text, level=level, values=items)


@pytest.fixture
def told() -> list[str]:
    return []


@pytest.fixture
def health(told: list[str]) -> GraphHealth:
    return GraphHealth(told.append)


def test_a_recorder_that_loses_messages_is_heard_of_at_once(
    health: GraphHealth, told: list[str]
) -> None:
    health.take([status("recorder", "recording", troubles="")], 0.0, begun=True)
    assert told == []
    behind = status("recorder", "behind: 70 % full", WARN, troubles="behind")
    health.take([behind], 0.0, begun=True)
    health.take([behind], 0.0, begun=True)
    assert told == ["recorder: behind: 70 % full"]
    # Another kind of trouble is news, more of the same is not.
    for dropped in (3, 500):
        text = f"{dropped} messages dropped"
        health.take([status("recorder", text, ERROR, troubles="queue behind")], 0.0, begun=True)
    assert told[1:] == ["recorder: 3 messages dropped"]
    # What comes and goes is told now and then.
    well = status("recorder", "recording", troubles="")
    for tenth in range(round(20 * AGAIN_S)):
        health.take([behind if tenth % 2 else well], tenth / 10, begun=True)
    assert told[2:] == ["recorder: behind: 70 % full"]


def test_nodes_that_stand_still_are_named_once(health: GraphHealth, told: list[str]) -> None:
    text = f"this node {STANDSTILL} 0.40 s"
    health.take([status("ptomp", text, WARN)], 0.0, begun=False)
    assert told == []
    for _ in range(2):
        health.take([status("ptomp", text, WARN), status("person", text, WARN)], 0.0, begun=True)
    assert told == [f"ptomp: {text}", f"person: {text}"]


def look(health: GraphHealth, begin_s: float, end_s: float, step_s: float = 0.02) -> None:
    for step in range(round((end_s - begin_s) / step_s)):
        health.look(begin_s + step * step_s, ["recorder", "person"])


def test_a_recorder_that_falls_silent(health: GraphHealth, told: list[str]) -> None:
    look(health, 0.0, 10.0)  # not heard of yet
    for second in range(10, 20):
        health.take([status("recorder", "recording")], 0.0, begun=True)
        look(health, second, second + 1.0)
    assert told == []
    look(health, 20.0, 20.0 + 2 * SILENT_S)
    assert told == ["recorder has said nothing for 3 s: it may be recording nothing"]
    health.take([status("recorder", "recording")], 0.0, begun=True)
    look(health, 30.0, 30.0 + 2 * SILENT_S)
    assert len(told) == 2


def test_an_adaptation_node_that_hangs(health: GraphHealth, told: list[str]) -> None:
    health.take([status("adaptation"), status("policy")], 0.0, begun=True)
    for step in range(500):
        health.look(step * 0.02, ["adaptation", "policy"])
    assert sorted(told) == [
        "adaptation has said nothing for 3 s: no trial goes on meanwhile",
        "policy has said nothing for 3 s: it hangs, or the machine does not run it",
    ]


def test_a_heartbeat_that_the_controller_misses_is_told_with_whose_it_is(
    health: GraphHealth, told: list[str]
) -> None:
    resting = status("simulator", NO_HEARTBEAT, WARN)
    health.take([resting], 0.0, begun=False)  # nobody sends it yet
    assert told == []
    health.take([resting], 0.0, begun=True)
    health.take([resting], AGAIN_S / 2, begun=True)
    assert told == [
        "the controller hears no heartbeat of the node that moves the robot "
        "(/separation/speed_scale): the robot rests because of it"
    ]
    health.take([status("separation_monitor"), resting], 2 * AGAIN_S, begun=True)
    assert "heartbeat of separation_monitor (" in told[1]


def test_who_was_not_run_itself_has_not_listened(health: GraphHealth, told: list[str]) -> None:
    health.take([status("recorder", "recording")], 0.0, begun=True)
    look(health, 0.0, 1.0)
    look(health, 60.0, 61.0)
    assert told == []


def test_a_recorder_that_has_ended_is_not_called_silent(
    health: GraphHealth, told: list[str]
) -> None:
    health.take([status("recorder", "recording")], 0.0, begun=True)
    for step in range(1000):
        health.look(step * 0.02, ["person"])
    assert told == []


def test_who_is_not_ready(health: GraphHealth) -> None:
    names = ["person", "ptomp", "recorder"]
    assert health.missing(names, ["/a"], patient=True) == set(names)
    health.take(
        [status("person"), status("ptomp", level=WARN), status("recorder")], 0.0, begun=False
    )
    assert health.missing(names, ["/a"], patient=True) == {"ptomp", "recorder"}
    assert health.missing(names, ["/a"], patient=False) == set()
    health.take([status("recorder", **{"received /a": 4})], 0.0, begun=False)
    assert health.missing(names, ["/a"], patient=True) == {"ptomp"}


@pytest.mark.parametrize(
    ("level", "troubles", "received", "waited_for"),
    [
        (WARN, "transport", 4, False),  # that is never over
        (WARN, "transport", 0, True),
        (WARN, "behind transport", 4, True),
        (WARN, "", 4, True),
        (ERROR, "transport", 4, True),
    ],
)
def test_a_recorder_that_has_lost_messages_on_the_way_is_not_waited_for(
    health: GraphHealth, level: bytes, troubles: str, received: int, waited_for: bool
) -> None:
    values = {"troubles": troubles, "received /a": received}
    health.take([status("recorder", "8 messages lost", level, **values)], 0.0, begun=True)
    assert bool(health.missing(["recorder"], ["/a"], patient=True)) == waited_for


# ------------------------------------------------------------------ the end
UNTIL_NS = 100 * 10**9


def ended(code: int | None, *, died: bool = False) -> SimpleNamespace:
    return SimpleNamespace(
        exit_code=lambda label: code,
        died=lambda label: died,
        last_words=lambda label, lines: ("recorder: 7 messages could not be written",),
    )


def test_the_end_of_a_recording(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    bag = Path("runs/bag")

    def words(supervisor: SimpleNamespace, killed: list[str]) -> str:
        return " | ".join(recording_words(supervisor, killed, bag, UNTIL_NS))

    assert words(ended(None), []) == ""  # there is none
    assert words(ended(0), []) == ""
    assert words(ended(1), []) == (
        "recorder: 7 messages could not be written | runs/bag does not hold all that was sent"
    )
    assert words(ended(1, died=True), []) == "runs/bag does not hold all that was sent"
    bag.mkdir(parents=True)
    (bag / "bag_0.mcap").write_bytes(b"\x89MCAP0\r\n")
    salvage = "scripts/inspect_bag.py runs/bag --salvage runs/bag_salvaged"
    assert f"not closed; {salvage}" in words(ended(1), [])
    said = words(ended(-9), ["person", "recorder"])
    assert said.startswith("runs/bag was not closed, and holds no message that can be read; ")
    assert salvage in said


@pytest.mark.parametrize(
    ("last_s", "said"),
    [
        (37.5, "has no message of the last 62.5 s of the run"),  # it stood still since then
        (100.2, "holds messages up to the end of the run; "),
    ],
)
def test_what_is_missing_from_a_bag_that_was_not_closed(
    tmp_path: Path, last_s: float, said: str
) -> None:
    with BagWriter(tmp_path / "bag") as writer:
        channel = writer.add_topic(TopicInfo("/a", "std_msgs/msg/Empty"))
        writer.write(channel, b"\x00\x01\x00\x00\x00", round(last_s * 1e9))
    file = tmp_path / "bag" / "bag_0.mcap"
    file.write_bytes(file.read_bytes()[:-8])
    for supervisor, killed in ((ended(-9, died=True), []), (ended(-9), ["recorder"])):
        (line,) = recording_words(supervisor, killed, tmp_path / "bag", UNTIL_NS)
        assert f"was not closed, and {said}" in line


def test_a_recorder_that_was_started_again_leaves_several_bags(tmp_path: Path) -> None:
    bag = tmp_path / "bag"
    for name in ("bag", "bag_2", "bag_10", "bag_old"):
        (tmp_path / name).mkdir()
    assert bag_folders(bag) == [bag, tmp_path / "bag_2", tmp_path / "bag_10"]
    (bag / "bag_0.mcap").write_bytes(b"\x89MCAP0\r\n")  # its recorder was killed
    said = recording_words(ended(0, died=True), [], bag, UNTIL_NS)
    assert "bag, bag_2, bag_10" in said[0]
    assert "summary and picture are of all of them together" in said[0]
    assert said[1].startswith(f"{bag} was not closed")
    assert "--salvage" in said[1]
    assert len(said) == 2
    said = recording_words(ended(-9, died=True), [], bag, UNTIL_NS)
    assert said[2].startswith(f"{tmp_path / 'bag_10'} was not closed")


def test_last_words_tell_the_cause_of_an_end_by_error_alone() -> None:
    assert Death("recorder", 1, ("ready", "recorder: no space")).cause == "recorder: no space"
    assert Death("recorder", -9, ("ready",)).cause == ""
    assert Death("recorder", 1, ()).cause == ""


def test_an_answer_that_did_not_count_is_told_once(health: GraphHealth, told: list[str]) -> None:
    late = status("adaptation", "running", WARN, **{"fault guess": "no trial is on"})
    health.take([late], 0.0, begun=True)
    health.take([late], 1.0, begun=True)
    assert told == ["adaptation: no trial is on"]
    health.take([status("adaptation"), late], 6.0, begun=True)
    assert told[1:] == ["adaptation: no trial is on"]


@pytest.mark.parametrize(
    ("text", "controller", "holds"),
    [
        ("stopped: no plan", "stopping", True),
        ("the robot touches a person", "stopping", True),
        ("tracking", "tracking", False),
        ("the robot touches a person", "idle", True),
        ("the robot touches a person; this node was not run for 0.50 s", "idle", False),
        (f"{NO_HEARTBEAT}; stopped: no plan", "stopping", False),
    ],
)
def test_a_simulator_that_holds_a_motion_that_was_broken_off_is_told_from_one_that_is_not_well(
    health: GraphHealth, text: str, controller: str, holds: bool
) -> None:
    assert not health.holds
    health.take([status("simulator", text, WARN, controller=controller)], 0.0, begun=True)
    assert health.holds is holds
