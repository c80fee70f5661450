"""Terms of costs are what the chapter says, and are refused when they are none."""

from dataclasses import asdict, astuple, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hri_planner.pibb.costs import (
    BALANCED,
    BOUNDED,
    END_EFFECTOR,
    JOINT,
    TERM_NAMES,
    WEIGHTS,
    CostWeights,
    Terms,
    deviation,
    indistinctness,
    squared_jerk,
    total,
)
from hri_prediction.errors import ConfigError, DataError

DT = 0.004
TIMES = DT * np.arange(501)
TERMS = Terms(2.0, 3.0, 1.5, 1.0, 4e-4, 0.6, 0.1)
UNITS = Terms(1.0, 2.0, 3.0, 1.0, 4e-4, 0.5, 0.2)


def test_the_jerk_of_polynomials_is_theirs() -> None:
    length = len(TIMES) * DT
    cubic = np.stack((TIMES**3, -2.0 * TIMES**3 + TIMES, np.ones_like(TIMES)), axis=1)
    assert squared_jerk(cubic, DT) == pytest.approx((36.0 + 144.0) * length)
    assert squared_jerk(TIMES[:, None] ** np.arange(3), DT) == pytest.approx(0.0, abs=1e-9)
    quartic = TIMES[:, None] ** 4
    assert squared_jerk(quartic, DT) == pytest.approx(np.sum((24.0 * TIMES) ** 2) * DT)


def test_the_jerk_of_a_minimum_jerk_motion_is_the_smallest() -> None:
    """720 d² / T^5 (Flash & Hogan 1985), as near as derivatives over 0.1 s tell."""
    for duration in (1.0, 2.0, 4.0):
        u = np.arange(0.0, duration + DT / 2, DT) / duration
        path = 0.3 * (u**3 * (10.0 + u * (-15.0 + 6.0 * u)))[:, None]
        assert squared_jerk(path, DT) == pytest.approx(720.0 * 0.09 / duration**5, rel=0.05)
        wavy = path + 0.01 * (np.sin(4 * np.pi * u) * u**3 * (1 - u) ** 3 * 64)[:, None]
        assert squared_jerk(wavy, DT) > squared_jerk(path, DT)


@pytest.mark.parametrize("factor", [2.0, 0.5])
def test_the_jerk_of_a_slower_motion_is_smaller_by_the_fifth_power(factor: float) -> None:
    path = np.cumsum(np.cumsum(np.cumsum(np.sin(3.0 * TIMES)[:, None] * DT, 0) * DT, 0) * DT, 0)
    fine = np.arange(0.0, TIMES[-1] * factor + DT / 2, DT)
    slower = np.interp(fine / factor, TIMES, path[:, 0])[:, None]
    found = squared_jerk(slower, DT) / squared_jerk(path, DT)
    assert found == pytest.approx(factor**-5, rel=0.05)


def test_noise_of_joints_is_not_mistaken_for_jerk() -> None:
    noise = 1e-5 * np.random.default_rng(0).standard_normal((501, 7))
    assert squared_jerk(noise, DT) < 0.01 * np.sum((np.diff(noise, 3, axis=0) / DT**3) ** 2) * DT


@pytest.mark.parametrize("path", [np.zeros((10, 3)), np.zeros(50), np.full((50, 3), np.nan)])
def test_paths_without_jerk_are_refused(path: np.ndarray) -> None:
    with pytest.raises(DataError, match="expected at least 25 finite positions"):
        squared_jerk(path, DT)


def test_deviations_are_mean_squares() -> None:
    planned = np.random.default_rng(1).standard_normal((100, 3))
    assert deviation(planned, planned) == 0.0
    assert deviation(planned + np.array((0.03, 0.0, 0.04)), planned) == pytest.approx(0.0025)
    # Who has arrived rests, as plan or as motion.
    late = np.concatenate((planned, np.tile(planned[-1], (50, 1))))
    assert deviation(late, planned) == deviation(planned, late) == 0.0
    held = np.concatenate((planned, np.tile(planned[-1] + 0.1, (100, 1))))
    assert deviation(held, planned) == pytest.approx(0.5 * 0.03)


def test_indistinctness_is_equation_7_19() -> None:
    """Ways p_t = t a and q_t = t b are as much apart, divided by t, at each of n steps."""
    steps = np.arange(126)[:, None]
    a, *others = 0.01 * np.random.default_rng(2).standard_normal((4, 3))
    ways = np.array([steps * b for b in others])
    wanted = 1.0 / sum(125 * np.linalg.norm(a - b) for b in others)
    assert indistinctness(steps * a, ways, 0.02) == pytest.approx(wanted)
    assert indistinctness(steps * 2 * a, 2 * ways, 0.02) == pytest.approx(wanted / 2)
    # Finer paths are looked at as often.
    fine = np.arange(626)[:, None] / 5.0
    ways = np.array([fine * b for b in others])
    assert indistinctness(fine * a, ways, DT) == pytest.approx(wanted)


