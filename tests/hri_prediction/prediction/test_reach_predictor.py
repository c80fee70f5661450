"""The streaming predictor: states, faults, invariants of the output."""

import dataclasses

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hri_prediction.prediction import ReachPredictor, ReachState, bank
from hri_prediction.prediction.input_check import InputCheck
from hri_prediction.prediction.output import rotated_along
from hri_prediction.promp import WeightFilter, filtering
from hri_prediction.tracks.speed import regression_speed
from hri_prediction.tracks.track import ArmSample
from hri_prediction.warm import warm_kernels


@pytest.fixture(scope="module", autouse=True)
def _compiled():
    warm_kernels()


def check_sane(prediction, config):
    points = 1 + round(config.horizon / config.step)
    assert prediction.mean.shape == (points, 4, 3)
    assert prediction.covariance.shape == (points, 4, 3, 3)
    assert np.isfinite(prediction.mean).all()
    assert np.isfinite(prediction.covariance).all()
    np.testing.assert_allclose(
        prediction.covariance, prediction.covariance.swapaxes(-1, -2), atol=1e-12
    )
    assert np.linalg.eigvalsh(prediction.covariance).min() > 0.0
    np.testing.assert_allclose(np.diff(prediction.times_s), config.step)
    assert prediction.times_s[0] == 0.0
    if prediction.task_names:
        assert prediction.task_probabilities.sum() == pytest.approx(1.0)


def run(predictor, track, until=np.inf, change=None):
    """Feed a track; returns (time, prediction) pairs. ``change(i, sample)`` may alter samples."""
    out = []
    for i, sample in enumerate(track.samples(10_000_000_000)):
        t = (sample.stamp_ns - 10_000_000_000) * 1e-9
        if t > until:
            break
        sample = change(i, sample) if change else sample
        if sample is not None:
            predictor.observe(sample)
            out.append((t, predictor.predict()))
    return out


def altered(sample, keypoints=None, lost=(), **kwargs):
    points = np.array(sample.keypoints if keypoints is None else keypoints)
    valid = np.array(sample.valid)
    valid[list(lost)] = False
    return dataclasses.replace(sample, keypoints=points, valid=valid, **kwargs)


def test_states_of_a_reach(library, config, reach_maker):
    track = reach_maker("left bin", np.random.default_rng(5), rate=250.0, noise=0.001)
    predictor = ReachPredictor(library, config)
    states = run(predictor, track)
    for _, p in states:
        check_sane(p, config)
    named = [p.state for t, p in states if t < 0.45]
    assert set(named) == {ReachState.IDLE}
    moving = [t for t, p in states if p.state == ReachState.REACHING]
    assert 0.5 < moving[0] < 0.75
    assert states[-1][1].state == ReachState.IDLE
    assert predictor.counters["reaches"] == 1
    onset = next(p for _, p in states if p.state == ReachState.REACHING).onset_ns
    assert onset * 1e-9 == pytest.approx(10.5, abs=0.03)


@pytest.mark.parametrize("task", ["left bin", "right bin"])
def test_end_point_from_a_part_of_the_reach(library, config, reach_maker, task):
    track = reach_maker(task, np.random.default_rng(6), duration=1.0)
    predictor = ReachPredictor(library, config)
    _, prediction = run(predictor, track, until=0.9)[-1]
    index = prediction.task_names.index(task)
    assert prediction.task_probabilities[index] > 0.9
    np.testing.assert_allclose(prediction.mean[-1, 2], track.keypoints[-1, 2], atol=0.03)
    np.testing.assert_allclose(prediction.mean[-1, 3], track.keypoints[-1, 3], atol=0.05)
    assert prediction.duration_mean_s == pytest.approx(0.9, abs=0.15)


def test_prediction_starts_at_the_newest_sample(library, config, reach_maker):
    track = reach_maker("left bin", np.random.default_rng(7), rate=250.0)
    predictor = ReachPredictor(library, config)
    for i, sample in enumerate(track.samples()):
        predictor.observe(sample)
        if i > 30:
            gap = np.abs(predictor.predict().mean[0] - sample.keypoints).max()
            assert gap < 0.002


