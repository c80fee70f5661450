"""Forecasts: interpolation, holding still outside, several arms, refusal of NaN."""

import numpy as np
import pytest

from hri_planner.ptomp import HumanForecast
from hri_planner.ptomp.forecast import pack_forecasts
from hri_planner.ptomp.layout import (
    ARM_AXIS,
    ARM_LENGTH,
    ARM_RISE,
    ARM_ROWS,
    ARM_SIGMA,
    ARM_START,
    ROW,
)
from hri_prediction.errors import DataError

RADII = np.array([0.05, 0.04, 0.05])


def _forecast(arms=None):
    rng = np.random.default_rng(0)
    lead = () if arms is None else (arms,)
    return HumanForecast(1.0, 0.1, rng.random((*lead, 5, 4, 3)), rng.random((*lead, 5, 4)), RADII)


def test_linear_between_and_still_outside():
    forecast = _forecast()
    points, sigma = forecast.sample(np.array([0.0, 1.0, 1.15, 1.4, 9.0]))
    assert points.shape == (1, 5, 4, 3)
    np.testing.assert_allclose(points[0, 0], forecast.mean[0])
    np.testing.assert_allclose(points[0, 2], 0.5 * (forecast.mean[1] + forecast.mean[2]))
    np.testing.assert_allclose(points[0, 4], forecast.mean[-1])
    np.testing.assert_allclose(sigma[0, 2], 0.5 * (forecast.sigma[1] + forecast.sigma[2]))


def test_arms_are_stacked():
    arms, radii = pack_forecasts([_forecast(), _forecast(arms=2)], np.array([1.0, 1.1, 1.2]))
    assert radii.shape == (3, 3)
    rows = arms.reshape(3, ARM_ROWS, ROW)[0, :, 1]
    start, axis = rows[ARM_START + 3 : ARM_START + 6], rows[ARM_AXIS + 3 : ARM_AXIS + 6]
    np.testing.assert_allclose(start, _forecast().mean[1, 1])
    np.testing.assert_allclose(start + rows[ARM_LENGTH + 1] * axis, _forecast().mean[1, 2])
    np.testing.assert_allclose(rows[ARM_SIGMA + 1], _forecast().sigma[1, 1])
    risen = rows[ARM_SIGMA + 1] + rows[ARM_LENGTH + 1] * rows[ARM_RISE + 1]
    np.testing.assert_allclose(risen, _forecast().sigma[1, 2])
    assert len(pack_forecasts([], np.array([1.0]))[0]) == 0


def test_unusable_forecasts_are_refused():
    good = _forecast()
    with pytest.raises(DataError, match="NaN"):
        HumanForecast(0.0, 0.1, np.full_like(good.mean, np.nan), good.sigma, RADII)
    with pytest.raises(DataError, match="step"):
        HumanForecast(0.0, 0.0, good.mean, good.sigma, RADII)
    with pytest.raises(DataError, match="sigma"):
        HumanForecast(0.0, 0.1, good.mean, good.sigma[:2], RADII)
    with pytest.raises(DataError, match="mean"):
        HumanForecast(0.0, 0.1, good.mean[:, :2], good.sigma, RADII)
