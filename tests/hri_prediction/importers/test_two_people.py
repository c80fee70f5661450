"""Two people of one recording: imported beside each other, their movements labelled."""

import csv
from dataclasses import replace

import numpy as np
import pytest
from mocap_files import trc_text

from hri_prediction.bags import BagWriter, TopicInfo
from hri_prediction.bags.arms import arm_tracks
from hri_prediction.ontology import label_command
from hri_prediction.ontology.classifier import InteractionClassifier
from hri_prediction.ontology.label_command import label_bag
from hri_prediction.ontology.shipped import SHIPPED
from hri_prediction.ros.arm_bag import write_arms_bag
from hri_prediction.tracks.files import save_tracks
from hri_prediction.tracks.importers import cli

sessions = pytest.importorskip("hri_sim.ontology.sessions")
pytest.importorskip("hri_msgs.msg")

MAP = "shoulder={0}:RSHO,elbow={0}:RELB,wrist={0}:RWRI,hand_tip={0}:RFIN"
PEOPLE = ("anna", "ben")


@pytest.fixture(scope="module")
def dyad():
    """Two simulated people who reach two times each."""
    study = sessions.DyadStudy(encounters=2)
    return sessions.record_session(sessions.sessions_of(study, 3)[0], study)


@pytest.fixture(scope="module")
def recording(dyad, tmp_path_factory):
    """Both in one TRC file [mm]."""
    points = 1e3 * np.concatenate([track.keypoints for track in dyad], axis=1)
    labels = [f"{who}:{name}" for who in PEOPLE for name in ("RSHO", "RELB", "RWRI", "RFIN")]
    rate = dyad[0].rate_hz
    path = tmp_path_factory.mktemp("dyad") / "dyad.trc"
    path.write_text(trc_text(points, labels, rate=f"{rate:g}", step=1.0 / rate))
    return path


def imported(recording, who, out, *words):
    options = ("--map", MAP.format(who), "--side", "right", "--units", "mm", "--axes", "z-up")
    return cli.main([str(w) for w in (recording, *options, "--out", out, *words)])


@pytest.fixture(scope="module")
def bag(recording):
    first, out = recording.with_name("anna.npz"), recording.with_name("bag")
    assert imported(recording, "anna", first) == 0
    assert imported(recording, "ben", out, "--beside", first, "--place", "0.85,0,0,90") == 0
    return out


def test_both_are_in_one_bag_on_one_clock(bag, dyad):
    tracks = {track.subject: track for track in arm_tracks(bag)}
    assert set(tracks) == set(PEOPLE)
    assert len(tracks["anna"]) == len(tracks["ben"]) == len(dyad[0])
    apart = [
        np.linalg.norm(one.keypoints[:, 2] - other.keypoints[:, 2], axis=1)
        for one, other in (dyad, (tracks["anna"], tracks["ben"]))
    ]
    np.testing.assert_allclose(apart[1], apart[0], atol=1e-5)


def test_movements_are_labelled(bag, tmp_path, capsys):
    labelled = label_bag(bag, InteractionClassifier.load(SHIPPED))
    assert {one.who for one in labelled} == set(PEOPLE)
    assert len(labelled) >= 4
    assert all(1 <= one.number <= 20 and 0.0 < one.probability <= 1.0 for one in labelled)
    out = tmp_path / "labels" / "dyad.csv"
    assert label_command.main([str(bag), "--out", str(out)]) == 0
    said = capsys.readouterr().out
    assert f"of {len(labelled)} movements: case " in said
    assert "told live" not in said
    with out.open() as file:
        rows = list(csv.DictReader(file))
    assert [int(row["case"]) for row in rows] == [one.number for one in labelled]
    assert [row["who"] for row in rows] == [one.who for one in labelled]


