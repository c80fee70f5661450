"""Tracking of the simulated arm, and reaches for training."""

import numpy as np
import pytest

from hri_prediction.errors import ConfigError
from hri_sim.people.person import SimulatedPerson
from hri_sim.people.tracking import SAMPLE_PERIOD_NS, TrackingModel, tracked_samples
from hri_sim.people.training import scenario_training, training_reaches
from hri_sim.scenario.schema import PersonSpec
from hri_sim.scenario.shipped import load_shipped

TARGET = (0.40, -0.10, 0.15)


def track(count=5000, seed=0, **values):
    spec = PersonSpec(**values)
    person = SimulatedPerson(spec, 1)
    person.plan_reach(TARGET, 1.0, 1.2)
    model = TrackingModel(spec, np.random.default_rng(seed))
    samples = tracked_samples(person, model, 0, count)
    truth = person.truth(np.arange(count) * SAMPLE_PERIOD_NS * 1e-9)
    return samples, truth


def test_noise_and_latency():
    samples, truth = track(dropout_rate=0.0, marker_dropout_rate=0.0)
    error = np.array([one.sample.keypoints for one in samples]) - truth
    assert np.std(error) == pytest.approx(0.002, rel=0.02)
    assert np.abs(error.mean(axis=0)).max() < 2e-4
    assert {one.delivery_ns - one.sample.stamp_ns for one in samples} == {8_000_000}
    assert [one.sample.stamp_ns for one in samples[:3]] == [0, 4_000_000, 8_000_000]


def test_dropouts_come_in_bursts():
    samples, _ = track(20_000, dropout_rate=0.0, marker_dropout_rate=1.0, dropout_duration=0.1)
    valid = np.array([one.sample.valid for one in samples])
    # Poisson bursts of exponential length: lost share 1 - exp(-rate * duration).
    assert np.mean(~valid) == pytest.approx(1.0 - np.exp(-0.1), rel=0.3)
    starts = np.sum(valid[:-1] & ~valid[1:])
    assert np.sum(~valid) / starts > 10.0


def test_whole_arm_drops_out_together():
    samples, _ = track(dropout_rate=1.0, marker_dropout_rate=0.0, dropout_duration=0.1)
    valid = np.array([one.sample.valid for one in samples])
    assert np.all(valid.any(axis=1) == valid.all(axis=1))
    assert 0.0 < np.mean(~valid) < 0.3


def test_same_seed_same_samples():
    first, second, other = track(500, seed=3)[0], track(500, seed=3)[0], track(500, seed=4)[0]
    for one, two in zip(first, second, strict=True):
        np.testing.assert_array_equal(one.sample.keypoints, two.sample.keypoints)
    assert not np.array_equal(first[0].sample.keypoints, other[0].sample.keypoints)


def test_training_reaches_look_like_what_the_predictor_will_see():
    spec = PersonSpec(side="left")
    tracks = training_reaches(spec, spec.home, TARGET, 25, np.random.default_rng(0), task="t")
    assert len(tracks) == 25
    for number, one in enumerate(tracks):
        assert (one.side, one.subject, one.task, one.trial) == ("left", "person1", "t", number)
        assert one.rate_hz == pytest.approx(250.0)
        assert one.time_s[0] == pytest.approx(-0.3, abs=1e-9)
        assert np.min(np.abs(one.time_s)) == 0.0
        assert 0.8 < one.time_s[-1] - 0.3 < 2.1
    assert np.mean([one.valid.mean() for one in tracks]) > 0.99
    ends = np.array([np.nanmean(one.keypoints[-50:, 3], axis=0) for one in tracks])
    np.testing.assert_allclose(ends.mean(axis=0), TARGET, atol=0.005)
    durations = [one.duration for one in tracks]
    assert np.ptp(durations) > 0.3
    with pytest.raises(ConfigError):
        training_reaches(spec, spec.home, TARGET, 0, np.random.default_rng(0))


def test_training_for_a_scenario_covers_the_candidates():
    scenario = load_shipped("table_reach")
    tracks = scenario_training(scenario, 1, np.random.default_rng(0), n=3)
    assert list(tracks) == ["person_2"]
    starts = [np.nanmean(one.keypoints[:50, 3], axis=0) for one in tracks["person_2"]]
    np.testing.assert_allclose(np.mean(starts, axis=0), scenario.targets["person_1"], atol=0.015)
