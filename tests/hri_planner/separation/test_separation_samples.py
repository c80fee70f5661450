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
