"""What a person's reaches add to a first guess."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hri_prediction.errors import DataError
from hri_prediction.hybrid.config import HybridConfig
from hri_prediction.hybrid.personal import PersonalPrior, learn_personal, personal_prior
from hri_prediction.hybrid.task import duration_of
from hri_prediction.promp.basis import PhaseBasis
from hri_prediction.promp.linalg import cholesky

BASIS = PhaseBasis(8)
PRIOR = personal_prior(BASIS, np.full(48, 0.3), HybridConfig(), 0.4)


def test_nothing_seen_is_the_prior():
    known = learn_personal(PRIOR, np.zeros((0, 48)))
    np.testing.assert_array_equal(known.mean, 0.0)
    np.testing.assert_array_equal(known.covariance, PRIOR.systematic + PRIOR.scatter)


def test_the_prior_is_as_wide_as_the_settings_say():
    config = HybridConfig(scale_sd=0.0)
    prior = personal_prior(BASIS, np.full(48, 0.3), config, 0.4)
    row = np.zeros(48)
    row[3 * 8 : 4 * 8] = BASIS.values([0.0])[0]
    at_start = np.sqrt(row @ prior.systematic @ row)
    # No drift at the begin; the detour smooths away a little.
    expected = np.hypot(config.offset_sd, config.detour_sd)
    assert at_start == pytest.approx(expected, rel=0.05)


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**31), st.integers(1, 60))
def test_what_is_open_shrinks_and_covariances_stay_ones(seed, count):
    rng = np.random.default_rng(seed)
    deviations = 0.03 * rng.standard_normal((count, 48))
    known = learn_personal(PRIOR, deviations)
    cholesky(known.covariance, "covariance")
    # S is below S_0 in every direction.
    assert np.linalg.eigvalsh(PRIOR.systematic - known.systematic).min() > -1e-9


def test_many_reaches_are_believed(rng):
    truth = 0.05 * np.ones(48)
    factor = np.linalg.cholesky(PRIOR.scatter)
    deviations = truth + rng.standard_normal((400, 48)) @ factor.T
    known = learn_personal(PRIOR, deviations)
    np.testing.assert_allclose(known.mean, truth, atol=0.004)
    ratio = np.trace(known.scatter) / np.trace(PRIOR.scatter)
    assert ratio == pytest.approx(1.0, abs=0.1)
    assert np.trace(known.systematic) < 0.01 * np.trace(PRIOR.systematic)


def test_the_mean_is_that_of_the_normal_model_when_spread_is_known(rng):
    """With the spread as good as known, the posterior mean has a closed form."""
    prior = PersonalPrior(PRIOR.systematic, PRIOR.scatter, 1e9)
    deviations = 0.03 * rng.standard_normal((3, 48))
    known = learn_personal(prior, deviations)
    precision = np.linalg.inv(PRIOR.systematic) + 3.0 * np.linalg.inv(PRIOR.scatter)
    expected = np.linalg.solve(precision, np.linalg.solve(PRIOR.scatter, deviations.sum(axis=0)))
    np.testing.assert_allclose(known.mean, expected, atol=1e-6)
    np.testing.assert_allclose(known.systematic, np.linalg.inv(precision), atol=1e-8)


def test_unusable_deviations_are_refused():
    for wrong in (np.zeros(48), np.zeros((2, 47)), np.full((1, 48), np.nan)):
        with pytest.raises(DataError, match="deviations of shape"):
            learn_personal(PRIOR, wrong)


def test_durations_are_learnt():
    usual = np.log(1.0)
    before = duration_of(np.zeros(0), usual, 0.35)
    one = duration_of(np.array([0.6]), usual, 0.35)
    many = duration_of(np.full(40, 0.6), usual, 0.35)
    assert before[0] == usual
    assert before[1] > one[1] > many[1]
    assert abs(one[0] - np.log(0.6)) < 0.1
    assert many[0] == pytest.approx(np.log(0.6), abs=0.01)
