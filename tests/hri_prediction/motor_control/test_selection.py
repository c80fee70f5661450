"""Which number of costs explains reaches best: by hand, of residuals that are known."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from hri_prediction.errors import DataError
from hri_prediction.motor_control.analyses.selection import model_of
from hri_prediction.motor_control.ioc import Explanation
from hri_prediction.motor_control.observed import ObservedReach

SAMPLES = 20


def some(distances_m: list[float], residual_m: float, names: tuple[str, ...]) -> Any:
    """Reaches, and what explains them, as far as they are looked at."""
    hand = np.zeros((SAMPLES, 3))
    reaches = [cast(ObservedReach, SimpleNamespace(hand=hand)) for _ in distances_m]
    found = [
        cast(
            Explanation,
            SimpleNamespace(names=names, distance_m=each, path=hand + residual_m),
        )
        for each in distances_m
    ]
    return reaches, found


def test_criteria_are_those_of_the_thesis_and_of_a_likelihood() -> None:
    reaches, found = some([0.01, 0.02, 0.02], 0.003, ("joint_jerk", "energy"))
    model = model_of(reaches, found, [4.0, 4.0, 4.0])
    assert model.hand_cm == pytest.approx(5.0 / 3.0)
    # One distance a reach [cm], two costs: n ln(RSS / n) + 2 k, + k ln n.
    assert model.aic == pytest.approx(3.0 * math.log((1.0 + 4.0 + 4.0) / 3.0) + 4.0)
    assert model.bic == pytest.approx(3.0 * math.log(3.0) + 2.0 * math.log(3.0))
    # A quarter of all coordinates is independent; one free weight a reach.
    n = 3 * 3 * SAMPLES / 4.0
    assert model.likelihood_aic == pytest.approx(n * math.log(0.003**2) + 2.0 * 3.0)
    assert model.likelihood_bic == pytest.approx(n * math.log(0.003**2) + math.log(n) * 3.0)
    assert model.distances_cm == (1.0, 2.0, 2.0)


def test_a_cost_that_explains_nothing_is_not_preferred() -> None:
    reaches, two = some([0.01, 0.012, 0.015, 0.011], 0.003, ("joint_jerk", "energy"))
    _, three = some([0.01, 0.012, 0.015, 0.011], 0.003, ("joint_jerk", "energy", "torque_change"))
    fewer, more = (model_of(reaches, found, [1.0] * 4) for found in (two, three))
    for name in ("aic", "bic", "likelihood_aic", "likelihood_bic"):
        assert getattr(fewer, name) < getattr(more, name)
    assert fewer.shapiro_p == more.shapiro_p


def test_two_reaches_are_too_few() -> None:
    reaches, found = some([0.01, 0.02], 0.003, ("joint_jerk", "energy"))
    with pytest.raises(DataError, match="three or more"):
        model_of(reaches, found, [1.0, 1.0])
