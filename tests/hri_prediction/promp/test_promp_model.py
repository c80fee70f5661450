"""The ProMP against closed forms, finite differences and movement_primitives."""

import numpy as np
import pytest
import scipy.stats
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from movement_primitives.promp import ProMP as ReferenceProMP
from movement_primitives.promp import via_points

from hri_prediction.errors import ConfigError, DataError
from hri_prediction.promp import PhaseBasis, ProMP, WeightFilter, load_promp, save_promp


def random_model(seed: int, dims: int = 2, count: int = 5, correlated: bool = True) -> ProMP:
    rng = np.random.default_rng(seed)
    size = dims * count
    root = rng.standard_normal((size, size))
    covariance = root @ root.T / size + 0.05 * np.eye(size)
    noise_root = rng.standard_normal((dims, dims)) * (0.1 if correlated else 0.0)
    noise = noise_root @ noise_root.T + 0.01 * np.eye(dims)
    return ProMP(PhaseBasis(count), rng.standard_normal(size), covariance, noise)


@given(st.integers(2, 20), st.floats(0.3, 0.95), st.floats(-0.2, 1.2))
def test_basis_is_a_partition_of_unity(count, overlap, phase):
    basis = PhaseBasis(count, overlap)
    assert basis.values(phase).sum() == pytest.approx(1.0)
    assert basis.derivatives(phase).sum() == pytest.approx(0.0, abs=1e-8)


def test_basis_derivative_matches_finite_differences():
    basis, z, step = PhaseBasis(8), np.linspace(0.0, 1.0, 23), 1e-6
    numeric = (basis.values(z + step) - basis.values(z - step)) / (2 * step)
    np.testing.assert_allclose(basis.derivatives(z), numeric, atol=1e-6)


@pytest.mark.parametrize("kwargs", [{"count": 1}, {"overlap": 0.0}, {"overlap": 1.0}])
def test_basis_refuses_bad_settings(kwargs):
    with pytest.raises(ConfigError):
        PhaseBasis(**kwargs)


def test_moments_match_movement_primitives():
    model, times = random_model(0, dims=3, count=6), np.linspace(0.0, 1.0, 31)
    reference = ReferenceProMP(3, 6).from_weight_distribution(model.mean, model.covariance)
    np.testing.assert_allclose(
        model.trajectory_mean(times), reference.mean_trajectory(times.copy()), atol=1e-12
    )
    variances = np.diagonal(model.trajectory_covariance(times), axis1=1, axis2=2)
    np.testing.assert_allclose(variances, reference.var_trajectory(times.copy()), atol=1e-12)
    np.testing.assert_allclose(
        model.trajectory_mean(times, order=1), reference.mean_velocities(times.copy()), atol=1e-9
    )
    speeds = np.diagonal(model.trajectory_covariance(times, order=1), axis1=1, axis2=2)
    np.testing.assert_allclose(speeds, reference.var_velocities(times.copy()), rtol=1e-8)


def test_conditioning_matches_movement_primitives():
    model = random_model(1, dims=1, count=7)
    times, values = np.array([0.1, 0.4, 0.7]), np.array([[0.2], [-0.3], [1.0]])
    reference = ReferenceProMP(1, 7).from_weight_distribution(model.mean, model.covariance)
    noise = np.full((3, 1), 0.01)
    expected = via_points(reference, times, values, noise)
    found = model.condition(times, values, noise=np.array([[0.01]]))
    np.testing.assert_allclose(found.mean, expected.weight_mean, atol=1e-9)
    np.testing.assert_allclose(found.covariance, expected.weight_cov, atol=1e-9)


def test_conditioning_is_the_gaussian_formula_and_a_new_object():
    model = random_model(2)
    before = model.mean.copy()
    rows = np.kron(np.eye(2), model.basis.values([0.3]))
    value = np.array([0.5, -0.5])
    gain = np.linalg.solve(
        rows @ model.covariance @ rows.T + model.noise, rows @ model.covariance
    ).T
    found = model.condition([0.3], value)
    np.testing.assert_allclose(found.mean, before + gain @ (value - rows @ before), atol=1e-10)
    np.testing.assert_allclose(
        found.covariance, model.covariance - gain @ rows @ model.covariance, atol=1e-10
    )
    np.testing.assert_array_equal(model.mean, before)
    with pytest.raises(ValueError, match="read-only"):
        model.mean[0] = 1.0


@settings(max_examples=30, deadline=None)
@given(
    st.integers(0, 1000),
    arrays(float, (6, 2), elements=st.floats(-2, 2)),
    arrays(bool, (6, 2)),
    st.permutations(range(6)),
)
def test_order_does_not_matter_and_batch_equals_incremental(seed, values, lost, order):
    model = random_model(seed)
    phases = np.linspace(0.0, 0.9, 6)
    values = np.where(lost, np.nan, values)
    order = list(order)
    batch = model.condition(phases, values)
    shuffled = model.condition(phases[order], values[order])
    running = WeightFilter(model)
    total = sum(running.observe(phases[i], values[i]) for i in order)
    for other in (shuffled, running.posterior()):
        np.testing.assert_allclose(other.mean, batch.mean, atol=1e-8)
        np.testing.assert_allclose(other.covariance, batch.covariance, atol=1e-8)
    assert total == pytest.approx(model.log_likelihood(phases, values), abs=1e-7)
    covariance = running.posterior().covariance
    np.testing.assert_array_equal(covariance, covariance.T)
    assert np.linalg.eigvalsh(covariance).min() > 0.0


