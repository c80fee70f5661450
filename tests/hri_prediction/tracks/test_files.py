"""Files of arm tracks: round trips, foreign formats, malformed files."""

import zipfile

import numpy as np
import pytest

from hri_prediction.errors import DataError
from hri_prediction.tracks.files import CSV_COLUMNS, load_tracks, save_tracks
from hri_prediction.tracks.track import ArmTrack

ARM = np.array([[0.0, 0.0, 0.4], [0.0, 0.0, 0.11], [-0.25, 0.0, 0.11], [-0.34, 0.0, 0.11]])


def make_track(rows=5, **values):
    points = ARM + np.random.default_rng(rows).normal(scale=0.02, size=(rows, 4, 3))
    points[1, 2] = np.nan
    return ArmTrack(np.arange(rows) / 100.0, points, **values)


def arrays_of(tmp_path, **changes):
    path = tmp_path / "good.npz"
    save_tracks(path, [make_track(), make_track(7)])
    with np.load(path) as archive:
        arrays = dict(archive)
    arrays.update(changes)
    return {key: value for key, value in arrays.items() if value is not None}


def test_npz_round_trip_is_exact(tmp_path):
    tracks = [
        make_track(side="left", subject="ann", task="cup", trial=3, source="s"),
        make_track(9),
    ]
    save_tracks(tmp_path / "tracks.npz", tracks)
    for old, new in zip(tracks, load_tracks(tmp_path / "tracks.npz"), strict=True):
        np.testing.assert_array_equal(old.time_s, new.time_s)
        np.testing.assert_array_equal(old.keypoints, new.keypoints)
        assert (old.side, old.subject, old.task, old.trial, old.source) == (
            (new.side, new.subject, new.task, new.trial, new.source)
        )


def test_csv_round_trip_and_detection_by_content(tmp_path):
    track = make_track(side="left", subject="ann lee", trial=2)
    save_tracks(tmp_path / "track.csv", [track])
    odd = tmp_path / "track.npz"  # a wrong name does not matter
    odd.write_bytes((tmp_path / "track.csv").read_bytes())
    new = load_tracks(odd)[0]
    np.testing.assert_allclose(new.keypoints, track.keypoints, atol=1e-6)
    assert (new.side, new.subject, new.trial) == ("left", "ann lee", 2)
    assert not new.valid[1, 2]


@pytest.mark.parametrize(
    ("changes", "match"),
    [
        ({"keypoints": None}, "keypoints is missing"),
        ({"schema": np.array("hri_arm_tracks/9")}, "schema"),
        ({"keypoints": np.zeros((12, 3, 3))}, "keypoints"),
        ({"time_s": np.zeros(12)}, "trial 0.*strictly increasing"),
        ({"time_s": np.zeros((12, 1))}, "time_s"),
        ({"length": np.array([5, 8])}, "trial 1 has rows"),
        ({"start": np.array([-1, 5])}, "trial 0 has rows"),
        ({"length": np.array([5.0, 7.0])}, "integers"),
        ({"start": np.array([], int), "length": np.array([], int)}, "no trial"),
        ({"side": np.array(["left", "up"])}, "trial 1.*up"),
        ({"side": np.array(["left"])}, "side"),
        ({"trial": np.array(["a", "b"])}, "trial"),
        (
            {"start": np.zeros(50, int), "length": np.full(50, 12)},
            "50 trials have 600 rows together",
        ),
    ],
)
def test_malformed_npz(tmp_path, changes, match):
    path = tmp_path / "bad.npz"
    np.savez(path, **arrays_of(tmp_path, **changes))
    with pytest.raises(DataError, match=match) as caught:
        load_tracks(path)
    assert "bad.npz" in str(caught.value)


def test_objects_in_npz_are_never_unpickled(tmp_path):
    path = tmp_path / "objects.npz"
    np.savez(path, schema=np.array([{"a": 1}], dtype=object))
    with pytest.raises(DataError, match="plain arrays"):
        load_tracks(path)


