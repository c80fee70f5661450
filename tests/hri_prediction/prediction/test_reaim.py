"""Re-aimed reaches: the polynomial, the bank of its own, and a change of mind through the predictor."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import BPoly

from hri_prediction.prediction import PredictorConfig, ReachPredictor, ReachState
from hri_prediction.prediction.reaim import SLOTS, ReaimBank, aims_of, hermite_row
from hri_prediction.tracks.track import ArmTrack

SEEN = np.ones(6, dtype=bool)


def row(time: float, remaining: float) -> np.ndarray:
    out = np.empty(4)
    hermite_row(time, remaining, out)
    return out


@given(st.floats(0.0, 1.0), st.floats(0.2, 2.0))
def test_the_polynomial_is_the_one_of_its_boundary_values(share, remaining):
    values = np.eye(4)
    for term in range(4):
        begin, end = values[term][:3], [values[term][3], 0.0, 0.0]
        reference = BPoly.from_derivatives([0.0, remaining], [begin, end])
        expected = float(reference(share * remaining))
        assert row(share * remaining, remaining)[term] == pytest.approx(expected, abs=1e-9)
    np.testing.assert_array_equal(row(remaining + 0.1, remaining), [0.0, 0.0, 0.0, 1.0])
    np.testing.assert_allclose(row(-0.1, remaining), [1.0, -0.1, 0.005, 0.0])


@given(st.floats(0.0, 1.0), st.floats(0.2, 2.0))
def test_where_all_is_at_one_place_it_stays_there(share, remaining):
    out = row(share * remaining, remaining)
    assert out[0] + out[3] == pytest.approx(1.0)


def test_minimum_jerk_is_followed_exactly():
    remaining, share = 0.8, 0.37
    start, end = 0.2, 0.7
    expected = start + (end - start) * share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
    assert row(share * remaining, remaining) @ [start, 0.0, 0.0, end] == pytest.approx(expected)


def test_shares_and_moments_add_up(library, config):
    bank = ReaimBank(aims_of(library.tasks, 0.05), 0.5, 0.004, 0.05)
    assert bank.shares()[0] == 1.0
    for k in range(30):
        value = library.tasks[0].promp.trajectory_mean([k / 40.0])[0]
        bank.observe(0.02 * k, value, SEEN, -200.0 if k > 20 else 10.0)
    begun, changed = bank.shares()
    assert begun + changed.sum() == pytest.approx(1.0)
    assert changed.shape == (SLOTS, len(bank.aims.tasks))
    assert changed.sum() > 0.9  # nothing spoke for the reach as begun
    first, second = bank.moments(changed / changed.sum(), 0.58, 0.1, 4)
    parts = first.reshape(4, 2, 3)
    spread = second - parts[..., :, None] * parts[..., None, :]
    assert np.linalg.eigvalsh(spread).min() > 0.0
    np.testing.assert_allclose(first[0], value, atol=0.02)
    bank.restart()
    assert bank.shares()[0] == 1.0


def changing(reach_maker, change_s: float) -> ArmTrack:
    """Towards the left bin, and by a second minimum-jerk movement on top to the right one."""
    rng = np.random.default_rng(0)
    left, right = (
        reach_maker(task, np.random.default_rng(3), rate=250.0, noise=0.0, duration=1.0)
        for task in ("left bin", "right bin")
    )
    time = np.arange(0.0, 2.4, 0.004)

    def wrist(track: ArmTrack, at: np.ndarray) -> np.ndarray:
        return np.column_stack(
            [np.interp(at, track.time_s, track.keypoints[:, 2, axis]) for axis in range(3)]
        )

    z = np.clip(time - 0.5 - change_s, 0.0, 1.0)
    rise = (z**3 * (10.0 - 15.0 * z + 6.0 * z**2))[:, None]
    gap = right.keypoints[-1, 2] - left.keypoints[-1, 2]
    path = wrist(left, time) + rise * gap
    keypoints = np.repeat(left.keypoints[:1], len(time), axis=0)
    shoulder = keypoints[0, 0]
    reach = path - shoulder
    length = np.linalg.norm(reach, axis=1, keepdims=True)
    along = (0.29**2 - 0.26**2 + length**2) / (2.0 * length)
    axis = reach / length
    down = np.array([0.0, 0.0, -1.0]) - axis * (axis @ np.array([0.0, 0.0, -1.0]))[:, None]
    down /= np.linalg.norm(down, axis=1, keepdims=True)
    keypoints[:, 1] = shoulder + axis * along + down * np.sqrt(0.29**2 - along**2)
    keypoints[:, 2] = path
    keypoints[:, 3] = path + 0.09 * (path - keypoints[:, 1]) / 0.26
    noisy = keypoints + 0.0005 * rng.standard_normal(keypoints.shape)
    return ArmTrack(time, noisy, "right", "one", "changed", 0, "")


@pytest.mark.parametrize("change_s", [0.3, 0.4, 0.5])
def test_the_belief_follows_a_change_of_mind_within_a_third_of_a_second(
    library, reach_maker, change_s
):
    track = changing(reach_maker, change_s)
    end = track.keypoints[-1, 2]
    predictor = ReachPredictor(library)
    names: tuple[str, ...] = ()
    chance, error, square = {}, {}, {}
    for time_s, sample in zip(track.time_s, track.samples(), strict=True):
        predictor.observe(sample)
        since = round(float(time_s) - 0.5 - change_s, 3)
        if since in (-0.02, 0.32):
            p = predictor.predict()
            assert p is not None
            assert p.state == ReachState.REACHING
            names = p.task_names
            chance[since] = dict(zip(names, p.task_probabilities, strict=True))
            off = p.mean[-1, 2] - end
            error[since] = float(np.linalg.norm(off))
            square[since] = float(off @ np.linalg.solve(p.covariance[-1, 2], off))
    assert chance[-0.02]["left bin"] > 0.9
    assert chance[0.32]["right bin"] > 0.5
    assert error[0.32] < 0.3 * error[-0.02]
    assert square[0.32] < 30.0
    never = ReachPredictor(library, PredictorConfig(change_rate=0.0))
    for time_s, sample in zip(track.time_s, track.samples(), strict=True):
        never.observe(sample)
        if round(float(time_s) - 0.5 - change_s, 3) == 0.32:
            p = never.predict()
            assert p is not None
            assert dict(zip(names, p.task_probabilities, strict=True))["right bin"] < 0.1


def test_a_steady_reach_is_not_taken_for_a_change(library, reach_maker):
    track = reach_maker("left bin", np.random.default_rng(8), rate=250.0, noise=0.001)
    known, never = (
        ReachPredictor(library, dataclasses.replace(PredictorConfig(), change_rate=rate))
        for rate in (PredictorConfig().change_rate, 0.0)
    )
    furthest = 0.0
    for sample in track.samples():
        known.observe(sample)
        never.observe(sample)
        one, other = known.predict(), never.predict()
        if one is not None and other is not None and one.state == ReachState.REACHING:
            furthest = max(furthest, float(np.abs(one.mean - other.mean).max()))
    assert furthest < 0.02
