"""Observations that stack positions and velocities, or any part of both."""

import numpy as np
import pytest
import scipy.stats
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from hri_prediction.errors import DataError
from hri_prediction.promp import PhaseBasis, ProMP, WeightFilter
from hri_prediction.promp.basis import basis_row, slope_row

DURATION = 0.8
DIMS, COUNT = 2, 5


def random_model(seed: int) -> ProMP:
    rng = np.random.default_rng(seed)
    size = DIMS * COUNT
    root = rng.standard_normal((size, size))
    covariance = root @ root.T / size + 0.05 * np.eye(size)
    return ProMP(PhaseBasis(COUNT), rng.standard_normal(size), covariance, 0.01 * np.eye(DIMS))


def random_noise(seed: int) -> np.ndarray:
    root = np.random.default_rng(seed).standard_normal((2 * DIMS, 2 * DIMS)) * 0.1
    return root @ root.T + 0.02 * np.eye(2 * DIMS)


def joint(model: ProMP, phases: np.ndarray, noise: np.ndarray) -> tuple[np.ndarray, ...]:
    """Design (T * 2 D, D * W), mean and covariance of all observations, written out."""
    position = model.basis.values(phases)
    velocity = model.basis.derivatives(phases) / DURATION
    design = np.concatenate(
        [
            np.kron(np.eye(DIMS), row)
            for pair in zip(position, velocity, strict=True)
            for row in pair
        ]
    )
    spread = design @ model.covariance @ design.T + np.kron(np.eye(phases.size), noise)
    return design, design @ model.mean, spread


def test_state_is_the_derivative_by_time():
    model, step = random_model(0), 1e-5
    phases = np.linspace(0.1, 0.9, 7)
    state = model.state_mean(phases, DURATION)
    before, after = (model.trajectory_mean(phases + s / DURATION) for s in (-step, step))
    np.testing.assert_allclose(state[:, :DIMS], model.trajectory_mean(phases))
    np.testing.assert_allclose(state[:, DIMS:], (after - before) / (2 * step), atol=1e-6)


def test_state_covariance_is_that_of_samples_written_out():
    model, phases = random_model(1), np.array([0.2, 0.7])
    found = model.state_covariance(phases, DURATION)
    for t in range(2):
        design = joint(model, phases[t : t + 1], np.eye(4))[0]
        np.testing.assert_allclose(found[t], design @ model.covariance @ design.T, atol=1e-12)
    np.testing.assert_allclose(found[:, :DIMS, :DIMS], model.trajectory_covariance(phases))


@settings(max_examples=40, deadline=None)
@given(
    st.integers(0, 1000),
    arrays(float, (3, 4), elements=st.floats(-2, 2)),
    arrays(bool, (3, 4)),
    st.permutations(range(3)),
)
def test_any_subset_is_the_exact_gaussian_conditional(seed, values, lost, order):
    model, noise = random_model(seed), random_noise(seed)
    phases = np.array([0.05, 0.4, 0.75])
    design, mean, spread = joint(model, phases, noise)
    kept = np.flatnonzero(~lost.ravel())
    values = np.where(lost, np.nan, values)
    batch = model.condition(phases, values, noise=noise, duration=DURATION)
    if kept.size:
        own, error = design[kept], values.ravel()[kept] - mean[kept]
        inner = spread[np.ix_(kept, kept)]
        gain = np.linalg.solve(inner, own @ model.covariance).T
        np.testing.assert_allclose(batch.mean, model.mean + gain @ error, atol=1e-8)
        expected = model.covariance - gain @ own @ model.covariance
        np.testing.assert_allclose(batch.covariance, expected, atol=1e-8)
        likelihood = scipy.stats.multivariate_normal(mean[kept], inner).logpdf(values.ravel()[kept])
        found = model.log_likelihood(phases, values, noise=noise, duration=DURATION)
        assert found == pytest.approx(likelihood, abs=1e-7)
    # One at a time, in any order, and in a shuffled batch.
    order = list(order)
    shuffled = model.condition(phases[order], values[order], noise=noise, duration=DURATION)
    running = WeightFilter(model)
    total = sum(running.observe(phases[i], values[i], noise, duration=DURATION) for i in order)
    for other in (shuffled, running.posterior()):
        np.testing.assert_allclose(other.mean, batch.mean, atol=1e-8)
        np.testing.assert_allclose(other.covariance, batch.covariance, atol=1e-8)
    assert total == pytest.approx(
        model.log_likelihood(phases, values, noise=noise, duration=DURATION), abs=1e-7
    )
    covariance = running.posterior().covariance
    np.testing.assert_array_equal(covariance, covariance.T)


