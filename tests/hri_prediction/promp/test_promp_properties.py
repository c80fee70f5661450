"""What must hold of any ProMP: immutability, KL, accuracy over long runs, EM that climbs."""

import dataclasses
import pickle

import numpy as np
import pytest
import scipy.stats
from hypothesis import given, settings
from hypothesis import strategies as st
from movement_primitives.promp import ProMP as ReferenceProMP

from hri_prediction.errors import DataError
from hri_prediction.promp import (
    Demonstration,
    LearningConfig,
    PhaseBasis,
    ProMP,
    WeightFilter,
    WeightPrior,
    learn,
    load_promp,
)
from hri_prediction.promp.learning import smooth_covariance
from hri_prediction.promp.regression import gather_evidence


def random_model(seed: int, dims: int = 2, count: int = 4) -> ProMP:
    rng = np.random.default_rng(seed)
    size = dims * count
    root = rng.standard_normal((size, size))
    covariance = root @ root.T / size + 0.2 * np.eye(size)
    return ProMP(PhaseBasis(count), rng.standard_normal(size), covariance, 0.01 * np.eye(dims))


# ------------------------------------------------------------------ immutability
def test_a_model_and_what_made_it_are_apart():
    mean, covariance, noise = np.zeros(8), np.eye(8), np.eye(2)
    model = ProMP(PhaseBasis(4), mean, covariance, noise)
    mean[:], covariance[:], noise[:] = 9.0, 9.0, 9.0
    np.testing.assert_array_equal(model.mean, 0.0)
    np.testing.assert_array_equal(model.covariance, np.eye(8))
    np.testing.assert_array_equal(model.noise, np.eye(2))
    for array in (model.mean, model.covariance, model.noise):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0
    with pytest.raises(dataclasses.FrozenInstanceError):
        model.mean = mean  # type: ignore[misc]


def test_filter_leaves_prior_and_earlier_posteriors_alone():
    model = random_model(0)
    before = [a.copy() for a in (model.mean, model.covariance)]
    running = WeightFilter(model)
    running.observe(0.1, [1.0, 2.0])
    first = running.posterior()
    kept = first.covariance.copy()
    running.observe(0.5, [0.0, -1.0])
    np.testing.assert_array_equal(first.covariance, kept)
    np.testing.assert_array_equal(model.mean, before[0])
    np.testing.assert_array_equal(model.covariance, before[1])
    with pytest.raises(DataError):
        running.observe(0.6, [0.0, 0.0], -10.0 * np.eye(2))
    after = running.posterior()
    running.observe(0.7, [np.nan, np.nan])
    np.testing.assert_array_equal(running.posterior().mean, after.mean)


# ------------------------------------------------------------------ divergence
@settings(max_examples=25, deadline=None)
@given(st.integers(0, 500), st.integers(0, 500))
def test_kl_against_samples(first, second):
    one, two = random_model(first), random_model(second)
    draws = one.sample_weights(np.random.default_rng(0), 20_000)
    own, other = (scipy.stats.multivariate_normal(m.mean, m.covariance) for m in (one, two))
    gaps = own.logpdf(draws) - other.logpdf(draws)
    error = gaps.std() / np.sqrt(gaps.size)
    assert one.kl_divergence(two) == pytest.approx(gaps.mean(), abs=6.0 * error + 1e-9)


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 500), st.integers(0, 500))
def test_kl_knows_no_coordinates_and_shrinks_with_what_is_ignored(first, second):
    one, two = random_model(first), random_model(second)
    turn = np.random.default_rng(first).standard_normal((8, 8)) + 3.0 * np.eye(8)

    def mapped(model: ProMP) -> ProMP:
        covariance = turn @ model.covariance @ turn.T
        return dataclasses.replace(
            model, mean=turn @ model.mean, covariance=0.5 * (covariance + covariance.T)
        )

    def first_dimension(model: ProMP) -> ProMP:
        return ProMP(model.basis, model.mean[:4], model.covariance[:4, :4], np.eye(1))

    whole = one.kl_divergence(two)
    assert mapped(one).kl_divergence(mapped(two)) == pytest.approx(whole, rel=1e-5, abs=1e-7)
    assert first_dimension(one).kl_divergence(first_dimension(two)) <= whole + 1e-9
    if first != second:
        assert whole > 0.0
    with pytest.raises(DataError):
        one.kl_divergence(first_dimension(two))


# ------------------------------------------------------------------ conditioning
def test_conditioning_of_several_dimensions_matches_movement_primitives():
    model = random_model(3, dims=3, count=6)
    noise = np.diag([0.01, 0.02, 0.03])
    theirs = ReferenceProMP(3, 6).from_weight_distribution(model.mean, model.covariance)
    running = WeightFilter(model)
    for phase in np.linspace(0.0, 1.0, 21):
        value = np.sin([phase, 2.0 * phase, 3.0 * phase])
        theirs = theirs.condition_position(value, noise, phase)
        running.observe(phase, value, noise)
    found = running.posterior()
    np.testing.assert_allclose(found.mean, theirs.weight_mean, atol=1e-8)
    np.testing.assert_allclose(found.covariance, theirs.weight_cov, atol=1e-8)


