"""Arm samples, tracks and placements."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hri_prediction.arm.geometry import ArmRadii, arm_capsules
from hri_prediction.errors import ConfigError, DataError
from hri_prediction.tracks.placement import Placement
from hri_prediction.tracks.track import ArmSample, ArmTrack

numbers = st.floats(-10.0, 10.0)


def make_track(rows=50, rate=50.0, **values):
    time = np.arange(rows) / rate
    phase = time[:, None, None] + np.arange(12).reshape(4, 3)
    return ArmTrack(time, np.sin(2.0 * phase), **values)


def test_capsules_join_successive_keypoints():
    points = np.arange(24.0).reshape(2, 4, 3)
    capsules = arm_capsules(points)
    assert capsules.shape == (2, 3, 2, 3)
    np.testing.assert_array_equal(capsules[1, 2], points[1, 2:4])
    with pytest.raises(DataError, match=r"\(3, 3\)"):
        arm_capsules(np.zeros((3, 3)))


def test_radii_are_checked():
    np.testing.assert_array_equal(ArmRadii().array, [0.05, 0.04, 0.05])
    with pytest.raises(ConfigError, match="forearm"):
        ArmRadii(forearm=0.0)


def test_sample_is_copied_frozen_and_blanked():
    points = np.ones((4, 3))
    sample = ArmSample(5, points, np.array([True, False, True, True]), "left")
    points[:] = 7.0
    assert sample.keypoints[0, 0] == 1.0
    assert np.isnan(sample.keypoints[1]).all()
    with pytest.raises(ValueError, match="read-only"):
        sample.keypoints[0, 0] = 2.0


@pytest.mark.parametrize(
    ("points", "valid", "side"),
    [
        (np.zeros((3, 3)), np.ones(4, bool), "left"),
        (np.zeros((4, 3)), np.ones(3, bool), "left"),
        (np.zeros((4, 3)), np.ones(4, bool), "both"),
        (np.full((4, 3), np.nan), np.ones(4, bool), "left"),
    ],
)
def test_bad_samples_are_refused(points, valid, side):
    with pytest.raises(DataError):
        ArmSample(0, points, valid, side)


@pytest.mark.parametrize(
    ("time", "shape", "match"),
    [
        ([0.0, 0.0, 1.0], (3, 4, 3), "strictly increasing"),
        ([0.0, np.nan, 1.0], (3, 4, 3), "finite"),
        ([0.0], (1, 4, 3), "at least 2"),
        ([0.0, 1.0], (2, 3, 3), "shape"),
    ],
)
def test_bad_tracks_are_refused(time, shape, match):
    with pytest.raises(DataError, match=match):
        ArmTrack(np.array(time), np.zeros(shape))


def test_track_properties_and_slice():
    track = make_track()
    assert track.rate_hz == pytest.approx(50.0)
    assert track.duration == pytest.approx(0.98)
    part = track.slice(0.2, 0.4)
    assert part.time_s[[0, -1]] == pytest.approx([0.2, 0.4])
    with pytest.raises(DataError, match="rows"):
        track.slice(5.0, 6.0)


def test_half_missing_keypoint_counts_as_missing():
    points = np.zeros((3, 4, 3))
    points[1, 2, 0] = np.nan
    track = ArmTrack(np.arange(3.0), points)
    assert np.isnan(track.keypoints[1, 2]).all()
    assert track.valid.sum() == 11


@given(numbers, numbers, numbers, st.floats(-7.0, 7.0))
def test_placement_and_its_inverse_cancel(x, y, z, yaw):
    placement = Placement(x, y, z, yaw)
    points = np.arange(12.0).reshape(4, 3)
    np.testing.assert_allclose(placement.inverse.apply(placement.apply(points)), points, atol=1e-9)


def test_placement_turns_then_moves_and_keeps_nan():
    placement = Placement.parse("1, 2, 3, 90")
    np.testing.assert_allclose(placement.apply([1.0, 0.0, 0.0]), [1.0, 3.0, 3.0], atol=1e-12)
    assert np.isnan(placement.apply(np.full(3, np.nan))).all()
    assert str(placement) == "1,2,3,90"
    assert Placement.parse(str(placement)).yaw == pytest.approx(math.pi / 2.0)


@pytest.mark.parametrize("text", ["", "1,2,3", "1,2,3,4,5", "a,b,c,d", "1,2,3,nan", "1,2,inf,0"])
def test_bad_placements_are_refused(text):
    with pytest.raises(ConfigError, match="X,Y,Z,YAW"):
        Placement.parse(text)


def test_resampling_follows_smooth_motion():
    track = make_track(rows=100, rate=100.0)
    fine = track.resampled(250.0)
    expected = np.sin(2.0 * (fine.time_s[:, None, None] + np.arange(12).reshape(4, 3)))
    assert fine.rate_hz == pytest.approx(250.0)
    assert np.abs(fine.keypoints - expected).max() < 1e-3
    with pytest.raises(DataError, match="positive"):
        track.resampled(0.0)


def test_long_gaps_stay_missing_and_short_ones_are_filled():
    track = make_track()
    points = track.keypoints.copy()
    points[10:13, 0] = np.nan  # 0.08 s between the seen neighbours
    points[20:30, 1] = np.nan
    points[:2, 2] = np.nan
    filled = dataclasses.replace(track, keypoints=points).filled(0.08)
    assert filled.valid[:, 0].all()
    np.testing.assert_allclose(filled.keypoints[:, 0], track.keypoints[:, 0], atol=2e-3)
    assert (~filled.valid[:, 1]).sum() == 10
    assert (~filled.valid[:2, 2]).all()
    coarse = dataclasses.replace(track, keypoints=points).resampled(25.0, max_gap_s=0.08)
    assert (~coarse.valid[:, 1]).sum() == 5


def test_samples_carry_stamps_and_validity():
    samples = list(make_track(side="left").samples(start_ns=1_000))
    assert [sample.stamp_ns for sample in samples[:2]] == [1_000, 20_001_000]
    assert all(sample.side == "left" and sample.valid.all() for sample in samples)
