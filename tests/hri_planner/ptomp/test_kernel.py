"""The compiled costs against the NumPy reference, in value and in speed."""

import time

import numpy as np
import pytest

from hri_planner.benchmarks.plain_iteration import PlainCosts
from hri_planner.ptomp import HumanForecast, PtompConfig, TableBox
from hri_planner.ptomp.costs import CostModel
from hri_planner.ptomp.layout import MAX_COLUMNS
from hri_planner.robot import load_robot
from hri_prediction.errors import ConfigError

ROBOT = load_robot()
CONFIG = PtompConfig()
TABLE = TableBox((0.5, 0.0, -0.02), (0.8, 1.2, 0.04))
RADII = np.array([0.05, 0.04, 0.05])
GOAL = np.array([0.5, 0.2, 0.15])
STEP = 0.03


def _problem(rng, count, columns, arms, config=CONFIG):
    model = CostModel(ROBOT, config, TABLE)
    times = 2.0 + STEP * np.arange(columns)
    forecasts = [
        HumanForecast(
            2.0, STEP, rng.uniform([0.2, -0.4, 0.0], [0.8, 0.4, 0.6], (columns, 4, 3)),
            rng.uniform(0, 0.08, (columns, 4)), RADII,
        )
        for _ in range(arms)
    ]  # fmt: skip
    model.bind(times, GOAL, forecasts, 0.06)
    ends = rng.uniform(ROBOT.lower, ROBOT.upper, (2, count, 7))
    x = np.linspace(0, 1, columns)[:, None]
    paths = ends[0][:, None] + x * (ends[1] - ends[0])[:, None]
    paths += 0.01 * rng.standard_normal(paths.shape)
    return model, np.ascontiguousarray(np.swapaxes(paths, 1, 2)), forecasts


def _plain(forecasts):
    arms = [(f.mean, f.sigma, f.radii) for f in forecasts]
    return PlainCosts(ROBOT, CONFIG, GOAL, STEP, 0.06, TABLE.top, arms)


def test_agrees_with_numpy():
    rng = np.random.default_rng(0)
    for arms in (0, 1, 2):
        model, trajectories, forecasts = _problem(rng, 20, 33, arms)
        totals, terms, nearest = model.evaluate(trajectories)
        expected, clearance = _plain(forecasts).terms(trajectories)
        np.testing.assert_allclose(terms, expected, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(totals, expected.sum(1), rtol=1e-9)
        if arms:
            np.testing.assert_allclose(nearest, clearance, atol=1e-9)
            profile = model.clearances(trajectories)
            np.testing.assert_array_equal(profile[:, 2:].min(axis=1), nearest)


def test_single_precision_is_near():
    rng = np.random.default_rng(2)
    single = PtompConfig(precision="single")
    model, trajectories, forecasts = _problem(rng, 20, 45, 1, single)
    totals, terms, nearest = model.evaluate(trajectories)
    assert terms.dtype == np.float32
    expected, clearance = _plain(forecasts).terms(trajectories)
    np.testing.assert_allclose(terms, expected, rtol=1e-3, atol=1e-3)
    np.testing.assert_allclose(totals, expected.sum(1), rtol=1e-3)
    np.testing.assert_allclose(nearest, clearance, atol=1e-5)


@pytest.mark.parametrize("columns", [5, 15, 16, 17, MAX_COLUMNS])
def test_any_length(columns):
    """Neither the rest of a row nor what was there before counts."""
    model, trajectories, forecasts = _problem(np.random.default_rng(columns), 3, columns, 1)
    terms = model.evaluate(trajectories)[1].copy()
    expected = _plain(forecasts).terms(trajectories)[0]
    np.testing.assert_allclose(terms, expected, rtol=1e-9, atol=1e-9)
    model.evaluate(np.full_like(trajectories, np.nan))
    np.testing.assert_array_equal(model.evaluate(trajectories)[1], terms)


def test_too_long_is_refused():
    with pytest.raises(ConfigError, match=str(MAX_COLUMNS + 1)):
        _problem(np.random.default_rng(0), 1, MAX_COLUMNS + 1, 0)


def test_much_faster_than_numpy():
    model, trajectories, forecasts = _problem(np.random.default_rng(1), 30, 45, 1)

    def best(function, repeats):
        times = []
        for _ in range(repeats):
            began = time.perf_counter()
            function()
            times.append(time.perf_counter() - began)
        return min(times)

    model.evaluate(trajectories)
    ours = best(lambda: model.evaluate(trajectories), 20)
    plain = _plain(forecasts)
    numpy = best(lambda: plain.terms(trajectories), 3)
    assert numpy > 10 * ours, f"{1e6 * ours:.0f} us against {1e6 * numpy:.0f} us"
