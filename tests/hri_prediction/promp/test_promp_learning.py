"""Learning from few demonstrations."""

import numpy as np
import pytest

from hri_prediction.errors import ConfigError, DataError
from hri_prediction.promp import (
    Demonstration,
    LearningConfig,
    PhaseBasis,
    ProMP,
    WeightPrior,
    learn,
)
from hri_prediction.promp.regression import fit_weights

PHASES = np.linspace(0.0, 1.0, 31)


def demonstrations(count: int, seed: int = 0, dims: int = 2) -> list[Demonstration]:
    rng = np.random.default_rng(seed)
    rise = PHASES**3 * (10 - 15 * PHASES + 6 * PHASES**2)
    return [
        Demonstration(
            PHASES,
            rise[:, None] * (0.3 + 0.03 * rng.standard_normal(dims))
            + 0.001 * rng.standard_normal((31, dims)),
        )
        for _ in range(count)
    ]


def test_ridge_recovers_weights_of_its_own_curves():
    basis, rng = PhaseBasis(8), np.random.default_rng(0)
    weights = rng.standard_normal(16)
    curve = basis.values(PHASES) @ weights.reshape(2, 8).T
    np.testing.assert_allclose(fit_weights(basis, PHASES, curve, 0.0), weights, atol=1e-5)


def test_ridge_does_not_pull_towards_the_origin():
    found = fit_weights(PhaseBasis(8), PHASES, np.full((31, 1), 5.0), 10.0)
    np.testing.assert_allclose(found, 5.0)


@pytest.mark.parametrize("count", [1, 2, 5, 10])
def test_few_demonstrations_give_a_positive_definite_covariance(count):
    model = learn(demonstrations(count, dims=6), LearningConfig())
    assert np.linalg.cond(model.covariance) < 1e7
    assert np.linalg.eigvalsh(model.covariance).min() > 0.0
    other = learn(demonstrations(count, seed=1, dims=6), LearningConfig())
    assert np.isfinite(model.kl_divergence(other))


def test_mean_follows_the_demonstrations():
    demos = demonstrations(10)
    model = learn(demos)
    expected = np.mean([d.values for d in demos], axis=0)
    np.testing.assert_allclose(model.trajectory_mean(PHASES), expected, atol=2e-3)


def test_true_distribution_is_recovered_from_many_demonstrations():
    rng = np.random.default_rng(3)
    basis, size = PhaseBasis(5), 10
    root = rng.standard_normal((size, size)) * 0.05
    truth = ProMP(
        basis, rng.standard_normal(size), root @ root.T + 1e-4 * np.eye(size), np.eye(2) * 0.005**2
    )
    curves = truth.sample(PHASES, rng, 300)
    curves = curves + 0.005 * rng.standard_normal(curves.shape)
    config = LearningConfig(weights_per_dim=5, prior_strength=1.0, noise_floor=1e-4)
    model = learn([Demonstration(PHASES, c) for c in curves], config)
    np.testing.assert_allclose(np.diag(model.noise), 0.005**2, rtol=0.1)
    spread = truth.trajectory_covariance(PHASES)
    error = np.abs(model.trajectory_covariance(PHASES) - spread).max()
    assert error < 0.25 * spread.max()


def test_missing_stretches_are_left_out():
    demos = demonstrations(5)
    values = demos[0].values.copy()
    values[5:15, 1] = np.nan
    model = learn([Demonstration(PHASES, values), *demos[1:]])
    assert np.isfinite(model.mean).all()
    np.testing.assert_allclose(
        model.trajectory_mean(PHASES), learn(demos).trajectory_mean(PHASES), atol=5e-3
    )


def test_prior_mean_dominates_without_evidence_and_fades_with_it():
    prior_mean = np.ones(16)
    few, many = (
        learn(
            demonstrations(count),
            prior=WeightPrior(prior_mean, 3.0, np.eye(16) * 0.01, 4.0),
        ).trajectory_mean([1.0])[0, 0]
        for count in (1, 30)
    )
    assert 0.75 < few < 0.95
    assert many < 0.45


def test_weight_counts_like_repetition():
    demos = demonstrations(3)
    config = LearningConfig(iterations=1)
    prior = WeightPrior(None, 0.0, np.eye(16) * 0.01, 4.0)
    doubled = [Demonstration(d.phases, d.values, 2.0) for d in demos]
    one = learn(doubled, config, prior)
    two = learn([*demos, *demos], config, prior)
    np.testing.assert_allclose(one.mean, two.mean, atol=1e-10)
    np.testing.assert_allclose(one.covariance, two.covariance, atol=1e-10)


def test_bad_input_is_refused():
    with pytest.raises(DataError):
        learn([])
    with pytest.raises(DataError):
        learn([Demonstration(PHASES, np.zeros((30, 2)))])
    with pytest.raises(DataError):
        learn([Demonstration(PHASES, np.full((31, 1), np.nan))])
    with pytest.raises(ConfigError):
        LearningConfig(prior_strength=0.0)