def test_wrist_lost_in_mid_reach_is_bridged_by_the_elbow(library, config, reach_maker):
    track = reach_maker("right bin", np.random.default_rng(8), duration=1.0)
    predictor = ReachPredictor(library, config)

    def lose(i, sample):
        return altered(sample, lost=(2, 3)) if 0.8 < i / 100 < 1.05 else sample

    _, prediction = run(predictor, track, until=1.0, change=lose)[-1]
    assert prediction.state == ReachState.REACHING
    assert "wrist" in prediction.reason
    np.testing.assert_allclose(prediction.mean[-1, 2], track.keypoints[-1, 2], atol=0.04)


def test_nothing_seen_is_invalid_and_recovers(library, config, reach_maker):
    track = reach_maker("left bin", np.random.default_rng(9))
    predictor = ReachPredictor(library, config)

    def lose(i, sample):
        return altered(sample, lost=(0, 1, 2, 3)) if 20 <= i < 40 else sample

    results = run(predictor, track, change=lose)
    at = dict(enumerate(p for _, p in results))
    assert at[39].state == ReachState.INVALID
    assert "no usable sample" in at[39].reason
    check_sane(at[39], config)
    assert at[44].state == ReachState.IDLE
    assert predictor.predict(now_ns=10_000_000_000 + int(60e9)).state == ReachState.INVALID


def test_jump_is_kept_out(library, config, reach_maker):
    track = reach_maker("left bin", np.random.default_rng(10))
    predictor = ReachPredictor(library, config)

    def jump(i, sample):
        if i in (70, 71):
            points = np.array(sample.keypoints)
            points[2] += 0.5
            return altered(sample, points)
        return sample

    results = run(predictor, track, change=jump)
    assert predictor.counters["jump"] == 2
    assert "jump: wrist" in results[70][1].reason
    assert np.abs(results[71][1].mean[0, 2] - track.keypoints[71, 2]).max() < 0.05


@pytest.mark.parametrize("count", [5, 60])
def test_swapped_markers_are_rejected(library, config, reach_maker, count):
    """Also while the arm moves on, for longer than a jump is remembered."""
    track = reach_maker("left bin", np.random.default_rng(11))
    predictor = ReachPredictor(library, config)

    def swap(i, sample):
        order = [2, 1, 0, 3] if 65 <= i < 65 + count else [0, 1, 2, 3]
        return altered(sample, np.array(sample.keypoints)[order])

    results = run(predictor, track, change=swap)
    assert predictor.counters["markers swapped"] == count
    assert results[67][1].reason == "markers swapped"
    assert results[-1][1].state == ReachState.IDLE
    np.testing.assert_allclose(results[-1][1].mean[0], track.keypoints[-1], atol=0.01)


def test_swapped_markers_of_which_one_is_lost_meanwhile_are_still_swapped(config, reach_maker):
    """The two that are seen are where others were, for longer than a jump is remembered."""
    track = reach_maker("left bin", np.random.default_rng(11))
    check = InputCheck(config)
    verdicts = []
    for i, sample in zip(range(110), track.samples(0), strict=False):
        if i >= 40:
            points = np.array(sample.keypoints)[[0, 2, 1, 3]]
            seen = np.array([True, not 60 <= i < 90, True, True])
            sample = dataclasses.replace(sample, keypoints=points, valid=seen)
        verdicts.append(check.check(sample))
    assert {verdict.reason for verdict in verdicts[:40]} == {""}
    assert {verdict.reason for verdict in verdicts[40:]} == {"markers swapped"}
    assert not any(verdict.usable.any() for verdict in verdicts[40:])


def test_markers_that_stay_swapped_are_believed_and_said_so(library, config, reach_maker):
    """After a second nobody can tell labels that stay exchanged from an arm that turned unseen."""
    track = reach_maker("left bin", np.random.default_rng(11))
    first = next(iter(track.samples(0)))
    check = InputCheck(dataclasses.replace(config, length_tolerance=2.0, max_reach=2.0))
    reasons = []
    for i in range(250):
        order = [2, 1, 0, 3] if i >= 20 else [0, 1, 2, 3]
        points = np.array(first.keypoints)[order]
        stamp_ns = 10_000_000 * i
        verdict = check.check(dataclasses.replace(first, stamp_ns=stamp_ns, keypoints=points))
        reasons.append(verdict.reason)
    assert set(reasons[20:115]) == {"markers swapped"}
    (_,) = (reason for reason in reasons if "believed now" in reason)
    assert check.counters["swapped markers believed"] == 1
    assert set(reasons[150:]) == {""}


