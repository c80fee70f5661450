"""What a library knows of the placement that it was trained with, and what of it matters."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hri_prediction.prediction.cli import train_main
from hri_prediction.prediction.facing import WATCH_S, FacingWatch, facing_warning
from hri_prediction.prediction.library import TaskLibrary
from hri_prediction.prediction.training import train, train_from_files
from hri_prediction.tracks.files import save_tracks
from hri_prediction.tracks.placement import Placement
from hri_prediction.tracks.seating import facing_deg
from hri_prediction.tracks.track import ArmTrack


def _ends(library: TaskLibrary) -> np.ndarray:
    return np.array([task.promp.trajectory_mean([1.0])[0] for task in library.tasks])


def test_only_the_yaw_of_a_placement_matters(tracks: list[ArmTrack]) -> None:
    def trained(place: Placement) -> np.ndarray:
        return _ends(train([track.transformed(place) for track in tracks]).library)

    here = trained(Placement())
    np.testing.assert_allclose(trained(Placement(0.5, -0.3, 0.2)), here, atol=1e-6)
    turned = trained(Placement(yaw=np.radians(20.0)))
    assert np.linalg.norm((turned - here)[:, 3:], axis=1).min() > 0.15


@pytest.mark.parametrize(
    ("place", "facing"),
    [("auto", 180.0), ("none", 180.0), ("1,2,0,-90", 90.0), ("0,0,0,20", -160.0)],
)
def test_the_file_tells_how_people_were_placed(
    tracks: list[ArmTrack], tmp_path: Path, place: str, facing: float
) -> None:
    save_tracks(tmp_path / "reaches.npz", tracks)
    train_from_files([tmp_path / "reaches.npz"], place=place).library.save(tmp_path / "library.npz")
    library = TaskLibrary.load(tmp_path / "library.npz")
    assert (library.place, library.facing_deg) == (place, (facing,))
    assert library.placed == f"trained with --place {place} (people face {facing:g} degrees)"
    # The same placement, or another seat, suits it; a turn does not.
    same = Placement.parse("0,0,0,0" if place in ("auto", "none") else place)
    assert facing_warning(library, facing_deg(tracks[0], same)) == ""
    moved = replace(same, x=9.0, z=-1.0)
    assert facing_warning(library, facing_deg(tracks[0], moved)) == ""
    turned = replace(same, yaw=same.yaw + np.radians(30.0))
    said = facing_warning(library, facing_deg(tracks[0], turned))
    assert f"--place {place}" in said
    assert "along the world's axes" in said
    assert "\n" not in said


def test_laboratories_with_other_axes_suit_each_other(tracks: list[ArmTrack]) -> None:
    library = replace(train(tracks).library, place="auto", facing_deg=(180.0,))
    other = tracks[0].transformed(Placement(yaw=np.radians(90.0)))
    assert facing_warning(library, facing_deg(other, Placement(yaw=np.radians(-90.0)))) == ""
    assert facing_warning(library, facing_deg(other, Placement())) != ""


def test_a_library_that_does_not_tell(library: TaskLibrary, tmp_path: Path) -> None:
    assert library.placed == "trained without --place"
    assert facing_warning(library, 77.0) == ""
    library.save(tmp_path / "library.npz")
    with np.load(tmp_path / "library.npz") as archive:
        arrays = dict(archive)
    header = json.loads(str(arrays.pop("header")))
    del header["place"], header["facing_deg"]  # as in files of before
    np.savez(tmp_path / "library.npz", header=np.array(json.dumps(header)), **arrays)
    assert TaskLibrary.load(tmp_path / "library.npz").facing_deg == ()


@pytest.mark.parametrize("yaw", [0.0, 15.0, 90.0, 180.0])
def test_a_turned_arm_is_noticed_live(
    library: TaskLibrary, tracks: list[ArmTrack], yaw: float
) -> None:
    watch = FacingWatch(library)
    said: list[str] = []
    for number in range(5):  # 2 s each
        placed = tracks[number].transformed(Placement(1.0, 2.0, 0.0, np.radians(yaw)))
        for sample in placed.samples(round((number * 3.0 + 1.0) * 1e9)):
            text = watch.observe([sample])
            if text:
                assert sample.stamp_ns >= round((1.0 + WATCH_S) * 1e9)
                said.append(text)
    assert len(said) == (yaw >= 90.0)
    assert all("YAW" in text for text in said)


def test_training_says_how_people_were_placed(
    tracks: list[ArmTrack], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    save_tracks(tmp_path / "reaches.npz", tracks)
    arguments = [str(tmp_path / "reaches.npz"), "--out", str(tmp_path / "out")]
    assert train_main([*arguments, "--place", "0,0,0,90"]) == 0
    assert "trained with --place 0,0,0,90 (people face -90 degrees)" in capsys.readouterr().out
    results = json.loads((tmp_path / "out" / "results.json").read_text())
    assert (results["place"], results["facing_deg"]) == ("0,0,0,90", [-90.0])
