"""An earlier run is drawn from its bag, as the launch drew it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState
from typer.testing import CliRunner

from hri_prediction.bags import BagReader, BagWriter, TopicInfo, salvage
from hri_prediction.errors import DataError
from hri_prediction.ros.conversions import message_from_sample
from hri_prediction.ros.messages import ControllerState, Cue, PlannerStatus, SimState
from hri_prediction.ros.time import NANO, to_time
from hri_prediction.tracks.track import ArmSample
from hri_sim.launch import draw
from hri_sim.launch.run_bags import RunBags
from hri_sim.scenario.schema import save_scenario
from hri_sim.scenario.shipped import load_shipped

BEGIN_NS = 100 * NANO
CUES_S = (0.5, 3.0)
ARRIVAL_S = 1.5
"""From the cue to the end of the way."""


def _write_bag(folder: Path, until_s: float) -> None:
    """The topics that figures come from, at 20 Hz."""
    types = {
        "/sim/state": ("hri_msgs/msg/SimState", SimState),
        "/joint_states": ("sensor_msgs/msg/JointState", JointState),
        "/ptomp/status": ("hri_msgs/msg/PlannerStatus", PlannerStatus),
        "/joint_trajectory_controller/reference": ("hri_msgs/msg/ControllerState", ControllerState),
        "/sim/cue": ("hri_msgs/msg/Cue", Cue),
        "/sim/bodies/person1/arm": ("hri_msgs/msg/HumanArm", None),
    }
    arm = np.array([[0.75, 0.0, 0.4], [0.7, 0.0, 0.12], [0.5, 0.1, 0.1], [0.42, 0.12, 0.1]])
    scenario = load_shipped("table_reach")
    with BagWriter(folder, custom_data={"seed": "7", "planner": "ptomp"}) as writer:
        channels = {n: writer.add_topic(TopicInfo(n, kind)) for n, (kind, _) in types.items()}

        def write(topic: str, message: object, time_ns: int) -> None:
            writer.write(channels[topic], serialize_message(message), time_ns, time_ns)

        for step in range(round(until_s * 20)):
            now_s = step / 20.0
            stamp_ns = BEGIN_NS + round(now_s * NANO)
            moving = any(cue <= now_s <= cue + ARRIVAL_S for cue in CUES_S)
            for number, cue_s in enumerate(CUES_S):
                if abs(cue_s - now_s) < 1e-6:
                    cue = Cue(reach=number, person_target="person_1")
                    cue.header.stamp = to_time(stamp_ns)
                    write("/sim/cue", cue, stamp_ns)
            stage = PlannerStatus.MOVING if moving else PlannerStatus.HOLDING
            for topic, message in {
                "/sim/state": SimState(clearance=0.2),
                "/joint_states": JointState(position=list(scenario.robot_start)),
                "/ptomp/status": PlannerStatus(stage=stage),
                "/joint_trajectory_controller/reference": ControllerState(),
                "/sim/bodies/person1/arm": message_from_sample(
                    ArmSample(stamp_ns, arm, np.ones(4, bool), "right"), "person1"
                ),
            }.items():
                message.header.stamp = to_time(stamp_ns)
                write(topic, message, stamp_ns)


@pytest.fixture
def run(tmp_path: Path) -> Path:
    """Folder of a run whose second reach was broken off."""
    folder = tmp_path / "run"
    folder.mkdir()
    save_scenario(folder / "scenario.yaml", load_shipped("table_reach"))
    _write_bag(folder / "bag", 4.0)
    reaches = [{"outcome": "reached"}, {"outcome": "interrupted"}]
    (folder / "summary.json").write_text(json.dumps({"reaches": reaches}))
    return folder


def test_the_record_of_an_earlier_run(run: Path) -> None:
    earlier = draw.earlier_run(run)
    assert earlier.missing == ("2 of 3 reaches begin in what was recorded",)
    record = earlier.record
    assert record.title == "table_reach · ptomp · seed 7"
    assert [mark.label for mark in record.reaches] == ["reach 1", "reach 2: interrupted"]
    assert [mark.start_s for mark in record.reaches] == pytest.approx(CUES_S)
    assert record.reaches[0].end_s == pytest.approx(CUES_S[0] + ARRIVAL_S, abs=0.051)
    assert record.reaches[1].end_s == pytest.approx(3.95)
    assert np.isfinite(record.arms).all()
    assert record.baseline is not None


def test_without_a_summary_or_a_cue(run: Path) -> None:
    (run / "summary.json").unlink()
    record = draw.earlier_run(run).record
    assert [mark.label for mark in record.reaches] == [
        f"reach {number}: {draw.UNKNOWN}" for number in (1, 2)
    ]
    with BagWriter(run / "cut") as writer:
        reader = BagReader(run / "bag")
        channels = {name: writer.add_topic(info) for name, info in reader.topics.items()}
        for m in reader.messages(set(reader.topics) - {"/sim/cue"}):
            writer.write(channels[m.topic], m.data, m.log_time_ns, m.publish_time_ns)
    assert draw.reports_of(RunBags.of([run / "cut"]), []) == []


def test_a_bag_that_is_not_whole_is_drawn_as_far_as_it_can_be_read(
    run: Path, tmp_path: Path
) -> None:
    file = run / "bag" / "bag_0.mcap"
    content = file.read_bytes()
    file.write_bytes(content[:-2000])
    said = " | ".join(draw.earlier_run(run).missing)
    assert f"{run / 'bag'}: bag_0.mcap was not closed" in said
    assert f"--salvage {run / 'bag_salvaged'}" in said
    salvage(run / "bag", tmp_path / "good")
    file.write_bytes(b"")
    with pytest.raises(DataError, match="no MCAP file"):
        draw.earlier_run(run)
    earlier = draw.earlier_run(run, tmp_path / "good")
    assert len(earlier.record.reaches) == 2
    (line,) = (text for text in earlier.missing if "salvaged" in text)
    assert line.startswith(f"{tmp_path / 'good'} was salvaged from a bag that was not whole: ")


def test_a_run_of_two_bags_is_drawn_from_both(run: Path) -> None:
    parts = {"bag": (0.0, 2.5), "bag_2": (2.8, 9.0), "bag_3": (9.0, 9.0)}
    (run / "whole").mkdir()
    (run / "bag").rename(run / "whole" / "bag")
    reader = BagReader(run / "whole" / "bag")
    for name, (begin_s, end_s) in parts.items():
        with BagWriter(run / name) as writer:
            channels = {topic: writer.add_topic(info) for topic, info in reader.topics.items()}
            spans = [BEGIN_NS + round(time_s * NANO) for time_s in (begin_s, end_s)]
            for m in reader.messages(None, *spans):
                writer.write(channels[m.topic], m.data, m.log_time_ns, m.publish_time_ns)
    (run / "bag_3" / "bag_3_0.mcap").write_bytes(b"")  # its recorder died at once
    summary = json.loads((run / "summary.json").read_text())
    bags = [str(Path("elsewhere") / name) for name in parts]
    (run / "summary.json").write_text(json.dumps(summary | {"bags": bags}))
    earlier = draw.earlier_run(run)
    assert len(earlier.record.reaches) == 2
    assert earlier.record.time_s[-1] == pytest.approx(3.95)
    said = " | ".join(earlier.missing)
    assert "nothing was recorded for 0.35 s between two of its bags" in said
    assert "bag_3_0.mcap is no MCAP file: nothing is taken from that bag" in said
    found = RunBags.of([run / "bag", run / "bag_2"])
    assert found.gaps_ns == ((BEGIN_NS + round(2.45 * NANO), BEGIN_NS + round(2.8 * NANO)),)
    assert found.rates_hz["/sim/state"] == pytest.approx(20.0)


def test_the_command_draws_what_is_asked_for(run: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rendered: list[Path] = []
    monkeypatch.setattr("hri_sim.media.video.render_video", lambda record, to: rendered.append(to))
    done = CliRunner().invoke(draw.app, [str(run)])
    assert done.exit_code == 0, done.output
    told, *files = done.output.splitlines()
    assert told == "2 of 3 reaches begin in what was recorded"
    assert files == ["drawing picture.png", str(run / "picture.png")]
    assert (run / "picture.png").read_bytes()[:4] == b"\x89PNG"
    assert not rendered
    monkeypatch.setattr("hri_sim.media.picture.draw_picture", lambda record, to: None)
    other = run.parent / "elsewhere"
    done = CliRunner().invoke(draw.app, [str(run), "--video", "--out", str(other)])
    assert done.exit_code == 0, done.output
    assert rendered == [other / "video.mp4"]


def test_what_is_no_run_is_one_line(tmp_path: Path, run: Path) -> None:
    for folder, words in ((tmp_path, "holds no bag"), (run / "bag", "the folder of a run")):
        done = CliRunner().invoke(draw.app, [str(folder)])
        assert done.exit_code == 1
        assert done.output.startswith("error: ")
        assert words in done.output
        assert done.output.count("\n") == 1
    (run / "summary.json").write_text("[]")
    done = CliRunner().invoke(draw.app, [str(run)])
    assert "holds no reaches" in done.output