def test_implausible_arm_is_rejected(library, config, reach_maker):
    track = reach_maker("left bin", np.random.default_rng(12))
    predictor = ReachPredictor(library, config)
    results = run(
        predictor, track, change=lambda i, s: altered(s, np.array(s.keypoints) * [1, 1, 3])
    )
    assert predictor.counters["implausible length"] > 100
    assert all(p is None for _, p in results)


def test_clock_going_back_restarts(library, config, reach_maker):
    track = reach_maker("left bin", np.random.default_rng(13))
    predictor = ReachPredictor(library, config)
    run(predictor, track)
    samples = list(track.samples(1_000_000_000))
    predictor.observe(samples[0])
    assert predictor.counters["restarts"] == 1
    prediction = predictor.predict()
    assert prediction.stamp_ns == samples[0].stamp_ns
    assert "clock went back" in prediction.reason
    predictor.observe(samples[0])
    assert predictor.counters["late or repeated sample"] == 1
    for sample in samples[1:]:
        predictor.observe(sample)
    assert predictor.counters["reaches"] == 2


def test_the_present_time_only_decides_whether_a_prediction_is_invalid(
    library, config, reach_maker
):
    """Else what is said live would hang on how late the node's tick comes after a sample."""
    track = reach_maker("left bin", np.random.default_rng(21))
    asked, silent = ReachPredictor(library, config), ReachPredictor(library, config)
    rng = np.random.default_rng(0)
    states = set()
    for i, sample in enumerate(track.samples()):
        if 30 < i < 36:
            sample = altered(sample, lost=(1, 2, 3))
        asked.observe(sample)
        silent.observe(sample)
        expected = silent.predict()
        age = (sample.stamp_ns - asked.newest_ns) * 1e-9
        for late in rng.uniform(0.0, config.stale_time - age - 1e-3, 3):
            found = asked.predict(sample.stamp_ns + round(late * 1e9))
            assert (found.state, found.reason) == (expected.state, expected.reason)
            states.add(found.state)
            np.testing.assert_array_equal(found.mean, expected.mean)
            np.testing.assert_array_equal(found.covariance, expected.covariance)
            assert found.stamp_ns == asked.newest_ns
        assert asked.predict(sample.stamp_ns + 10**9).state == ReachState.INVALID
    assert states == {ReachState.IDLE, ReachState.REACHING}


@pytest.mark.parametrize("rate", [100.0, 250.0])
def test_when_the_first_sample_was_plays_no_part(library, config, reach_maker, rate):
    """Samples lie on thresholds of time, such as 0.4 s: rounding must not choose the side."""
    track = reach_maker("left bin", np.random.default_rng(22), rate=rate)
    samples = list(track.samples(10_000_000_000))

    def predictions(first):
        predictor = ReachPredictor(library, config)
        for number, sample in enumerate(samples[first:], first):
            predictor.observe(sample)
            if sample.stamp_ns > 10_550_000_000 and number % 3 == 0:
                yield predictor.predict()

    expected = list(predictions(0))
    assert sum(p.state == ReachState.REACHING for p in expected) > 0.25 * rate
    for first in range(1, 10):
        for a, b in zip(predictions(first), expected, strict=True):
            assert (a.state, a.stamp_ns) == (b.state, b.stamp_ns)
            assert abs(a.onset_ns - b.onset_ns) <= 1
            np.testing.assert_allclose(a.mean, b.mean, rtol=0.0, atol=1e-9)
            np.testing.assert_allclose(a.covariance, b.covariance, rtol=0.0, atol=1e-9)


def test_side_change_restarts(library, config, reach_maker):
    track = reach_maker("left bin", np.random.default_rng(14))
    predictor = ReachPredictor(library, config)
    run(predictor, track, until=0.3)
    run(predictor, dataclasses.replace(track, side="left"))
    assert predictor.counters["restarts"] == 1
    assert predictor.predict().side == "left"


