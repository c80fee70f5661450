"""Recordings of other laboratories, on files made here and, where given, on the real ones."""

import os
from pathlib import Path

import numpy as np
import pytest

from hri_prediction.errors import DataError
from hri_prediction.tracks.files import load_tracks
from hri_prediction.tracks.seating import SEAT, suggest_placement
from hri_prediction.tracks.selection import nominal_reaches
from hri_prediction.tracks.track import ArmTrack

JOINTS = ["shoulder", "elbow", "wrist", "hand", "fingertip", "sternum"]
MARKERS = ["Index", "Shoulder", "Back left", "Elbow", "Hand top", "Hand right", "Hand left"]
MARKERS += ["Back right", "Middle"]


def adl_arrays(**changes):
    pos = np.zeros((30, 6, 3), np.float32)
    pos[:, 1, 0], pos[:, 2, 0] = 0.25, 0.5  # beside it: the elbow and the wrist
    pos[:, 4, 1] = 0.4  # the fingertip is in front (+y) of the shoulder
    pos[:, :, 2] = 0.3
    arrays = {
        "pos": pos,
        "joint_names": np.array(JOINTS),
        "start": np.array([0, 10]),
        "length": np.array([10, 20]),
        "onset": np.array([3, 5]),
        "subject": np.array([1, 12]),
        "task": np.array(["F", "A"]),
        "side": np.array(["L", "R"]),
        "trial": np.array([1, 2]),
    }
    arrays.update(changes)
    return {key: value for key, value in arrays.items() if value is not None}


def qtm_text(frames=(690, 691, 693), places=None, markers=MARKERS, rate="60", missing="null"):
    """A QTM export in which marker number i of MARKERS lies at (i, 10 i, 100 i) mm by default."""
    places = places or {}
    head = [f"NO_OF_FRAMES\t{len(frames)}", f"FREQUENCY\t{rate}", "DESCRIPTION\t--"]
    columns = [f"{marker} {axis}" for marker in markers for axis in "XYZ"]
    rows = ["\t".join(["Frame", "Time", *columns]) + "\t"]
    for frame in frames:
        cells = [str(frame), f"{frame / 60:.5f}"]
        for marker in markers:
            index = MARKERS.index(marker)
            place = places.get(marker, (index, 10 * index, 100 * index))
            cells += [missing] * 3 if place is None else [f"{value:.3f}" for value in place]
        rows.append("\t".join(cells))
    return "\n".join(head + rows) + "\n"


def test_adl_trials(tmp_path):
    np.savez(tmp_path / "reach.npz", **adl_arrays())
    first, second = load_tracks(tmp_path / "reach.npz")
    assert (first.subject, first.task, first.side, first.trial) == ("ADL001", "F", "left", 1)
    assert second.subject == "ADL012"
    assert first.time_s[3] == 0.0
    assert first.rate_hz == pytest.approx(100.0)
    assert len(second) == 20
    np.testing.assert_allclose(first.keypoints[0, 3], [0.0, 0.4, 0.3], atol=1e-6)
    placement = suggest_placement(first)
    assert np.degrees(placement.yaw) == pytest.approx(90.0)
    placed = first.transformed(placement)
    np.testing.assert_allclose(placed.keypoints[0, 0], SEAT, atol=1e-6)
    np.testing.assert_allclose(placed.keypoints[0, 3], [0.35, 0.0, 0.4], atol=1e-6)


@pytest.mark.parametrize(
    ("changes", "match"),
    [
        ({"side": None}, "side is missing"),
        ({"joint_names": np.array(["a"] * 6)}, "joint_names"),
        ({"pos": np.zeros((30, 5, 3))}, "pos"),
        ({"side": np.array(["L", "X"])}, "trial 1"),
        ({"onset": np.array([1.0, 2.0])}, "onset"),
        ({"length": np.array([10, 21])}, "trial 1 has rows"),
        ({"task": np.array(["F"])}, "task"),
    ],
)
def test_malformed_adl(tmp_path, changes, match):
    np.savez(tmp_path / "reach.npz", **adl_arrays(**changes))
    with pytest.raises(DataError, match=match):
        load_tracks(tmp_path / "reach.npz")


def test_qtm_by_name_and_frame(tmp_path):
    path = tmp_path / "subject7_run2.txt"
    path.write_text(qtm_text())
    (track,) = load_tracks(path)
    assert (track.subject, track.trial) == ("subject7", 2)
    np.testing.assert_allclose(np.diff(track.time_s), [1 / 60, 2 / 60])
    np.testing.assert_allclose(track.keypoints[0, 0], [0.001, 0.01, 0.1])  # Shoulder, mm to m
    np.testing.assert_allclose(track.keypoints[0, 3], [0.0, 0.0, 0.0])  # Index


