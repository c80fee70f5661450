"""The track files that docs/recordings.md shows are read as it says."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from hri_prediction.tracks.files import CSV_COLUMNS, SCHEMA, load_tracks, save_tracks
from hri_prediction.tracks.track import ArmTrack

TEXT = (Path(__file__).resolve().parents[2] / "docs" / "recordings.md").read_text()
PYTHON, *_ = re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL)
(CSV,) = re.findall(r"```csv\n(.*?)```", TEXT, re.DOTALL)


def test_the_csv_example(tmp_path: Path) -> None:
    (tmp_path / "reach.csv").write_text(CSV)
    (track,) = load_tracks(tmp_path / "reach.csv")
    assert (track.side, track.subject, track.task, track.trial) == ("left", "ann", "cup", 3)
    assert track.source == "reach.csv"
    np.testing.assert_allclose(track.time_s, [0.0, 0.01, 0.02])
    np.testing.assert_allclose(track.keypoints[2, 1], [0.051, 0.0, 0.122])
    np.testing.assert_array_equal(track.valid[:, 3], [True, False, True])
    assert f"All {len(CSV_COLUMNS)} columns" in TEXT.replace("\n", " ")


def test_the_npz_example(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    exec(PYTHON, {})
    (track,) = load_tracks(tmp_path / "reach.npz")
    assert (track.side, track.subject, track.task, track.trial) == ("right", "ann", "cup", 0)
    assert len(track) == 150
    assert np.flatnonzero(~track.valid[:, 3]).tolist() == list(range(40, 45))


def test_the_table_names_every_array(tmp_path: Path) -> None:
    keypoints = np.tile([[0, 0, 0.4], [0, 0, 0.1], [0.25, 0, 0.1], [0.34, 0, 0.1]], (2, 1, 1))
    save_tracks(tmp_path / "a.npz", [ArmTrack(np.array([0.0, 0.01]), keypoints)])
    with np.load(tmp_path / "a.npz") as archive:
        rows = dict(re.findall(r"^\| `(\w+)` \|.*\| (yes|no: \w+) \|.*\|$", TEXT, re.MULTILINE))
        assert list(rows) == archive.files
        assert SCHEMA in TEXT
        arrays = dict(archive)
    for name, must in rows.items():
        np.savez(tmp_path / "b.npz", **{k: v for k, v in arrays.items() if k != name})
        if must == "yes":
            with pytest.raises(Exception, match=f"{name}"):
                load_tracks(tmp_path / "b.npz")
        else:
            assert str(getattr(load_tracks(tmp_path / "b.npz")[0], name)) in ("", "0")