def test_gap_restarts(library, config, reach_maker):
    track = reach_maker("left bin", np.random.default_rng(15))
    predictor = ReachPredictor(library, config)
    results = run(predictor, track, change=lambda i, s: None if 80 < i < 120 else s)
    after = next(p for t, p in results if t > 1.19)
    assert after.state == ReachState.IDLE
    assert "restarted after 0.40 s" in after.reason


def test_without_library_velocity_is_kept(config, reach_maker):
    track = reach_maker("left bin", np.random.default_rng(16), duration=1.0, noise=0.0)
    predictor = ReachPredictor(None, config)
    results = run(predictor, track, until=1.0)
    prediction = results[-1][1]
    check_sane(prediction, config)
    assert prediction.state == ReachState.REACHING
    assert prediction.task_names == ()
    speed = (track.keypoints[100, 2] - track.keypoints[90, 2]) / 0.1
    found = (prediction.mean[10, 2] - prediction.mean[0, 2]) / (10 * config.step)
    np.testing.assert_allclose(found, speed, atol=0.02)
    spread = prediction.covariance[:, 2, 0, 0]
    assert (np.diff(spread) > 0.0).all()


def test_elbow_and_hand_never_seen(library, config, reach_maker):
    track = reach_maker("left bin", np.random.default_rng(17))
    predictor = ReachPredictor(library, config)
    for _, p in run(predictor, track, change=lambda i, s: altered(s, lost=(1, 3))):
        check_sane(p, config)
    no_shoulder = ReachPredictor(library, config)
    results = run(no_shoulder, track, change=lambda i, s: altered(s, lost=(0,)))
    assert all(p is None for _, p in results)


def test_same_samples_same_prediction(library, config, reach_maker):
    track = reach_maker("left bin", np.random.default_rng(18))
    first = run(ReachPredictor(library, config), track)
    reused = ReachPredictor(library, config)
    run(reused, track, until=0.9)
    reused.reset()
    for (_, a), (_, b) in zip(first, run(reused, track), strict=True):
        np.testing.assert_array_equal(a.mean, b.mean)
        np.testing.assert_array_equal(a.covariance, b.covariance)


@settings(
    max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(st.integers(0, 10_000))
def test_no_fault_makes_nan_or_raises(library, config, reach_maker, seed):
    rng = np.random.default_rng(seed)
    track = reach_maker("left bin", rng, rate=60.0)
    predictor = ReachPredictor(library if seed % 3 else None, config)
    stamp = 0
    for sample in track.samples():
        points = np.array(sample.keypoints)
        points += rng.choice([0.0, 0.0, 0.01, 1.0]) * rng.standard_normal((4, 3))
        if rng.random() < 0.1:
            points = points[rng.permutation(4)]
        valid = rng.random(4) > rng.choice([0.0, 0.2, 0.8])
        stamp += int(rng.choice([17, 17, 17, 17, 0, 300, -5, -2000]) * 1e6)
        predictor.observe(
            ArmSample(stamp, points, valid, str(rng.choice(["right"] * 20 + ["left"])))
        )
        prediction = predictor.predict(stamp + int(rng.choice([0, 50_000_000, 10**9])))
        if prediction is not None:
            check_sane(prediction, config)


@given(st.integers(0, 1000))
def test_rotation_keeps_length_and_angle(seed):
    rng = np.random.default_rng(seed)
    vector, start, directions = (
        rng.standard_normal(3),
        rng.standard_normal(3),
        rng.standard_normal((5, 3)),
    )
    turned = rotated_along(vector, start, directions)
    np.testing.assert_allclose(np.linalg.norm(turned, axis=1), np.linalg.norm(vector))
    units = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    cosines = units @ start / np.linalg.norm(start)
    expected = vector @ start / np.linalg.norm(start)
    np.testing.assert_allclose(np.sum(turned * units, axis=1)[cosines > -0.99], expected, atol=1e-9)


def test_warming_leaves_nothing_to_compile(library, config, reach_maker):
    kernels = (bank.update_bank, bank.mix_bank, filtering.kalman_step, regression_speed)
    before = [len(kernel.signatures) for kernel in kernels]
    run(ReachPredictor(library, config), reach_maker("left bin", np.random.default_rng(20)))
    WeightFilter(library.tasks[0].promp).observe(0.5, np.zeros(6))
    assert [len(kernel.signatures) for kernel in kernels] == before