def test_qtm_wrist_lies_behind_the_hand(tmp_path):
    places = {"Hand top": (100, 0, 0), "Hand right": (50, 10, 0), "Hand left": (50, -10, 0)}
    (tmp_path / "a.tsv").write_text(qtm_text(places=places))
    (track,) = load_tracks(tmp_path / "a.tsv")
    np.testing.assert_allclose(track.keypoints[0, 2], [0.02, 0.0, 0.0], atol=1e-12)


@pytest.mark.parametrize("missing", ["null", "nan", ""])
def test_qtm_missing_samples(tmp_path, missing):
    (tmp_path / "a.tsv").write_text(qtm_text(places={"Elbow": None}, missing=missing))
    (track,) = load_tracks(tmp_path / "a.tsv")
    assert track.valid[0].tolist() == [True, False, True, True]


def test_qtm_side_and_placement(tmp_path):
    places = {"Back left": (20, 0, 0), "Back right": (0, 0, 0), "Index": (-200, -400, 0)}
    for side, x in (("right", -200), ("left", 200)):
        places["Shoulder"] = (x, 0, 200)
        (tmp_path / "a.tsv").write_text(qtm_text(places=places))
        (track,) = load_tracks(tmp_path / "a.tsv")
        assert track.side == side
    places["Shoulder"] = (-200, 0, 200)
    (tmp_path / "a.tsv").write_text(qtm_text(places=places))
    (track,) = load_tracks(tmp_path / "a.tsv")
    assert np.degrees(suggest_placement(track).yaw) == pytest.approx(-90.0)


@pytest.mark.parametrize(
    ("text", "match"),
    [
        (qtm_text(rate=""), "FREQUENCY"),
        (qtm_text(markers=MARKERS[:3]), "Elbow is missing"),
        (qtm_text(frames=(2, 1)), "strictly increasing"),
        (qtm_text(frames=(2,)), "1 rows"),
        (qtm_text() + "694\t1\n", "2 cells"),
        (qtm_text(missing="?", places={"Elbow": None}), "'\\?'"),
        (qtm_text().replace("Frame", "Bild"), "table header"),
    ],
)
def test_malformed_qtm(tmp_path, text, match):
    (tmp_path / "a.tsv").write_text(text)
    with pytest.raises(DataError, match=match):
        load_tracks(tmp_path / "a.tsv")


def test_placement_needs_a_track_that_is_seen():
    with pytest.raises(DataError, match="no track"):
        suggest_placement([])
    with pytest.raises(DataError, match="never seen"):
        suggest_placement(ArmTrack(np.arange(2.0), np.full((2, 4, 3), np.nan)))


def test_nominal_reaches_leave_out_gaps_and_odd_durations():
    def track(rows, hole=0):
        points = np.zeros((rows, 4, 3))
        points[5 : 5 + hole, 1] = np.nan
        return ArmTrack(np.arange(rows) / 100.0, points, subject="a", task="F")

    groups = nominal_reaches([track(100), track(110, hole=3), track(100, hole=50), track(300)])
    ((condition, chosen),) = groups.items()
    assert condition == ("a", "F", "right")
    assert [len(one) for one in chosen] == [100, 110]
    assert all(one.valid.all() for one in chosen)


@pytest.fixture
def data_dir():
    folder = os.environ.get("HRI_DATA_DIR")
    if not folder:
        pytest.skip("HRI_DATA_DIR is not set")
    return Path(folder)


def test_real_adl_reaches(data_dir):
    tracks = load_tracks(data_dir / "reach_adl_vicon" / "reach.npz")
    assert len(tracks) == 200
    assert {round(np.degrees(suggest_placement(track).yaw)) for track in tracks} == {90}
    assert sum(map(len, nominal_reaches(tracks).values())) == 200


def test_real_qtm_runs(data_dir):
    paths = sorted((data_dir / "pickplace_dfki_qualisys" / "original").glob("*.tsv"))
    assert len(paths) == 15
    for path in paths:
        (track,) = load_tracks(path)
        assert track.side == "right"
        assert round(np.degrees(suggest_placement(track).yaw)) == -90
        limbs = np.linalg.norm(np.diff(track.keypoints, axis=1), axis=-1)
        assert np.all(np.nanmedian(limbs, axis=0) > [0.18, 0.25, 0.15])
        assert np.all(np.nanmedian(limbs, axis=0) < [0.24, 0.32, 0.20])
