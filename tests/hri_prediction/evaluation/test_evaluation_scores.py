"""Figures of forecasts against closed forms."""

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from hri_prediction.evaluation.replay import Forecast
from hri_prediction.evaluation.report import (
    belief_words,
    predictor_table,
    region_table,
    winners,
)
from hri_prediction.evaluation.scores import coverage, score, spread_of, summarise


def forecast(rng: np.random.Generator, count: int) -> Forecast:
    root = rng.standard_normal((count, 3, 3))
    return Forecast(rng.standard_normal((count, 3)), root @ root.swapaxes(1, 2) + 0.1 * np.eye(3))


def test_likelihoods_are_those_of_scipy():
    rng = np.random.default_rng(0)
    ahead, truth = forecast(rng, 5), rng.standard_normal((5, 3))
    truth[3, 1] = np.nan
    end, later = forecast(rng, 1), forecast(rng, 3)
    aside = end.mean + np.array([0.3, 0.0, 0.4])
    found = score(end, aside, ahead, truth, later, later.mean + 1.0)
    for k in (0, 1, 2, 4):
        density = multivariate_normal(ahead.mean[k], ahead.covariance[k]).logpdf(truth[k])
        assert found["nll"][k] == pytest.approx(-density)
        gap = truth[k] - ahead.mean[k]
        assert found["squared"][k] == pytest.approx(gap @ np.linalg.solve(ahead.covariance[k], gap))
    assert np.isnan(found["nll"][3])
    assert np.isnan(found["squared"][3])
    assert found["endpoint"] == pytest.approx(0.5)
    np.testing.assert_allclose(found["horizon"], np.sqrt(3.0))


def test_coverage_of_the_true_distribution_is_nominal():
    rng = np.random.default_rng(1)
    ahead = forecast(rng, 4000)
    factor = np.linalg.cholesky(ahead.covariance)
    truth = ahead.mean + (factor @ rng.standard_normal((4000, 3, 1)))[..., 0]
    one = Forecast(ahead.mean[:1], ahead.covariance[:1])
    squared = score(one, truth[:1], ahead, truth, one, truth[:1])["squared"]
    assert coverage(squared, 0.5) == pytest.approx(0.5, abs=0.03)
    assert coverage(squared, 0.95) == pytest.approx(0.95, abs=0.02)
    assert coverage(np.full(3, np.nan), 0.5) is None


def test_what_is_not_known_is_left_out():
    assert spread_of(np.array([1.0, np.nan, 3.0])) == {"median": 2.0, "mean": 2.0, "p95": 2.9}
    assert spread_of(np.array([np.nan])) == {"median": None, "mean": None, "p95": None}
    empty = summarise(
        {
            "endpoint": np.full(2, np.nan),
            "horizon": np.full((2, 3), np.nan),
            "squared": np.full((2, 4), np.nan),
            "nll": np.full((2, 4), np.nan),
            "latency": np.zeros(0),
        }
    )
    assert empty["n"] == empty["points"] == 0
    assert empty["nll"] is empty["coverage50"] is empty["latency_us"] is None
    assert "–" in predictor_table({"nobody": empty})


def test_winners_are_named():
    def cell(end, nll):
        ahead = {"0.1": {"median": end}, "0.5": {"median": 1.0}}
        return {"endpoint_error_m": {"median": end}, "error_at_horizon_m": ahead, "nll": nll}

    first = {"ours": cell(0.02, -3.0), "good": cell(0.01, -2.0), "bad": cell(0.03, -1.0)}
    second = {"ours": cell(0.01, 0.0), "good": cell(0.02, 0.0), "bad": cell(None, 0.0)}
    lines = winners({"predictors": first, "by_observed": {"0.3": first, "0.5": second}}, "ours")
    assert lines == [
        "`good`: smaller median end-point error after 30 %; smaller median error 0.1 s ahead"
    ]


def test_belief_in_words():
    results = {
        "observed": 0.3,
        "duration_error_s": {"0.3": {"median": 0.081}},
        "task_found": {"0.3": 0.666},
        "durations_from": "the truth",
    }
    assert belief_words(results) == (
        "; its duration was 81 ms off (median; held against the truth); of all tasks and "
        '"unknown" the right one was the likeliest in 67 % of them'
    )
    assert belief_words({**results, "task_found": {"0.3": None}}).endswith("truth)")
    nothing = {"duration_error_s": {"0.3": {"median": None}}, "task_found": {"0.3": None}}
    assert belief_words({**results, **nothing}) == ""


def test_regions_over_the_observed_shares():
    results = {
        "noticed": {"0.1": 0.05, "0.2": 1.0},
        "by_observed": {
            "0.1": {"ours": {"coverage50": 0.1, "coverage95": 0.17}},
            "0.2": {"ours": {"coverage50": None, "coverage95": 0.9}},
        },
    }
    assert region_table(results, "ours").splitlines() == [
        "| `ours` after | 10 % | 20 % |",
        "| --- | --- | --- |",
        "| reaches noticed | 5 % | 100 % |",
        "| points within the 50 % region | 10 % | – |",
        "| points within the 95 % region | 17 % | 90 % |",
    ]
