"""Analyses of explained reaches, on what is known of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats
from statsmodels.formula.api import ols

from hri_prediction.errors import DataError
from hri_prediction.motor_control import design
from hri_prediction.motor_control.analyses.behaviour import among_people, correlation, posture_space
from hri_prediction.motor_control.analyses.discomfort import SIX, THREE, fit_discomfort, terms
from hri_prediction.motor_control.analyses.table import ReachTable, load, table_of, together
from hri_prediction.motor_control.analyses.variance import complete, independent, repeated_measures
from hri_prediction.motor_control.arm_model import ArmModel
from hri_prediction.motor_control.batch import Outcome
from hri_prediction.motor_control.costs import CHAPTER_2
from hri_prediction.motor_control.observed import of_angles
from hri_prediction.motor_control.problem import ReachProblem


def made(count: int = 9, seed: int = 0) -> ReachTable:
    """A table of reaches along straight lines in joint space; the last could not be explained."""
    rng, arm = np.random.default_rng(seed), ArmModel.of_body()
    reaches, outcomes = [], []
    for index, (_, _, q_start, q_end, duration) in enumerate(design.tasks()[::10][:count]):
        phases = np.linspace(0.0, 1.0, 50)[:, None]
        angles = q_start + (q_end - q_start) * (10 * phases**3 - 15 * phases**4 + 6 * phases**5)
        reaches.append(of_angles(ReachProblem.at_rest(q_start, q_end, duration), angles, arm))
        alpha = tuple(rng.dirichlet(np.ones(4)).tolist())
        four = (0.1, 0.2, 0.3, None)
        outcomes.append(
            Outcome(index, "", "", alpha, (0.1,) * 4, (1.0,) * 4, 0.1, four, 1.0, four, 9, 0.1)
            if index < count - 1
            else Outcome(index, "", error="singular")
        )
    return table_of(
        CHAPTER_2, reaches, outcomes, person=["S1"] * count, start=["P1"] * count,
        target=[f"T{i + 1}" for i in range(count)],
    )  # fmt: skip


def test_a_table_comes_back_from_its_file(tmp_path: Path) -> None:
    table = made()
    table.save(tmp_path / "reaches.npz")
    again = load(tmp_path / "reaches.npz")
    assert again.names == CHAPTER_2
    assert again.person.tolist() == table.person.tolist()
    assert again.error.tolist() == table.error.tolist()
    for name in ("alpha", "single_cm", "angles", "truth", "duration_s"):
        np.testing.assert_array_equal(getattr(again, name), getattr(table, name))


def test_another_file_is_no_table(tmp_path: Path) -> None:
    (tmp_path / "other.npz").write_bytes(b"no archive")
    with pytest.raises(DataError, match=r"other\.npz"):
        load(tmp_path / "other.npz")


def test_what_was_not_explained_is_left_out() -> None:
    table = made()
    assert len(table) == 9
    assert len(table.explained) == 8
    assert np.isnan(table.alpha[-1]).all()
    assert np.isnan(table.single_cm[0, 3])
    assert len(together([table, table.explained])) == 17
    with pytest.raises(DataError, match="different costs"):
        together([])


def test_kinematics_of_a_table() -> None:
    table = made()
    ends = np.linalg.norm(table.end_m, axis=1)
    arm = ArmModel.of_body()
    assert (ends < arm.upper_m + arm.forearm_m + 1e-9).all()
    assert (table.mean_speed * table.duration_s >= table.length_m - 1e-6).all()
    # A motion of least jerk is 15/8 as fast at its peak as in the mean.
    np.testing.assert_allclose(table.peak_speed / table.mean_speed, 1.9, atol=0.25)


@given(
    st.lists(st.floats(0.2, 2.0), min_size=6, max_size=6),
    st.lists(st.booleans(), min_size=6, max_size=6),
    st.integers(0, 100),
)
def test_discomfort_without_noise_is_found(
    sizes: list[float], signs: list[bool], seed: int
) -> None:
    rng = np.random.default_rng(seed)
    beta = np.array(sizes) * np.where(signs, 1.0, -1.0)
    beta /= np.linalg.norm(beta)
    q_start, q_end = rng.uniform(-1.0, 1.0, (2, 60, 3))
    share = 0.2 + 0.7 * terms(q_start, q_end, SIX) @ beta
    found = fit_discomfort(q_start, q_end, share, SIX, rng, permutations=20)
    np.testing.assert_allclose(found.beta, beta, atol=1e-9)
    assert found.slope == pytest.approx(0.7)
    assert found.offset == pytest.approx(0.2)
    assert found.r2 == pytest.approx(1.0)
    assert found.p == pytest.approx(1.0 / 21.0)


def test_discomfort_of_three_angles_has_one_for_its_first_weight() -> None:
    rng = np.random.default_rng(3)
    q_start, q_end = rng.uniform(-1.0, 1.0, (2, 108, 3))
    beta = np.array([1.0, 0.8150, -0.4477])
    share = 0.5 - 0.4 * terms(q_start, q_end, THREE) @ beta
    found = fit_discomfort(q_start, q_end, share, THREE, rng, permutations=20)
    np.testing.assert_allclose(found.beta, beta, atol=1e-9)
    assert found.slope == pytest.approx(-0.4)


def test_r2_is_that_of_regression() -> None:
    rng = np.random.default_rng(4)
    q_start, q_end = rng.uniform(-1.0, 1.0, (2, 80, 3))
    share = rng.uniform(0.0, 1.0, 80)
    columns = pd.DataFrame(terms(q_start, q_end, SIX), columns=[f"x{i}" for i in range(6)])
    model = ols("y ~ " + " + ".join(columns), columns.assign(y=share)).fit()
    found = fit_discomfort(q_start, q_end, share, SIX, rng)
    assert found.r2 == pytest.approx(model.rsquared)
    assert found.r2 < found.chance_r2 + 0.1


def test_smoothing_makes_noise_look_explained() -> None:
    rng = np.random.default_rng(5)
    q_start, q_end = rng.uniform(-1.0, 1.0, (2, 400, 3))
    found = fit_discomfort(
        q_start, q_end, rng.uniform(0.0, 1.0, 400), SIX, rng, smoothing=0.1, permutations=100
    )
    assert found.smoothed_r2 > 3.0 * found.r2
    # Chance explains as much as soon as it is smoothed, too.
    assert found.smoothed_r2 < found.smoothed_chance_r2 + 0.15


@pytest.mark.parametrize(
    ("count", "share", "match"),
    [(5, 0.5, "8 or more"), (20, np.nan, "finite"), (20, 0.5, "all the same")],
)
def test_discomfort_that_cannot_be_found(count: int, share: float, match: str) -> None:
    rng = np.random.default_rng(0)
    q_start, q_end = rng.uniform(-1.0, 1.0, (2, count, 3))
    with pytest.raises(DataError, match=match):
        fit_discomfort(q_start, q_end, np.full(count, share), SIX, rng)


def test_an_unknown_form_of_discomfort() -> None:
    with pytest.raises(DataError, match=r"2\.21, 3\.5"):
        terms(np.zeros((1, 3)), np.zeros((1, 3)), "9.9")


PEOPLE = np.repeat([f"S{i}" for i in range(8)], 6)
FIRST = np.tile(np.repeat(["a", "b", "c"], 2), 8)
SECOND = np.tile(["x", "y"], 24)


def test_repeated_measures_against_sums_of_squares() -> None:
    """F of a factor with two levels is the square of the paired t."""
    rng = np.random.default_rng(6)
    values = rng.normal(size=48) + (SECOND == "y") * 0.7 + (FIRST == "b") * 2.0
    effects = {
        e.source: e for e in repeated_measures(values, PEOPLE, {"first": FIRST, "second": SECOND})
    }
    assert list(effects) == ["first", "second", "first:second"]
    assert (effects["first"].df1, effects["first"].df2) == (2, 14)
    means = values.reshape(8, 3, 2).mean(axis=1)
    apart = means[:, 1] - means[:, 0]
    t = apart.mean() / (apart.std(ddof=1) / np.sqrt(8))
    assert effects["second"].f == pytest.approx(t**2)
    assert effects["second"].p == pytest.approx(effects["second"].p_least)
    assert effects["first"].p <= effects["first"].p_least


def test_repeated_measures_need_everybody() -> None:
    values = np.arange(48.0)
    with pytest.raises(DataError, match="one finite value"):
        repeated_measures(values[1:], PEOPLE[1:], {"first": FIRST[1:], "second": SECOND[1:]})
    kept = complete(PEOPLE, [FIRST, SECOND], np.where(np.arange(48) == 7, np.nan, values))
    assert set(PEOPLE[kept]) == {f"S{i}" for i in range(8)} - {"S1"}


def test_independent_factors() -> None:
    rng = np.random.default_rng(7)
    values = rng.normal(size=48) + (FIRST == "b") * 3.0
    first, second = independent(values, {"first": FIRST, "second": SECOND})
    assert first.p < 1e-6
    assert second.p > 0.01
    assert (first.df1, first.df2, second.df1) == (2, 44, 1)


@pytest.mark.parametrize(
    ("factors", "match"),
    [
        ({"first": FIRST, "again": np.char.upper(FIRST)}, "cannot be told apart"),
        ({"each": np.arange(48).astype(str)}, "49 finite ones"),
    ],
)
def test_factors_that_cannot_be_examined(factors: dict[str, np.ndarray], match: str) -> None:
    with pytest.raises(DataError, match=match):
        independent(np.random.default_rng(8).normal(size=48), factors)


def test_correlation_has_an_interval_over_people() -> None:
    rng = np.random.default_rng(9)
    covered, narrow = [], []
    person = np.repeat([f"S{i}" for i in range(15)], 40)
    for _ in range(60):
        # People have a level and a slope of their own: reaches of one are alike.
        first = rng.normal(size=600)
        second = first + np.repeat(rng.normal(size=15), 40) + rng.normal(size=600)
        found = among_people(first, second, person, rng)
        assert found.r == correlation(first, second)
        assert (found.n, found.people) == (600, 15)
        covered.append(found.low < np.sqrt(1.0 / 3.0) < found.high)
        alone = stats.pearsonr(first, second).confidence_interval(0.95)
        narrow.append((alone.high - alone.low) / (found.high - found.low))
    assert np.mean(covered) >= 0.8
    assert np.median(narrow) < 0.9


def test_too_few_to_correlate() -> None:
    rng = np.random.default_rng(0)
    first = rng.normal(size=8)
    with pytest.raises(DataError, match="four or more"):
        correlation(first[:3], first[:3])
    two = among_people(first, first, np.repeat(["a", "b"], 4), rng)
    assert two.r == pytest.approx(1.0)
    assert np.isnan(two.low)
    assert np.isnan(two.high)


def test_postures_lie_in_their_components() -> None:
    table = made()
    space = posture_space(table)
    assert space.ratios.sum() == pytest.approx(1.0)
    angles = np.degrees(np.concatenate([table.q_start, table.q_end], axis=1))
    np.testing.assert_allclose(
        space.scores @ space.components, angles - angles.mean(axis=0), atol=1e-9
    )
    with pytest.raises(DataError, match="seven or more"):
        posture_space(table.where(np.arange(5)))