def test_truncated_and_foreign_archives(tmp_path):
    good = tmp_path / "good.npz"
    save_tracks(good, [make_track()])
    cut = tmp_path / "cut.npz"
    cut.write_bytes(good.read_bytes()[:200])
    with pytest.raises(DataError, match=r"whole \.npz"):
        load_tracks(cut)
    archive = tmp_path / "some.zip"
    with zipfile.ZipFile(archive, "w") as out:
        out.writestr("a.txt", "hello")
    with pytest.raises(DataError):
        load_tracks(archive)
    with pytest.raises(DataError, match="cannot read"):
        load_tracks(tmp_path / "absent.npz")


HEADER = ",".join(CSV_COLUMNS)
ROW = ",".join(["0.1"] * 12)


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("", "no table"),
        ("# side: left\n", "no table"),
        ("hello\nworld\n", "hello"),
        (f"{HEADER}\n", "0 rows"),
        (f"{HEADER}\n0.0,{ROW}\n", "1 rows"),
        (f"{HEADER}\n0.0,{ROW}\n0.0,{ROW}\n", "strictly increasing"),
        (f"{HEADER}\n0.0,{ROW}\n,{ROW}\n", "finite times"),
        (f"{HEADER}\n0.0,{ROW}\n0.1,{ROW},1\n", "line 3 has 14 cells"),
        (f"{HEADER}\n0.0,{ROW}\n0.1,x{ROW}\n", "line 3 holds 'x0.1'"),
        (f"{HEADER}\n0.0,{ROW}\n0.1,inf{ROW[3:]}\n", "finite number"),
        (f"{HEADER.replace('wrist_y', 'w')}\n0.0,{ROW}\n", "wrist_y is missing"),
        (f"# side: up\n{HEADER}\n0.0,{ROW}\n0.1,{ROW}\n", "side"),
        (f"# trial: two\n{HEADER}\n0.0,{ROW}\n0.1,{ROW}\n", "trial"),
        (f"# trial: ²\n{HEADER}\n0.0,{ROW}\n0.1,{ROW}\n", "trial: '²'; expected a whole number"),
        (f"# trial: --3\n{HEADER}\n0.0,{ROW}\n0.1,{ROW}\n", "trial: '--3'"),
        (f'{HEADER}\n0.0,{ROW}\n0.1,"{ROW * 4000}\n', "line 3 is no CSV: field larger"),
    ],
)
def test_malformed_csv(tmp_path, text, match):
    path = tmp_path / "bad.csv"
    path.write_text(text)
    with pytest.raises(DataError, match=match):
        load_tracks(path)


def test_binary_rubbish(tmp_path):
    path = tmp_path / "rubbish.npz"
    path.write_bytes(bytes(range(256)))
    with pytest.raises(DataError, match="neither"):
        load_tracks(path)


def test_saving_refuses_what_cannot_be_kept(tmp_path):
    with pytest.raises(DataError, match="no tracks"):
        save_tracks(tmp_path / "a.npz", [])
    with pytest.raises(DataError, match="one track"):
        save_tracks(tmp_path / "a.csv", [make_track(), make_track()])
    with pytest.raises(DataError, match=r"\.npz or \.csv"):
        save_tracks(tmp_path / "a.txt", [make_track()])
    with pytest.raises(DataError, match="cannot write"):
        save_tracks(tmp_path / "no" / "a.npz", [make_track()])


@pytest.mark.parametrize("name", ["a.npz", "a.csv"])
def test_what_was_saved_before_is_kept_until_the_new_is_whole(tmp_path, monkeypatch, name):
    path = tmp_path / name
    save_tracks(path, [make_track()])
    before = path.read_bytes()

    def full(part, *_, **__):
        with open(part, "wb") as file:
            file.write(b"half")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(np, "savez", full)
    monkeypatch.setattr(type(path), "write_text", full)
    with pytest.raises(DataError, match="No space left"):
        save_tracks(path, [make_track()])
    assert path.read_bytes() == before
    assert [one.name for one in tmp_path.iterdir()] == [name]
