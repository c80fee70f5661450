"""The bank of (task, duration) hypotheses."""

import dataclasses

import numpy as np
import pytest

from hri_prediction.prediction.bank import (
    HypothesisBank,
    bank_prior,
    position_moments,
)
from hri_prediction.prediction.config import PredictorConfig
from hri_prediction.prediction.unknown import UNKNOWN, unknown_task
from hri_prediction.promp.model import ProMP
from hri_prediction.tracks.bell import from_rest_to_rest

SEEN = np.ones(6, dtype=bool)


def feed(bank, task, duration, until, lost=None):
    """Observe the mean path of a task at a duration, up to a share of it."""
    for t in np.arange(0.0, until * duration, 0.02):
        value = task.promp.trajectory_mean([min(1.0, t / duration)])[0]
        bank.observe(t, value, SEEN if lost is None else ~lost)


def test_prior_is_normalised_and_covers_all_tasks(library, config):
    prior = bank_prior(library.tasks, config)
    assert np.exp(prior.log_prior).sum() == pytest.approx(1.0)
    assert prior.names[-1] == UNKNOWN
    assert prior.durations.shape == ((len(library.tasks) + 1) * config.durations,)
    bank = HypothesisBank(prior, config)
    probabilities = bank.task_probabilities()
    assert probabilities[-1] == pytest.approx(config.unknown_probability)


def test_single_hypothesis_is_plain_conditioning(library, config):
    one = dataclasses.replace(config, durations=1)
    task = library.tasks[0]
    bank = HypothesisBank(bank_prior((task,), one), one)
    times = np.arange(0.0, 0.4, 0.02)
    values = task.promp.trajectory_mean(times / 0.9) + 0.01
    for t, v in zip(times, values, strict=True):
        bank.observe(t, v, SEEN)
    phases = times / bank.prior.durations[0]
    expected = task.promp.condition(phases, values, noise=bank.prior.noises[0])
    np.testing.assert_allclose(bank.means[0], expected.mean, atol=1e-8)
    np.testing.assert_allclose(bank.covariances[0], expected.covariance, atol=1e-9)
    mean, blocks, half = np.empty(6), np.empty((2, 3, 3)), np.empty(24)
    row = expected.basis.values(0.7)
    position_moments(bank.means[0], bank.covariances[0], row, half, mean, blocks)
    np.testing.assert_allclose(mean, expected.trajectory_mean([0.7])[0], atol=1e-9)
    full = expected.trajectory_covariance([0.7])[0]
    np.testing.assert_allclose(blocks[0], full[:3, :3], atol=1e-9)
    np.testing.assert_allclose(blocks[1], full[3:, 3:], atol=1e-9)


@pytest.mark.parametrize("index", [0, 1])
@pytest.mark.parametrize("scale", [0.85, 1.2])
def test_task_and_duration_are_found(library, config, index, scale):
    task = library.tasks[index]
    duration = scale * task.duration_mean_s
    bank = HypothesisBank(bank_prior(library.tasks, config), config)
    feed(bank, task, duration, 0.6)
    assert bank.task_probabilities()[index] > 0.9
    assert bank.weights.sum() == pytest.approx(1.0)
    mean, deviation = bank.duration()
    phases = np.linspace(0.0, 1.0, 201)
    wrist = task.promp.trajectory_mean(phases)[:, 3:]
    peak = np.linalg.norm(np.gradient(wrist, phases * duration, axis=0), axis=1).max()
    whole = from_rest_to_rest(duration, config.onset_speed / peak)
    assert mean == pytest.approx(float(whole), rel=0.12)
    assert 0.0 < deviation < 0.2


def test_mixture_moments_are_those_of_its_parts(library, config):
    wide = dataclasses.replace(config, durations=3)
    bank = HypothesisBank(bank_prior(library.tasks, wide), wide)
    bank.observe(0.1, library.tasks[0].promp.trajectory_mean([0.1])[0], SEEN)
    weights = bank.weights
    weights[weights < 1e-3 * weights.max()] = 0.0
    weights /= weights.sum()
    mean, covariance = bank.moments(0.1, 0.3, 3)
    basis, blocks, first = bank.prior.basis, np.empty((2, 3, 3)), np.empty(6)
    half = np.empty(3 * basis.count)
    for k, t in enumerate((0.1, 0.4, 0.7)):
        total, second = np.zeros(6), np.zeros((2, 3, 3))
        for h, weight in enumerate(weights):
            row = basis.values(min(1.0, t / bank.prior.durations[h]))
            position_moments(bank.means[h], bank.covariances[h], row, half, first, blocks)
            total += weight * first
            points = first.reshape(2, 3)
            second += weight * (blocks + np.einsum("bi,bj->bij", points, points))
        points = total.reshape(2, 3)
        np.testing.assert_allclose(mean[k].ravel(), total, atol=1e-9)
        expected = second - np.einsum("bi,bj->bij", points, points)
        np.testing.assert_allclose(covariance[k], expected, atol=1e-9)
    assert np.linalg.eigvalsh(covariance).min() > 0.0