def test_mask_equals_missing_and_other_dimensions_profit():
    model = random_model(3)
    values = np.array([[0.4, 0.7]])
    masked = model.condition([0.5], values, mask=[True, False])
    missing = model.condition([0.5], np.array([[0.4, np.nan]]))
    np.testing.assert_allclose(masked.mean, missing.mean)
    before = model.trajectory_covariance([0.5])[0, 1, 1]
    assert missing.trajectory_covariance([0.5])[0, 1, 1] < before
    assert model.condition([0.5], [[np.nan, np.nan]]) is model


def test_velocity_observations_shape_the_slope():
    model = random_model(4)
    found = model.condition([0.5], [[1.0, -1.0]], noise=np.eye(2) * 1e-8, order=1)
    np.testing.assert_allclose(found.trajectory_mean([0.5], order=1)[0], [1.0, -1.0], atol=1e-3)


def test_log_likelihood_matches_scipy():
    model, phases = random_model(5), np.array([0.1, 0.5, 0.8])
    rows = np.kron(np.eye(2), model.basis.values(phases))
    covariance = rows @ model.covariance @ rows.T + np.kron(model.noise, np.eye(3))
    values = np.random.default_rng(0).standard_normal((3, 2))
    expected = scipy.stats.multivariate_normal(rows @ model.mean, covariance).logpdf(
        values.T.ravel()
    )
    assert model.log_likelihood(phases, values) == pytest.approx(expected)


def test_samples_have_the_moments_of_the_model():
    model, phases = random_model(6), np.array([0.0, 0.5, 1.0])
    draws = model.sample(phases, np.random.default_rng(1), 20000)
    spread = model.trajectory_covariance(phases)
    tolerance = 5.0 * np.sqrt(spread.max() / 20000)
    np.testing.assert_allclose(draws.mean(axis=0), model.trajectory_mean(phases), atol=tolerance)
    for t in range(3):
        np.testing.assert_allclose(np.cov(draws[:, t].T), spread[t], atol=0.05 * spread.max())
    again = model.sample(phases, np.random.default_rng(1), 20000)
    np.testing.assert_array_equal(draws, again)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 200), st.integers(0, 200))
def test_kl_is_a_divergence(first, second):
    one, two = random_model(first), random_model(second)
    assert one.kl_divergence(two) >= 0.0
    assert one.kl_divergence(one) == pytest.approx(0.0, abs=1e-9)


def test_kl_closed_form_in_one_dimension_scale():
    basis, eye = PhaseBasis(2), np.eye(2)
    narrow = ProMP(basis, np.zeros(2), eye, np.eye(1))
    wide = ProMP(basis, np.ones(2), 4.0 * eye, np.eye(1))
    expected = 2 * 0.5 * (0.25 + 0.25 - 1.0 + np.log(4.0))
    assert narrow.kl_divergence(wide) == pytest.approx(expected)


def test_saved_and_loaded_model_is_the_same(tmp_path):
    model = random_model(7)
    save_promp(tmp_path / "m.npz", model)
    loaded = load_promp(tmp_path / "m.npz")
    np.testing.assert_array_equal(loaded.covariance, model.covariance)
    assert loaded.basis == model.basis


@pytest.mark.parametrize("content", [b"", b"not a zip", b"PK\x03\x04broken"])
def test_damaged_files_give_one_typed_error(tmp_path, content):
    path = tmp_path / "bad.npz"
    path.write_bytes(content)
    with pytest.raises(DataError, match=r"bad\.npz"):
        load_promp(path)
    with pytest.raises(DataError):
        load_promp(tmp_path / "absent.npz")
    np.savez(tmp_path / "foreign.npz", header=np.array('{"format": "other"}'))
    with pytest.raises(DataError, match="other"):
        load_promp(tmp_path / "foreign.npz")


def test_inconsistent_input_is_refused():
    model = random_model(8)
    with pytest.raises(DataError):
        ProMP(model.basis, model.mean[:-1], model.covariance, model.noise)
    with pytest.raises(DataError):
        ProMP(model.basis, model.mean * np.nan, model.covariance, model.noise)
    with pytest.raises(DataError):
        model.condition([0.1, 0.2], [[0.0, 0.0]])
    with pytest.raises(DataError):
        model.condition([0.1], [[0.0, 0.0]], noise=-np.eye(2))
    with pytest.raises(DataError):
        WeightFilter(model).observe(0.1, [0.0, 0.0], noise=-10.0 * np.eye(2))
    with pytest.raises(DataError):
        model.trajectory_mean([0.1], order=2)
