"""What motion capture makes of who meets the robot."""

from __future__ import annotations

import numpy as np

from hri_sim.separation.capture import LONGEST_GAP_S, Capture, MotionCapture

PERIOD_S = 0.004
PERIOD_NS = 4_000_000
ARMS = np.arange(24.0).reshape(2, 4, 3)


def captured(capture: Capture, ticks: int, seed: int = 0) -> list[tuple[int, int, np.ndarray]]:
    """When samples arrived, when they were made, and what they hold."""
    mocap = MotionCapture(capture, PERIOD_S, np.random.default_rng(seed))
    found = []
    for tick in range(ticks):
        mocap.see(tick * PERIOD_NS, ARMS)
        for stamp_ns, arms in mocap.arrived(tick * PERIOD_NS):
            found.append((tick * PERIOD_NS, stamp_ns - mocap.stamps_ns, arms))
    return found


def test_errors_are_cut_and_delays_are_kept() -> None:
    found = captured(Capture(noise=0.006, most=0.01, gaps=np.inf, hidden=np.inf), 1000)
    errors = np.stack([arms - ARMS for _, _, arms in found])
    length = np.linalg.norm(errors, axis=-1)
    assert length.max() <= 0.01 + 1e-12
    assert (length > 0.0099).mean() > 0.1  # some were cut
    delays = np.array([at_ns - made_ns for at_ns, made_ns, _ in found]) * 1e-9
    assert delays.min() >= 0.004
    assert delays.max() < 0.020 + PERIOD_S
    assert len(found) >= 1000 - 6


def test_nothing_is_seen_in_a_gap() -> None:
    made = np.array([m for _, m, _ in captured(Capture(gaps=0.1, hidden=np.inf), 2000)])
    missing = 2000 - 6 - len(made)
    assert 200 < missing < 1000
    made.sort()
    assert np.diff(made).max() * 1e-9 > 0.02


def test_keypoints_are_hidden_one_by_one_and_come_back() -> None:
    found = captured(Capture(gaps=np.inf, hidden=0.1), 5000)
    found.sort(key=lambda sample: sample[1])
    hidden = np.stack([np.isnan(arms).all(axis=-1) for _, _, arms in found])
    assert not np.isnan(np.stack([arms for _, _, arms in found])[~hidden]).any()
    assert hidden.any(axis=0).all()  # each of both arms, some time
    assert (hidden.sum(axis=(1, 2)) == 1).mean() > 0.1
    for keypoint in hidden.reshape(len(hidden), 8).T:
        assert not keypoint.all()
    assert 0.03 < hidden.mean() * 8 < 0.6


def test_no_gap_is_longer_than_it_may_be() -> None:
    made = np.sort([m for _, m, _ in captured(Capture(gaps=2.0, hidden=np.inf), 5000, seed=3)])
    # One gap may begin before another is over.
    assert np.diff(made).max() * 1e-9 <= 2.0 * (LONGEST_GAP_S + PERIOD_S)


def test_the_same_seed_sees_the_same() -> None:
    one, other = (captured(Capture(), 500, seed=5) for _ in range(2))
    assert [sample[:2] for sample in one] == [sample[:2] for sample in other]
    np.testing.assert_array_equal([s[2] for s in one], [s[2] for s in other])