def test_belief_in_a_task_is_lost_when_the_hand_is_elsewhere(library, config):
    first, second = library.tasks
    bank = HypothesisBank(bank_prior(library.tasks, config), config)
    feed(bank, first, 1.0, 0.5)
    assert bank.task_probabilities()[0] > 0.9
    for t in np.arange(0.5, 1.0, 0.02):
        bank.observe(t, second.promp.trajectory_mean([t])[0], SEEN)
    assert bank.task_probabilities()[0] < 0.5


def test_a_reach_of_no_task_is_unknown(library, config):
    bank = HypothesisBank(bank_prior(library.tasks, config), config)
    start = library.tasks[0].promp.trajectory_mean([0.0])[0]
    away = np.array([0.1, 0.1, 0.3, 0.2, 0.2, 0.6])
    for t in np.arange(0.0, 0.6, 0.02):
        z = t / 0.9
        bank.observe(t, start + away * z**3 * (10 - 15 * z + 6 * z**2), SEEN)
    assert bank.task_probabilities()[-1] > 0.9
    mean, covariance = bank.moments(0.6, 0.1, 4)
    error = mean[-1, 1] - (start + away)[3:]
    # Wrong by centimetres at most, and aware of it.
    assert error @ np.linalg.solve(covariance[-1, 1], error) < 16.3


def test_elbow_alone_tells_the_task(library, config):
    bank = HypothesisBank(bank_prior(library.tasks, config), config)
    lost = np.array([False] * 3 + [True] * 3)
    feed(bank, library.tasks[1], library.tasks[1].duration_mean_s, 0.7, lost)
    assert bank.task_probabilities()[1] > 0.8


def test_mean_rests_after_the_end(library, config):
    bank = HypothesisBank(bank_prior(library.tasks, config), config)
    feed(bank, library.tasks[0], 0.9, 0.9)
    mean, _ = bank.moments(0.8, 0.5, 8)
    np.testing.assert_allclose(mean[-1], mean[-2], atol=1e-12)


def test_likeliest_task_alone(library):
    config = PredictorConfig(output="likeliest")
    bank = HypothesisBank(bank_prior(library.tasks, config), config)
    feed(bank, library.tasks[0], 0.9, 0.2)
    mean, _ = bank.moments(0.2, 0.1, 20)
    np.testing.assert_allclose(
        mean[-1, 1], library.tasks[0].promp.trajectory_mean([1.0])[0, 3:], atol=0.03
    )


def test_restart_forgets(library, config):
    bank = HypothesisBank(bank_prior(library.tasks, config), config)
    feed(bank, library.tasks[0], 0.9, 0.5)
    bank.restart()
    np.testing.assert_array_equal(bank.means, bank.prior.means)
    np.testing.assert_array_equal(bank.log_weights, bank.prior.log_prior)


def test_unknown_task_reaches_anywhere(library, config):
    task = unknown_task(library.tasks, config)
    model = task.promp
    start, end = model.trajectory_covariance([0.0, 1.0])
    assert np.linalg.eigvalsh(model.covariance).min() > 0.0
    assert end[3, 3] - start[3, 3] == pytest.approx(config.unknown_sd**2, rel=0.2)


def test_unknown_task_is_as_long_and_lasts_as_long_as_the_known_ones(library, config):
    usual = np.exp(np.mean([np.log(task.duration_mean_s) for task in library.tasks]))
    task = unknown_task(library.tasks, config)
    assert task.duration_mean_s == pytest.approx(usual, rel=0.05)
    assert task.duration_log_sd >= config.unknown_duration_sd
    slow = tuple(
        dataclasses.replace(known, duration_mean_s=2.0 * known.duration_mean_s)
        for known in library.tasks
    )
    assert unknown_task(slow, config).duration_mean_s == pytest.approx(2.0 * task.duration_mean_s)
    # Reaches three times as long: an unknown one may be as long as these.
    far = tuple(
        dataclasses.replace(
            known,
            promp=ProMP(
                known.promp.basis,
                3.0 * known.promp.mean,
                known.promp.covariance,
                known.promp.noise,
            ),
        )
        for known in library.tasks
    )
    spread = unknown_task(far, config).promp.trajectory_covariance([0.0, 1.0])
    length = [np.ptp(known.promp.trajectory_mean([0.0, 1.0])[:, 3:], axis=0) for known in far]
    expected = float(np.mean(np.square(length)))
    assert expected > config.unknown_sd**2
    assert spread[1, 3, 3] - spread[0, 3, 3] == pytest.approx(expected, rel=0.2)


def test_small_noise_is_raised_without_losing_its_correlations(library, config):
    task = library.tasks[0]
    factor = np.eye(6) + 0.3 * np.tri(6, k=-1) * np.where(np.arange(6) % 2, 1.0, -1.0)
    correlated = 0.5 * config.noise_sd**2 * factor @ factor.T
    assert correlated.min() < 0.0
    promp = ProMP(task.promp.basis, task.promp.mean, task.promp.covariance, correlated)
    noise = bank_prior((dataclasses.replace(task, promp=promp),), config).noises[0]
    assert np.diag(noise).min() == pytest.approx(config.noise_sd**2)
    off = ~np.eye(6, dtype=bool)
    np.testing.assert_array_equal(noise[off], correlated[off])
    assert np.linalg.eigvalsh(noise).min() > 0.0
