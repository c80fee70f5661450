"""Recordings that are no arm by their size are refused, with the unit that they seem to be in."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hri_prediction.errors import DataError
from hri_prediction.prediction import training
from hri_prediction.prediction.cli import train_main
from hri_prediction.tracks.files import load_tracks, save_tracks
from hri_prediction.tracks.plausible import check_arm, check_sample
from hri_prediction.tracks.track import ArmSample, ArmTrack

ARM = np.array([[0.0, 0.0, 0.4], [0.0, 0.0, 0.11], [-0.25, 0.0, 0.11], [-0.34, 0.0, 0.11]])


def _track(factor: float = 1.0, arm: np.ndarray = ARM) -> ArmTrack:
    return ArmTrack(np.arange(20) / 100.0, np.tile(factor * arm, (20, 1, 1)))


@pytest.mark.parametrize(
    ("factor", "unit"), [(1000.0, "mm"), (100.0, "cm"), (1.0 / 0.3048, "ft"), (7.0, "")]
)
@pytest.mark.parametrize("name", ["reach.npz", "reach.csv"])
def test_another_unit_is_named(tmp_path: Path, name: str, factor: float, unit: str) -> None:
    save_tracks(tmp_path / name, [_track(factor)])
    with pytest.raises(DataError) as caught:
        load_tracks(tmp_path / name)
    text = str(caught.value)
    assert name in text
    assert f"the upper arm is {0.29 * factor:.4g} m long (median)" in text
    assert "expected upper arm and forearm of 0.15 to 0.6 m" in text
    if unit:
        assert f"look like {unit}:" in text
        assert f"--units {unit}" in text
    else:
        assert "which points" in text


def test_the_trial_is_named(tmp_path: Path) -> None:
    save_tracks(tmp_path / "two.npz", [_track(), _track(1000.0)])
    with pytest.raises(DataError, match=r"two\.npz: trial 1: the upper arm"):
        load_tracks(tmp_path / "two.npz")


def test_outliers_and_what_is_not_seen_do_not_count() -> None:
    points = np.array(_track().keypoints)
    points[:5, 1] += 3.0
    points[5:9, 0] = np.nan
    check_arm(ArmTrack(np.arange(20) / 100.0, points))
    unseen = ARM.copy()
    unseen[0] = np.nan
    check_arm(_track(arm=unseen))
    short = ARM.copy()
    short[2] = short[1] + [0.05, 0.0, 0.0]
    with pytest.raises(DataError, match=r"the forearm is 0\.05 m"):
        check_arm(_track(arm=short))


def test_training_refuses_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    save_tracks(tmp_path / "mm.npz", [_track(1000.0)])
    assert train_main([str(tmp_path / "mm.npz"), "--out", str(tmp_path / "out")]) == 1
    assert "--units mm" in capsys.readouterr().err
    monkeypatch.setattr("hri_prediction.bags.arms.arm_tracks", lambda path: [_track(1000.0)])
    (tmp_path / "bag").mkdir()
    with pytest.raises(DataError, match="upper arm"):
        training.read_tracks(tmp_path / "bag")


def _sample(points: np.ndarray) -> ArmSample:
    return ArmSample(0, points, np.isfinite(points).all(axis=1), "right")


def test_a_single_sample_of_an_arm() -> None:
    arm = np.array([[0.0, 0.0, 0.0], [0.3, 0.0, 0.0], [0.3, 0.26, 0.0], [0.3, 0.35, 0.0]])
    check_sample(_sample(arm), "ann")
    for hidden in range(4):
        seen = arm.copy()
        seen[hidden] = np.nan
        check_sample(_sample(seen), "ann")
    for factor, words in ((1000.0, "upper arm of ann is 300 m"), (0.1, "upper arm of ann is 0.03")):
        with pytest.raises(DataError, match=words):
            check_sample(_sample(factor * arm), "ann")
    far = arm.copy()
    far[0] = np.nan
    far[3] += 90.0
    with pytest.raises(DataError, match=r"right hand of ann is .* m long; expected 0 to 0.3 m"):
        check_sample(_sample(far), "ann")
    far[1] = far[2] = np.nan  # a hand alone
    check_sample(_sample(far), "ann")
