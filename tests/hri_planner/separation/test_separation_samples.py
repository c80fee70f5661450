"""Speeds through the newest samples: against fits by numpy, with gaps and more samples than are kept."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hri_planner.separation.config import ReleaseConfig
from hri_planner.separation.samples import RING
from hri_planner.separation.track import WINDOW_NS, ArmWatch
from hri_planner.warm import warm_separation
from hri_prediction.errors import DataError

ARM = np.array([[0.0, 0.0, 0.4], [0.3, 0.0, 0.4], [0.55, 0.0, 0.4], [0.64, 0.0, 0.4]])
ALONG_X = np.array([1.0, 0.0, 0.0])
MS = 1_000_000
warm_separation()  # hypothesis takes the compiler's time for that of a test


@settings(max_examples=60, deadline=None)
@given(
    st.integers(0, 2**32 - 1),
    st.lists(st.integers(1, 20), min_size=1, max_size=2 * RING),
    st.floats(0.0, 0.5),
)
def test_speeds_are_slopes_of_straight_lines(seed: int, steps: list[int], unseen: float) -> None:
    rng = np.random.default_rng(seed)
    watch = ArmWatch("right", ReleaseConfig())
    stamps = np.cumsum([1, *steps]) * MS
    samples = ARM + rng.normal(0.0, 0.002, (len(stamps), 4, 3))
    samples[rng.random((len(stamps), 4)) < unseen] = np.nan
    samples[0] = ARM  # all is seen once
    for stamp, sample in zip(stamps, samples, strict=True):
        watch.add(int(stamp), sample)
    taken = [n for n in range(len(stamps)) if not np.isnan(samples[n, :, 0]).all()]
    newest = taken[-1]
    kept = [n for n in taken if stamps[n] >= stamps[newest] - WINDOW_NS][-RING:]
    (arm,) = watch.at(int(stamps[newest]))
    assert arm.half_window_s == pytest.approx(0.5e-9 * (stamps[newest] - stamps[kept[0]]))
    for point in range(4):
        seen = [n for n in kept if not np.isnan(samples[n, point, 0])]
        if len(seen) < 3 or newest not in seen:
            assert np.isnan(arm.speeds[point]).all()
            assert np.isnan(arm.spreads[point])
            continue
        times = (stamps[seen] - stamps[newest]) / 1e9
        slope = np.polyfit(times, samples[seen, point], 1)[0]
        assert arm.spreads[point] == pytest.approx(1.0 / (np.std(times) * np.sqrt(len(times))))
        assert arm.speeds[point] == pytest.approx(slope, abs=1e-6)


@pytest.mark.parametrize("count", [3, 4, 13])
def test_what_noise_makes_of_a_speed_is_known(count: int) -> None:
    """Of the first samples after a gap as of a whole window."""
    rng = np.random.default_rng(0)
    found, told = [], 0.0
    for _ in range(400):
        watch = ArmWatch("right", ReleaseConfig())
        for n in range(count):
            watch.add((4 * n + 1) * MS, ARM + rng.normal(0.0, 0.002, (4, 3)))
        (arm,) = watch.at(4 * count * MS)
        found.append(arm.speeds[:, 0])
        told = 0.002 * arm.spreads[0]
    assert told == pytest.approx(np.std(found), rel=0.1)


def test_limbs_of_no_length_are_refused_and_not_taken() -> None:
    watch = ArmWatch("right", ReleaseConfig())
    watch.add(MS, ARM)
    with pytest.raises(DataError, match=r"the forearm is 250 m long"):
        watch.add(2 * MS, np.array([[0, 0, 0], [0.3, 0, 0], [250.3, 0, 0], [250.4, 0, 0.0]]))
    assert watch.newest_ns == MS


def walking_by(stamps: np.ndarray, speed: float) -> np.ndarray:
    """An arm at times (n,) [ns] that swings at up to a speed [m/s]: (n, 4, 3)."""
    swing = 0.1 * np.sin(speed / 0.1 * stamps / 1e9)
    return ARM + swing[:, None, None] * np.array([0.0, 1.0, 0.0])


@settings(max_examples=100, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(0.0, 6.0), st.floats(0.0, 40.0))
def test_samples_out_of_order_are_no_jumps(seed: int, speed: float, late_ms: float) -> None:
    """Of one source, however fast the arm and whatever is hidden."""
    rng = np.random.default_rng(seed)
    stamps = np.arange(1, 400, 4) * MS
    samples = walking_by(stamps, speed) + rng.uniform(-0.005, 0.005, (len(stamps), 4, 3))
    samples[rng.random((len(stamps), 4)) < 0.3] = np.nan
    samples[0] = ARM
    watch = ArmWatch("right", ReleaseConfig())
    order = np.argsort(stamps + rng.uniform(0.0, late_ms * MS, len(stamps)))
    for n in [0, *order[order != 0]]:
        watch.add(int(stamps[n]), samples[n])
    assert watch.jumps == 0
    assert len(watch.at(int(stamps[-1]))) == 1


@settings(max_examples=60, deadline=None)
@given(
    st.integers(4, 80), st.floats(0.0, 2.0), st.floats(0.75, 3.0), st.sampled_from([4, 8]), st.booleans()
)  # fmt: skip
def test_of_two_sources_the_later_one_counts_too(
    late_ms: int, speed: float, apart: float, period_ms: int, own_jumps: bool
) -> None:
    """Where it has the arm, as old as it is, as long as it speaks and a while longer."""
    watch = ArmWatch("right", ReleaseConfig())
    for ms in range(1000, 2000, period_ms):
        fresh, true = (walking_by(np.array([stamp * MS]), speed)[0] for stamp in (ms, ms - late_ms))
        # Jumps of the fresh one do not push out what the late one says.
        aside = apart + (0.5 if own_jumps and (ms // 8) % 2 else 0.0)
        watch.add(ms * MS, fresh + aside * ALONG_X)
        watch.add((ms - late_ms) * MS, true)
        if ms < 1200:  # the first late ones may be of before anything was heard
            continue
        late = [arm for arm in watch.at(ms * MS) if np.abs(arm.keypoints - true).max() < 1e-9]
        assert [arm.was for arm in late] == [True]
        np.testing.assert_allclose(late[0].age_s, late_ms * 1e-3)
        assert len([a for a in watch.at(ms * MS) if a.keypoints[0, 0] < 0.5]) == 1
    assert watch.jumps > 100
    watch.add(2600 * MS, fresh + aside * ALONG_X)
    assert len(watch.at(2600 * MS)) == 1


def test_a_late_sample_of_which_something_is_hidden() -> None:
    watch = ArmWatch("right", ReleaseConfig())
    for ms in range(100, 200, 4):
        watch.add(ms * MS, ARM)
    hand = np.full((4, 3), np.nan)
    hand[3] = ARM[3] + [0.0, 0.4, 0.0]
    watch.add(180 * MS, hand)
    now, late = watch.at(200 * MS)
    assert watch.jumps == 1
    np.testing.assert_array_equal(now.keypoints, ARM)
    np.testing.assert_array_equal(late.keypoints, [*ARM[:3], hand[3]])
    np.testing.assert_allclose(late.age_s, [0.004, 0.004, 0.004, 0.02])
    assert len(watch.at(396 * MS)) == 2
    assert len(watch.at(397 * MS)) == 1
    # Of a limb that is as long as none a late sample is refused like any other.
    with pytest.raises(DataError, match=r"the upper arm is"):
        watch.add(180 * MS, 1000.0 * ARM)


def test_late_samples_before_all_has_been_seen_are_counted_alone() -> None:
    watch = ArmWatch("right", ReleaseConfig())
    seen = ARM.copy()
    seen[3] = np.nan
    watch.add(100 * MS, seen)
    watch.add(96 * MS, seen + 1.0)
    assert watch.jumps == 1
    assert watch.at(100 * MS) == []