def test_what_was_told_live_is_compared(bag, tmp_path, capsys):
    from rclpy.serialization import serialize_message

    from hri_prediction.bags.reader import BagReader
    from hri_prediction.ros.messages import InteractionCase
    from hri_prediction.ros.time import to_time

    labelled = label_bag(bag, InteractionClassifier.load(SHIPPED))
    reader = BagReader(bag)
    with BagWriter(tmp_path / "told") as writer:
        channels = {name: writer.add_topic(info) for name, info in reader.topics.items()}
        for message in reader.messages(set(channels)):
            writer.write(channels[message.topic], message.data, message.log_time_ns)
        topic = writer.add_topic(TopicInfo("/interaction/case", label_command.CASE_TYPE))
        for number, one in enumerate(labelled):
            case = one.number if number else one.number % 20 + 1
            told = InteractionCase(first=one.who, state=InteractionCase.COMPLETE, number=case)
            told.onset, told.end = to_time(one.onset_ns), to_time(one.end_ns)
            writer.write(topic, serialize_message(told), one.end_ns)
            told.state = InteractionCase.RUNNING
            writer.write(topic, serialize_message(told), one.end_ns)
    assert label_command.main([str(tmp_path / "told")]) == 0
    count = len(labelled)
    said = capsys.readouterr().out
    assert f"{count} movements, {count} of which are found here; {count - 1} have the same" in said


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--out", "a.npz", "--beside", "anna.npz", "--place", "none"), "the folder of a new bag"),
        (("--out", "b", "--beside", "anna.npz"), "X,Y,Z,YAW or none"),
        (("--out", "b", "--beside", "anna.npz", "--place", "auto"), "X,Y,Z,YAW or none"),
        (
            ("--out", "b", "--beside", "anna.npz", "--place", "none", "--subject", "anna"),
            "arms of anna, anna; expected those of different people",
        ),
        (("--out", "b", "--beside", "no.npz", "--place", "none"), "no.npz"),
    ],
)
def test_what_does_not_fit_is_said(recording, bag, tmp_path, capsys, words, said):
    folder = recording.parent
    given = [str(folder / w) if w.endswith((".npz", "b")) else w for w in words]
    options = ("--map", MAP.format("ben"), "--side", "right", "--units", "mm", "--axes", "z-up")
    assert cli.main([str(recording), *options, *given]) in (1, 2)
    assert said in capsys.readouterr().err
    assert not (folder / "b").exists()


def test_others_of_another_recording_are_refused(recording, bag, dyad, capsys):
    late = recording.with_name("late.npz")
    save_tracks(late, [replace(dyad[0], time_s=dyad[0].time_s + 3.0, subject="carl")])
    out = recording.with_name("c")
    assert imported(recording, "ben", out, "--beside", late, "--place", "none") == 2
    assert "carl was recorded from 3.00" in capsys.readouterr().err
    assert not out.exists()


def test_others_of_another_length_are_refused(recording, dyad, tmp_path, capsys):
    points = 1e3 * dyad[0].keypoints[:-20]
    labels = [f"carl:{name}" for name in ("RSHO", "RELB", "RWRI", "RFIN")]
    rate = dyad[0].rate_hz
    other = tmp_path / "other.trc"
    other.write_text(trc_text(points, labels, rate=f"{rate:g}", step=1.0 / rate))
    assert imported(other, "carl", tmp_path / "carl.npz") == 0
    out = tmp_path / "c"
    words = ("--beside", tmp_path / "carl.npz", "--place", "none")
    assert imported(recording, "ben", out, *words) == 2
    assert "people of one recording, on one clock" in capsys.readouterr().err
    assert not out.exists()


def test_bags_of_three_ask_for_two(bag, tmp_path, capsys):
    tracks = arm_tracks(bag)
    three = [*tracks, replace(tracks[0], subject="carl")]
    write_arms_bag(tmp_path / "three", three, {})
    assert label_command.main([str(tmp_path / "three")]) == 1
    assert "--bodies ONE,OTHER" in capsys.readouterr().err
    assert label_command.main([str(tmp_path / "three"), "--bodies", "anna,ben"]) == 0
    said = capsys.readouterr().out
    assert "onset [s]" in said
    for given in ("anna", "anna,anna", "anna,ben,carl"):
        assert label_command.main([str(bag), "--bodies", given]) == 1
        assert "two different ids" in capsys.readouterr().err


def test_the_labels_need_two_people(bag, capsys):
    assert label_command.main([str(bag), "--bodies", "anna,carl"]) == 1
    assert "expected anna and carl" in capsys.readouterr().err
    assert label_command.main([str(bag), "--side", "left"]) == 1
    assert "those of two people" in capsys.readouterr().err
    assert label_command.main([str(bag), "--side", "both"]) == 1
    assert "expected right or left" in capsys.readouterr().err