def test_velocities_alone_are_derivatives_by_phase_over_the_duration():
    model, noise = random_model(2), random_noise(2)
    by_time = np.array([[np.nan, np.nan, 0.5, -0.3]])
    one = model.condition([0.3], by_time, noise=noise, duration=DURATION)
    by_phase = noise[DIMS:, DIMS:] * DURATION**2
    two = model.condition([0.3], by_time[:, DIMS:] * DURATION, noise=by_phase, order=1)
    np.testing.assert_allclose(one.mean, two.mean, atol=1e-10)
    np.testing.assert_allclose(one.covariance, two.covariance, atol=1e-10)


def test_filter_takes_positions_and_states_in_turn():
    model, noise = random_model(3), random_noise(3)
    state, position = np.array([0.1, 0.2, 0.3, 0.4]), np.array([0.5, np.nan])
    running = WeightFilter(model)
    running.observe(0.2, state, noise, duration=DURATION)
    running.observe(0.6, position)
    first = model.condition([0.2], state, noise=noise, duration=DURATION)
    expected = first.condition([0.6], position)
    np.testing.assert_allclose(running.posterior().mean, expected.mean, atol=1e-9)
    np.testing.assert_allclose(running.posterior().covariance, expected.covariance, atol=1e-9)


def test_noise_of_each_observation_of_its_own():
    model = random_model(4)
    phases, values = np.array([0.2, 0.6]), np.array([[0.1, 0.2, 0.3, 0.4], [0.4, 0.3, np.nan, 0.1]])
    noises = np.stack([random_noise(5), random_noise(6)])
    batch = model.condition(phases, values, noise=noises, duration=DURATION)
    running = WeightFilter(model)
    for phase, value, noise in zip(phases, values, noises, strict=True):
        running.observe(phase, value, noise, duration=DURATION)
    np.testing.assert_allclose(running.posterior().mean, batch.mean, atol=1e-9)


@given(st.integers(2, 40), st.floats(0.3, 0.95), st.floats(-0.5, 1.5))
def test_compiled_rows_are_the_formula(count, overlap, phase):
    basis = PhaseBasis(count, overlap)
    exponent = -((phase - basis.centres) ** 2) / (2 * basis.variance)
    expected = np.exp(exponent - exponent.max())
    expected /= expected.sum()
    row, slope = np.empty(count), np.empty(count)
    basis_row(phase, basis.centres, basis.variance, row)
    slope_row(phase, basis.centres, basis.variance, row, slope)
    np.testing.assert_allclose(row, expected, atol=1e-13)
    np.testing.assert_array_equal(basis.values(phase), row)
    np.testing.assert_array_equal(basis.derivatives(phase), slope)
    raw = (basis.centres - phase) / basis.variance
    np.testing.assert_allclose(slope, expected * (raw - expected @ raw), atol=1e-9)


@pytest.mark.parametrize("phase", [np.nan, np.inf, -np.inf, 1e300, -1e300])
def test_phases_that_are_none_stay_within_the_row(phase):
    row = np.full(12, 7.0)
    basis_row(phase, np.arange(8) / 7.0, 0.01, row[2:10])
    np.testing.assert_array_equal(row[[0, 1, 10, 11]], 7.0)


def test_inconsistent_observations_are_refused():
    model, noise = random_model(5), random_noise(5)
    state = np.zeros((1, 4))
    for duration in (0.0, -1.0, np.nan, np.inf):
        with pytest.raises(DataError, match="duration"):
            model.condition([0.1], state, noise=noise, duration=duration)
        with pytest.raises(DataError, match="duration"):
            WeightFilter(model).observe(0.1, state[0], noise, duration=duration)
    with pytest.raises(DataError, match="velocities without noise"):
        model.condition([0.1], state, duration=DURATION)
    with pytest.raises(DataError, match="velocities without noise"):
        WeightFilter(model).observe(0.1, state[0], duration=DURATION)
    with pytest.raises(DataError, match="order 1 with a duration"):
        model.condition([0.1], state, noise=noise, order=1, duration=DURATION)
    with pytest.raises(DataError, match="values"):
        model.condition([0.1], state[:, :2], noise=noise, duration=DURATION)
    with pytest.raises(DataError, match="noise"):
        model.condition([0.1], state[:, :2], noise=noise)
    with pytest.raises(DataError, match="shapes"):
        WeightFilter(model).observe(0.1, state[0, :2], noise, duration=DURATION)
