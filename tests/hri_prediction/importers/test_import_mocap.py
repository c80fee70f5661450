"""The command: what it shows, asks, refuses and writes, and that what it writes is played back."""

import os
import pty
import re
import shlex
import subprocess
import sys

import numpy as np
import pytest
from mocap_files import ARM, arm_mm, c3d_bytes, trc_text, vicon_text

from hri_prediction.bags.arms import arm_tracks
from hri_prediction.bags.inspect import inspect_bag
from hri_prediction.tracks.files import load_tracks
from hri_prediction.tracks.importers import cli
from hri_prediction.tracks.placement import Placement
from hri_prediction.tracks.seating import SEAT

MAP = "shoulder=RSHO,elbow=RELB,wrist=RWRA+RWRB,hand_tip=RFIN"


@pytest.fixture
def recording(tmp_path):
    points = arm_mm(20)
    points[4:7, 1] = np.nan
    path = tmp_path / "rec one.csv"
    path.write_text(vicon_text(points))
    return path


def run(*words):
    return cli.main([str(word) for word in words])


def test_guess_is_refused_without_a_terminal(recording, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(sys, "stdin", open(os.devnull))  # noqa: SIM115
    out = tmp_path / "a.npz"
    assert run(recording, "--out", out, "--task", "cup", "--trial", 3) == 2
    assert not out.exists()
    shown = capsys.readouterr()
    assert "Plug-in Gait" in shown.out
    assert re.search(r"\? +wrist +RWRA\+RWRB", shown.out)
    assert re.search(r"elbow +85.0 % +1 +0.030 s +0.040 s", shown.out)
    command = shlex.split(shown.err.splitlines()[-1])
    assert command[0] == "scripts/import_mocap.py"
    assert command[-1] == "--yes"
    # The command does it, and needs no guess: it works without the yes as well.
    assert run(*command[1:-1]) == 0
    assert "?" not in capsys.readouterr().out
    (track,) = load_tracks(out)
    assert (len(track), track.side, track.task, track.trial) == (20, "right", "cup", 3)
    assert track.source.startswith("rec one.csv (Vicon CSV): " + MAP)
    np.testing.assert_allclose(track.keypoints[0, 1], [0.02, 0.25, 1.25])
    assert track.valid[:, 1].sum() == 17


@pytest.mark.parametrize(("answers", "code"), [("maybe\nyes\n", 0), ("n\n", 2)])
def test_question_on_a_terminal(recording, tmp_path, answers, code):
    leader, follower = pty.openpty()
    try:
        command = [sys.executable, "-m", "hri_prediction.tracks.importers.cli", str(recording)]
        process = subprocess.Popen(
            [*command, "--out", str(tmp_path / "a.csv")],
            stdin=follower,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        os.write(leader, answers.encode())
        out, err = process.communicate(timeout=60)
    finally:
        os.close(leader)
        os.close(follower)
    assert process.returncode == code, err
    assert (tmp_path / "a.csv").exists() == (code == 0)
    assert out.count("right [yes/no]") == answers.count("\n")
    if code:
        assert "scripts/import_mocap.py" in err


def test_placement_and_resampling(recording, tmp_path):
    out, place = tmp_path / "a.npz", Placement.parse("0.9,0,-1,180")
    assert run(recording, "--out", out, "--yes", "--place", place, "--resample", 200) == 0
    (track,) = load_tracks(out)
    assert track.rate_hz == pytest.approx(200.0)
    np.testing.assert_allclose(track.keypoints[0, 1], place.apply([0.02, 0.25, 1.25]))
    assert run(recording, "--out", out, "--yes", "--place", "auto") == 0
    median = np.median(load_tracks(out)[0].keypoints[:, 0], axis=0)
    np.testing.assert_allclose(median[1:], SEAT[1:], atol=1e-6)


def test_bag_is_whole_and_seated(recording, tmp_path):
    bag = tmp_path / "bag"
    assert run(recording, "--out", bag, "--yes", "--subject", "Ann B.", "--task", "cup") == 0
    report = inspect_bag(bag)
    assert report.closed
    assert report.custom_data["subject"] == "Ann B."
    assert [(t.topic, t.count) for t in report.topics] == [("/humans/bodies/Ann_B/arm", 20)]
    (track,) = arm_tracks(bag)
    assert (len(track), track.side, track.subject) == (20, "right", "Ann_B")
    assert track.rate_hz == pytest.approx(100.0)
    np.testing.assert_allclose(np.median(track.keypoints[:, 0], axis=0)[1:], SEAT[1:], atol=1e-6)
    assert track.valid[:, 1].sum() == 17
    # A second one does not overwrite it.
    assert run(recording, "--out", bag, "--yes") == 2


@pytest.mark.parametrize("out", ["a.npz", "a.csv", "bag"])
def test_result_is_played_back(recording, tmp_path, out):
    playback = pytest.importorskip("hri_sim.recording.playback")
    assert run(recording, "--out", tmp_path / out, "--yes") == 0
    played = playback.load_playback(tmp_path / out)
    assert played.duration_ns == pytest.approx(0.19e9, abs=2e3)
    assert (
        len([item for item in played.items if item.topic.startswith(("humans", "/humans"))]) == 20
    )


@pytest.mark.parametrize(
    ("options", "code", "match"),
    [
        (["--out", "a.mcap"], 2, "expected a name in .npz or .csv, or a folder"),
        (["--out", "rec one.csv"], 2, "is the recording itself"),
        (["--out", "folder.npz"], 2, "is a folder"),
        (["--out", "a.npz", "--place", "1,2"], 2, "placement '1,2'"),
        (["--out", "a.npz", "--map", "shoulder=A,elbow=RELB,wrist=RFIN"], 2, "no marker 'A'"),
        (["--out", "a.npz", "--map", "shoulder=RSHO"], 2, "the mapping has no elbow"),
        (["--out", "a.npz", "--axes", "up"], 2, "--axes up"),
        (["--out", "a.npz", "--units", "ell"], 2, "unit 'ell'"),
        (["--out", "a.npz", "--side", "left"], 1, "no left arm"),
        (["--out", "a.npz", "--units", "m"], 1, "expected upper arm and forearm of 0.15 to 0.6 m"),
        (["--out", "rec one.csv/a.npz"], 2, "cannot make the folder"),
    ],
)
def test_refusals(recording, tmp_path, capsys, monkeypatch, options, code, match):
    (tmp_path / "folder.npz").mkdir()
    monkeypatch.chdir(tmp_path)
    before = recording.read_bytes()
    assert run(recording, "--yes", *options) == code
    error = capsys.readouterr().err
    assert match in error
    assert recording.read_bytes() == before
    if code == 1:
        assert str(recording) in error


def test_wrong_arguments(recording, capsys):
    with pytest.raises(SystemExit) as stop:
        run(recording)
    assert stop.value.code == 2
    assert "--out" in capsys.readouterr().err


@pytest.mark.parametrize("kind", ["c3d", "trc"])
def test_what_the_file_says_needs_no_yes(tmp_path, kind, monkeypatch):
    monkeypatch.setattr(sys, "stdin", open(os.devnull))  # noqa: SIM115
    path = tmp_path / f"a.{kind}"
    if kind == "c3d":
        path.write_bytes(c3d_bytes(arm_mm(), ARM, y_screen="+Z"))
    else:
        path.write_text(trc_text(arm_mm()))
    # A TRC file does not say which way is up.
    assert run(path, "--map", MAP, "--out", tmp_path / "a.npz") == (0 if kind == "c3d" else 2)
    assert run(path, "--map", MAP, "--axes", "z-up", "--out", tmp_path / "a.npz") == 0
