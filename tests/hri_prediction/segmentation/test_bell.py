"""From crossings of a speed to rest: exact on minimum-jerk paths, close on noisy ones."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hri_prediction.tracks.bell import from_rest_to_rest, peak_speed, share_outside
from hri_prediction.tracks.segmentation import Reach, SegmentationConfig, find_reaches
from hri_prediction.tracks.track import ArmTrack


def bell(tau):
    return 16.0 * tau**2 * (1.0 - tau) ** 2


@given(st.floats(0.0, 0.49))
def test_the_share_outside_is_where_the_bell_has_that_height(ratio):
    share = float(share_outside(ratio))
    assert 0.0 <= share < 0.5
    assert bell(share) == pytest.approx(ratio, abs=1e-12)


@given(st.floats(0.1, 5.0), st.floats(0.0, 0.5), st.floats(0.0, 0.5))
def test_the_faster_the_crossing_the_more_lies_outside(between, ratio, other):
    low, high = sorted((ratio, other))
    assert between <= from_rest_to_rest(between, low) <= from_rest_to_rest(between, high)


def test_speeds_above_the_peak_do_not_make_it_endless():
    assert from_rest_to_rest(1.0, 3.0) == from_rest_to_rest(1.0, 0.5) < 2.0


def reach_track(length: float, duration: float, noise: float) -> ArmTrack:
    times = np.arange(-0.4, duration + 0.4, 0.004)
    tau = np.clip(times / duration, 0.0, 1.0)
    keypoints = np.zeros((times.size, 4, 3))
    keypoints[:, :, 2] = np.array([0.5, 0.2, 0.2, 0.2])
    keypoints[:, 2, 0] = length * tau**3 * (10.0 - 15.0 * tau + 6.0 * tau**2)
    keypoints += noise * np.random.default_rng(0).standard_normal(keypoints.shape)
    return ArmTrack(times, keypoints, "right", "s", "t", 1, "")


@pytest.mark.parametrize("length", [0.25, 0.45])
@pytest.mark.parametrize("duration", [0.8, 1.1, 1.5])
def test_a_reach_cut_by_speed_is_given_its_whole_duration(length, duration):
    track = reach_track(length, duration, 0.001)
    config = SegmentationConfig()
    (found,) = find_reaches(track.time_s, track.keypoints[:, 2], config)
    peak = peak_speed(track, found, config)
    # The regression window flattens the peak a little.
    assert peak == pytest.approx(1.875 * length / duration, rel=0.05)
    whole = from_rest_to_rest(found.duration_s, config.onset_speed / peak)
    assert found.duration_s < 0.93 * duration
    assert whole == pytest.approx(duration, abs=0.06)


def test_the_peak_of_what_is_not_seen_is_not_known():
    track = reach_track(0.3, 1.0, 0.0)
    unseen = ArmTrack(
        track.time_s,
        np.where(np.arange(4)[:, None] == 2, np.nan, track.keypoints),
        "right", "s", "t", 1, "",
    )  # fmt: skip
    assert np.isnan(peak_speed(unseen, Reach(0.0, 1.0), SegmentationConfig()))
