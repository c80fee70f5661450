"""Scores of the newest predictions: figures of a known distribution, and of the predictor's own."""

import numpy as np
import pytest
from scipy.stats import chi2, multivariate_normal

from hri_prediction.prediction import PredictorConfig, ReachPredictor, ReachState
from hri_prediction.prediction.live_scores import KEPT, REGION_50, REGION_95, LiveScores

COVARIANCE = np.array([[4e-4, 1e-4, 0.0], [1e-4, 2e-4, 5e-5], [0.0, 5e-5, 1e-4]])


def test_regions_are_those_of_the_distribution():
    assert chi2.ppf(0.50, 3) == pytest.approx(REGION_50, rel=1e-12)
    assert chi2.ppf(0.95, 3) == pytest.approx(REGION_95, rel=1e-12)


def test_figures_are_those_of_the_newest():
    errors = np.random.default_rng(0).multivariate_normal(np.zeros(3), COVARIANCE, KEPT)
    scores = LiveScores()
    for _ in range(50):
        scores.add(0.1, np.full(3, 9.0), COVARIANCE)  # long ago
    for error in errors:
        scores.add(0.1, error, COVARIANCE)
    scores.add(0.5, np.array([0.03, 0.0, 0.04]), COVARIANCE)
    found = scores.figures()
    assert list(found) == [0.1, 0.5]
    distances = np.linalg.norm(errors, axis=1)
    assert found[0.1].n == KEPT
    assert found[0.1].error_median_m == pytest.approx(np.median(distances))
    assert found[0.1].error_mean_m == pytest.approx(distances.mean())
    assert found[0.1].coverage50 == pytest.approx(0.50, abs=0.06)
    assert found[0.1].coverage95 == pytest.approx(0.95, abs=0.03)
    density = multivariate_normal(np.zeros(3), COVARIANCE).logpdf(errors)
    assert found[0.1].nll == pytest.approx(-density.mean())
    assert found[0.5].n == 1
    assert found[0.5].error_median_m == found[0.5].error_mean_m == pytest.approx(0.05)


def test_the_predictor_scores_what_it_published(library, reach_maker):
    """Errors, and squares with the factor of then, are those of ``predict()`` against the samples."""
    config = PredictorConfig(calibration_rate=1.0)  # one miss counts
    predictor = ReachPredictor(library, config)
    assert predictor.live_figures() == {}
    # Elsewhere than what was learnt: regions widen.
    target = np.array([-0.4, 0.1, 0.15])
    track = reach_maker("left bin", np.random.default_rng(3), 50.0, target=target, duration=1.2)
    samples, said = {}, {}
    for sample in track.samples(10_000_000_000):
        predictor.observe(sample)
        samples[sample.stamp_ns // 10_000_000] = sample.keypoints[2]
        prediction = predictor.predict()
        if prediction.state == ReachState.REACHING:
            said[sample.stamp_ns // 10_000_000] = prediction
    found = predictor.live_figures()
    assert list(found) == [0.1, 0.2, 0.5]
    for horizon_s, figures in found.items():
        index = round(horizon_s / config.step)
        errors, densities = [], []
        for at, prediction in said.items():
            seen = samples.get(at + round(100 * horizon_s))
            if seen is not None:
                mean, covariance = prediction.mean[index, 2], prediction.covariance[index, 2]
                errors.append(np.linalg.norm(seen - mean))
                densities.append(multivariate_normal(mean, covariance).logpdf(seen))
        assert figures.n == len(errors) > 40
        assert figures.error_median_m == pytest.approx(np.median(errors), abs=1e-4)
        assert figures.nll == pytest.approx(-np.mean(densities), abs=0.01)
    predictor.reset()
    assert predictor.live_figures() == {}
