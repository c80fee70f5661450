"""Reaches at any rate from 20 Hz on; below, files are refused and live predictions say why."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hri_prediction.errors import DataError
from hri_prediction.prediction import ReachPredictor
from hri_prediction.prediction.training import train
from hri_prediction.tracks.bell import peak_speed
from hri_prediction.tracks.files import load_tracks, save_tracks
from hri_prediction.tracks.importers import cli
from hri_prediction.tracks.rate import SamplePeriod, check_rate, too_slow, window_s
from hri_prediction.tracks.segmentation import ReachSegmenter, SegmentationConfig, find_reaches
from hri_prediction.tracks.track import ArmTrack

DURATION_S = 0.9


def reach(rate: float, phase: float = 0.0, seed: int = 0) -> ArmTrack:
    """A reach of 0.9 s from 1 s on, sampled from ``phase`` periods on, with 0.3 mm of noise."""
    times = (np.arange(0.0, 3.0 * rate) + phase) / rate
    tau = np.clip((times - 1.0) / DURATION_S, 0.0, 1.0)
    way = 0.35 * tau**3 * (10.0 - 15.0 * tau + 6.0 * tau**2)
    keypoints = np.array([[0.0, 0.0, 0.4], [0.0, 0.0, 0.1], [0.25, 0.0, 0.1], [0.34, 0.0, 0.1]])
    keypoints = np.tile(keypoints, (times.size, 1, 1))
    keypoints[:, :, 1] += way[:, None]  # the trunk goes along: the arm stays as long
    keypoints += 0.0003 * np.random.default_rng(seed).standard_normal(keypoints.shape)
    return ArmTrack(times, keypoints, subject="s", task="cup")


@settings(max_examples=60, deadline=None)
@given(st.floats(24.0, 250.0), st.floats(0.0, 1.0), st.integers(0, 99))
def test_a_reach_is_found_at_every_rate(rate, phase, seed):
    track = reach(rate, phase, seed)
    (found,) = find_reaches(track.time_s, track.keypoints[:, 2])
    # The speed passes 0.04 m/s some 60 ms after the start.
    assert found.onset_s == pytest.approx(1.06, abs=0.1)
    assert found.end_s == pytest.approx(0.94 + DURATION_S, abs=0.12)
    peak = peak_speed(track, found, SegmentationConfig())
    assert peak == pytest.approx(1.875 * 0.35 / DURATION_S, rel=0.15)


@pytest.mark.parametrize("rate", [20.0, 24.0, 25.0, 29.97])
def test_the_live_prediction_notices_reaches_at_the_rates_of_video(rate):
    predictor = ReachPredictor()
    states = set()
    for sample in reach(rate).samples(10**18):
        predictor.observe(sample)
        prediction = predictor.predict()
        states.add(prediction.state.name)
        assert prediction.reason == ""
    assert states == {"IDLE", "REACHING"}


@pytest.mark.parametrize("rate", [8.0, 12.0, 18.0])
def test_below_it_the_live_prediction_names_the_rate(rate):
    predictor = ReachPredictor()
    for sample in reach(rate).samples(10**18):
        predictor.observe(sample)
    expected = f"samples come at {rate:.3g} Hz, too seldom to find reaches"
    assert predictor.predict().reason == expected


def test_below_it_files_are_refused_with_their_rate(tmp_path, capsys):
    slow = reach(15.0)
    save_tracks(tmp_path / "slow.npz", [slow])
    with pytest.raises(DataError, match=r"slow.npz: samples come at 15 Hz, .*20 Hz or more"):
        load_tracks(tmp_path / "slow.npz")
    with pytest.raises(DataError, match=r"cup trial 0: samples come at 15 Hz"):
        train([reach(60.0), slow])


def test_the_import_refuses_what_training_would(tmp_path, capsys):
    names = ["RSHO", "RELB", "RWRA"]
    lines = [
        "PathFileType\t4\t(X/Y/Z)\tslow.trc",
        "DataRate\tNumFrames\tNumMarkers\tUnits",
        "{rate}\t60\t3\tm",
        "Frame#\tTime\t" + "\t\t\t".join(names),
        "\t\t" + "\t".join(f"{axis}{n}" for n in (1, 2, 3) for axis in "XYZ"),
    ]
    track = reach(20.0)
    for row, points in enumerate(track.keypoints[:, :3]):
        cells = "\t".join(f"{value:.4f}" for value in points.ravel())
        lines.append(f"{row + 1}\t\t{cells}")
    for rate, resample, said in [
        ("15", "100", "samples come at 15 Hz"),
        ("60", "10", "--resample 10: samples come at 10 Hz"),
        ("24", "0", ""),
    ]:
        path, out = tmp_path / "slow.trc", tmp_path / "out.npz"
        path.write_text("\n".join(lines).replace("{rate}", rate) + "\n")
        options = ["--out", str(out), "--yes", "--axes", "z-up", "--resample", resample]
        options += ["--map", "shoulder=RSHO,elbow=RELB,wrist=RWRA"]
        assert cli.main([str(path), *options]) == int(bool(said))
        assert said in capsys.readouterr().err
    assert len(load_tracks(out)) == 1


def test_the_period_is_the_median_of_late_steps():
    period = SamplePeriod()
    for step in (0.04, 0.04, 0.04, 0.5):
        period.add(step)
        assert period.period_s == 0.0
    period.add(0.08)
    assert period.period_s == 0.04
    for _ in range(15):
        period.add(0.01)
    assert period.period_s == 0.01
    period.reset()
    assert period.period_s == 0.0


@given(st.floats(60.0, 1000.0))
def test_fast_samples_leave_the_window_as_it_is(rate):
    assert window_s(SegmentationConfig().window, 1.0 / rate) == SegmentationConfig().window


def test_rounded_stamps_of_the_lowest_rate_are_believed():
    assert too_slow(0.0) == too_slow(1.0 / 20.0) == too_slow(1.0 / 19.9) == ""
    assert "19 Hz" in too_slow(1.0 / 19.0)
    check_rate(reach(20.0))


def test_the_rate_is_still_known_after_a_gap_and_forgotten_by_a_reset():
    segmenter = ReachSegmenter()
    track = reach(25.0)
    for time_s, wrist in zip(track.time_s, track.keypoints[:, 2], strict=True):
        segmenter.push(float(time_s), wrist)
    segmenter.push(float(track.time_s[-1]) + 5.0, track.keypoints[-1, 2])
    assert segmenter.period_s == pytest.approx(0.04)
    segmenter.reset()
    assert segmenter.period_s == 0.0


def test_missing_samples_do_not_hide_a_reach():
    track = reach(25.0)
    kept = np.arange(len(track)) % 6 != 3
    track = dataclasses.replace(track, time_s=track.time_s[kept], keypoints=track.keypoints[kept])
    assert len(find_reaches(track.time_s, track.keypoints[:, 2])) == 1