def test_thousands_of_exact_observations_leave_a_covariance():
    basis, dims = PhaseBasis(40), 3
    prior = smooth_covariance(basis, dims, LearningConfig())
    model = ProMP(basis, np.zeros(120), 0.3**2 * prior, np.eye(dims) * 0.001**2)
    phases = np.linspace(0.0, 1.0, 3000)
    values = np.stack([np.sin(phases), np.cos(3.0 * phases), phases**2], axis=1)
    running = WeightFilter(model)
    for phase, value in zip(phases, values, strict=True):
        running.observe(phase, value)
    found, batch = running.posterior(), model.condition(phases, values)
    np.testing.assert_array_equal(found.covariance, found.covariance.T)
    assert np.linalg.eigvalsh(found.covariance).min() > 0.0
    np.testing.assert_allclose(found.mean, batch.mean, atol=1e-8)
    np.testing.assert_allclose(found.covariance, batch.covariance, atol=1e-10)
    assert found.kl_divergence(batch) < 1e-6


# ------------------------------------------------------------------ learning
def reaches(count: int, lost: float = 0.0, same_phases: bool = True) -> list[Demonstration]:
    rng = np.random.default_rng(4)
    found = []
    for _ in range(count):
        phases = np.linspace(0.0, 1.0, 31) if same_phases else np.sort(rng.uniform(0.0, 1.0, 31))
        rise = phases**3 * (10.0 - 15.0 * phases + 6.0 * phases**2)
        values = rise[:, None] * (0.3 + 0.03 * rng.standard_normal(2)) + 5.0
        values = values + 0.01 * rng.standard_normal((31, 2))
        values[rng.uniform(size=values.shape) < lost] = np.nan
        found.append(Demonstration(phases, values, float(rng.uniform(0.5, 1.0))))
    return found


@pytest.mark.parametrize(("lost", "same"), [(0.0, True), (0.0, False), (0.2, True)])
def test_em_climbs_the_penalised_likelihood(lost, same):
    demos = reaches(5, lost, same)
    basis, share = PhaseBasis(6), sum(d.weight for d in demos)
    prior = WeightPrior(
        np.full(12, 5.1), 0.5, 0.02**2 * smooth_covariance(basis, 2, LearningConfig()), 3.0
    )

    def objective(iterations: int) -> float:
        config = LearningConfig(
            weights_per_dim=6, iterations=iterations, tolerance=0.0, noise_floor=1e-4
        )
        model = learn(demos, config, prior)
        # What learn() returns is widened for the next demonstration.
        covariance = model.covariance / (1.0 + 1.0 / (share + prior.mean_strength))
        plain = dataclasses.replace(model, covariance=covariance)
        total = sum(d.weight * plain.log_likelihood(d.phases, d.values) for d in demos)
        shift = plain.mean - prior.mean
        log_det = np.linalg.slogdet(covariance)[1]
        trace = np.trace(np.linalg.solve(covariance, prior.covariance))
        total -= 0.5 * prior.strength * (log_det + trace)
        return total - 0.5 * prior.mean_strength * shift @ np.linalg.solve(covariance, shift)

    values = [objective(k) for k in (1, 2, 3, 5, 10, 40)]
    assert (np.diff(values) > -1e-8).all()
    assert values[-1] > values[0]


def test_demonstrations_learnt_together_are_as_each_alone():
    # With a tiny difference in phase no two share their statistics any more.
    demos = reaches(6, lost=0.1)
    apart = [
        dataclasses.replace(d, phases=d.phases * (1.0 - 1e-13 * i)) for i, d in enumerate(demos)
    ]
    plain = reaches(6)
    plain_apart = [
        dataclasses.replace(d, phases=d.phases * (1.0 - 1e-13 * i)) for i, d in enumerate(plain)
    ]
    assert len(gather_evidence(PhaseBasis(8), plain, 1e-6)) == 1
    assert len(gather_evidence(PhaseBasis(8), plain_apart, 1e-6)) == 6
    for one, two in ((demos, apart), (plain, plain_apart)):
        first, second = learn(one), learn(two)
        np.testing.assert_allclose(first.mean, second.mean, atol=1e-10)
        np.testing.assert_allclose(first.covariance, second.covariance, atol=1e-12)
        np.testing.assert_allclose(first.noise, second.noise, atol=1e-12)


# ------------------------------------------------------------------ storage
class Trap:
    def __reduce__(self):
        return (pytest.fail, ("code of a file was run",))


def test_pickles_are_not_opened(tmp_path):
    np.savez(
        tmp_path / "trap.npz",
        header=np.array([Trap()], dtype=object),
        mean=np.zeros(4),
    )
    with pytest.raises(DataError, match="trap"):
        load_promp(tmp_path / "trap.npz")
    (tmp_path / "bare.npz").write_bytes(pickle.dumps(Trap()))
    with pytest.raises(DataError, match="bare"):
        load_promp(tmp_path / "bare.npz")
