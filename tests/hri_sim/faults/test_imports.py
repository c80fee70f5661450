"""What the line of malformed recordings damages is imported as it is; what it counts is counted."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hri_prediction.tracks.importers.recognise import read_markers
from hri_sim.faults.exports import EXPORTS, FRAMES, RATE_HZ
from hri_sim.faults.imports import KEYS, Import, _begins_as, _count, no_recordings, run_import

ERROR = "import_mocap.py: folder/recording.trc: it is bad; expected a good one\n"


@pytest.mark.parametrize("ending", EXPORTS)
def test_an_export_is_read_with_its_lengths(ending: str, tmp_path: Path) -> None:
    path = tmp_path / f"recording.{ending}"
    path.write_bytes(EXPORTS[ending](np.random.default_rng(0), 1.0))
    data = read_markers(path)
    assert (len(data), data.rate_hz) == (FRAMES, pytest.approx(RATE_HZ))
    found = run_import(path, tmp_path / "out" / "track.npz")
    assert found.code == 0, found.said
    assert found.keypoints is not None
    upper_arm = np.linalg.norm(found.keypoints[0, 1] - found.keypoints[0, 0])
    assert 0.2 < upper_arm < 0.4


def test_another_unit_is_ten_times_as_long() -> None:
    one, ten = (EXPORTS["tsv"](np.random.default_rng(0), scale).decode() for scale in (1.0, 10.0))
    first, longer = (float(text.splitlines()[7].split("\t")[4]) for text in (one, ten))
    assert longer == pytest.approx(10.0 * first)


def test_no_recording_is_one(tmp_path: Path) -> None:
    """An ending alone makes no recording; only C3D goes by it, so that texts are none under it."""
    for ending in ("c3d", "trc"):
        found = no_recordings(np.random.default_rng(0), ending, tmp_path / ending)
        assert len(found) == (13 if ending == "c3d" else 9)


def test_what_is_kept_and_what_is_overwritten(tmp_path: Path) -> None:
    path = tmp_path / "recording.csv"
    path.write_bytes(b"nothing\n")
    refused = run_import(path, tmp_path / "out" / "track.npz")
    assert refused.code == 1
    assert refused.kept
    assert refused.told
    assert refused.refused("recording.csv")
    assert not refused.refused("another.csv")


@pytest.mark.parametrize(
    ("came", "damage", "counted"),
    [
        (Import(1, ERROR, True), "cut", {"refused"}),
        (Import(1, ERROR, False), "cut", {"refused", "left_behind"}),
        (Import(1, ERROR.partition(";")[0], True), "kind", {"refused", "untold"}),
        (Import(1, "Traceback\nValueError: recording.trc\n", True), "cut", {"other_errors"}),
        (Import(-11, "", True), "flipped", {"other_errors"}),
        (Import(None, "", False), "flipped", {"other_errors", "left_behind"}),
        (Import(0, "", False), "unit", {"other_errors", "left_behind"}),
        (Import(0, "", False, np.ones((5, 4, 3))), "unit", {"taken"}),
        (Import(0, "", False, np.ones((5, 4, 3))), "kind", {"taken"}),
        (Import(0, "", False, np.ones((4, 4, 3))), "cut", set()),
        (Import(0, "", False, 2.0 * np.ones((4, 4, 3))), "cut", {"altered"}),
        (Import(0, "", False, np.ones((5, 4, 3))), "flipped", set()),
        (Import(0, "", False, 2.0 * np.ones((5, 4, 3))), "flipped", {"unnoticed"}),
    ],
)
def test_what_is_counted(came: Import, damage: str, counted: set[str]) -> None:
    counts = dict.fromkeys(KEYS, 0.0)
    _count(counts, came, damage, "recording.trc", np.ones((5, 4, 3)))
    assert {key for key, count in counts.items() if count} == counted


def test_the_last_number_of_a_text_may_be_cut() -> None:
    whole = np.arange(60.0).reshape(5, 4, 3)
    last_is_cut = whole[:3].copy()
    last_is_cut[-1, -1, -1] = 3.0
    assert _begins_as(last_is_cut, whole)
    assert not _begins_as(whole[1:], whole)