def test_ways_that_part_sooner_are_more_distinct() -> None:
    u = np.linspace(0.0, 1.0, 126)[:, None]
    other = np.zeros((1, 126, 3))
    early, late = (u**power * np.array((0.0, 0.3, 0.0)) for power in (0.5, 3.0))
    assert indistinctness(early, other, 0.02) < 0.5 * indistinctness(late, other, 0.02)


@pytest.mark.parametrize("others", [np.zeros((0, 100, 3)), np.zeros((2, 100, 3)),
                                    np.full((1, 100, 3), np.nan)])  # fmt: skip
def test_without_another_way_nothing_is_distinct(others: np.ndarray) -> None:
    with pytest.raises(DataError, match="expected other goals"):
        indistinctness(np.zeros((100, 3)), others, 0.02)


def test_weights_are_those_of_the_table() -> None:
    assert astuple(END_EFFECTOR) == (1.0, 2.0, 4.0, 20.0, 2.0, 0.0, 3.0)
    assert astuple(JOINT) == (1.0, 1.0, 10.0, 2.0, 10.0, 1.0, 0.0)
    assert CostWeights() == BALANCED
    assert set(WEIGHTS) == {"balanced", "end_effector", "joint"}
    assert tuple(asdict(BALANCED)) == TERM_NAMES


def test_balanced_weights_make_no_time_worth_an_error() -> None:
    """Nearly twice as long as with the first policy is cheaper than a wrong guess at once."""
    slow = replace(UNITS, prediction_time=1.9 * UNITS.prediction_time, task=0.0)
    wrong = replace(UNITS, prediction_time=0.0, task=1.0)
    assert total(slow, UNITS, BALANCED) < total(wrong, UNITS, BALANCED)


@pytest.mark.parametrize(
    ("changes", "match"),
    [
        ({"task": -1.0}, r"CostWeights\.task = -1\.0; expected at least 0"),
        ({"deviation": np.nan}, r"CostWeights\.deviation = nan; expected a finite number"),
        ({"task": np.inf}, r"CostWeights\.task = inf"),
        (dict.fromkeys(TERM_NAMES, 0.0), "all weights of costs are 0"),
    ],
)
def test_weights_that_weigh_nothing_are_refused(changes: dict[str, float], match: str) -> None:
    with pytest.raises(ConfigError, match=match):
        CostWeights(**changes)


def test_the_total_is_weighted_in_units_of_the_first_policy() -> None:
    """What the person does counts as it is; what the motion costs, r in its unit, as 2 r / (1 + r)."""
    weights = CostWeights(1.0, 2.0, 4.0, 20.0, 2.0, 3.0, 5.0)

    def bounded(ratio: float) -> float:
        return 2.0 * ratio / (1.0 + ratio)

    motion = bounded(2.0) + 2.0 * bounded(1.5) + 2.0 * bounded(1.0) + 5.0 * bounded(0.5)
    assert total(TERMS, UNITS, weights) == pytest.approx(motion + 4.0 * 0.5 + 20.0 + 3.0 * 1.2)
    assert total(Terms(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), UNITS, weights) == 0.0
    as_first = replace(UNITS, task=0.0)
    assert total(as_first, UNITS, weights) == pytest.approx(1.0 + 2.0 + 4.0 + 2.0 + 3.0 + 5.0)


@pytest.mark.parametrize("name", TERM_NAMES)
def test_more_always_costs_more_but_a_wild_motion_not_without_end(name: str) -> None:
    costs = [
        total(replace(TERMS, **{name: factor * getattr(UNITS, name)}), UNITS, CostWeights())
        for factor in (0.0, 0.5, 1.0, 3.0, 100.0)
    ]
    assert (np.diff(costs) > 0.0).all()
    weight = getattr(CostWeights(), name)
    assert (costs[-1] - costs[0] <= 2.0 * weight) == (name in BOUNDED)


terms = st.lists(st.floats(0.0, 1e3), min_size=7, max_size=7).map(lambda values: Terms(*values))


@settings(max_examples=100, deadline=None)
@given(terms=terms, units=st.lists(st.floats(1e-3, 1e3), min_size=7, max_size=7))
def test_the_total_is_a_sum_of_what_single_weights_make(terms, units) -> None:
    own = Terms(*units)
    parts = [total(terms, own, CostWeights(**{**_NONE, name: 1.0})) for name in TERM_NAMES]
    assert total(terms, own, CostWeights(*[1.0] * 7)) == pytest.approx(sum(parts))
    assert min(parts) >= 0.0


_NONE = dict.fromkeys(TERM_NAMES, 0.0)


@pytest.mark.parametrize("name", TERM_NAMES)
@pytest.mark.parametrize("value", [np.nan, np.inf, -1.0])
def test_terms_that_are_no_costs_are_named(name: str, value: float) -> None:
    bad = replace(TERMS, **{name: value})
    with pytest.raises(DataError, match=f"{name} = {value}"):
        bad.check()
    with pytest.raises(DataError, match=f"{name} = {value}"):
        total(bad, UNITS, BALANCED)
    TERMS.check()


def test_a_total_that_is_too_large_is_refused() -> None:
    with pytest.raises(DataError):
        total(replace(TERMS, prediction_time=1e308), replace(UNITS, prediction_time=0.5), BALANCED)
