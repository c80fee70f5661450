"""Learnt costs of nearness in the planner, against the distances that they were learnt with."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from hri_planner.ptomp import HumanForecast, PtompConfig, PtompPlanner
from hri_planner.ptomp.costs import CostModel
from hri_planner.ptomp.interaction import doubts_about, find_nearness
from hri_planner.ptomp.layout import FIRST_FREE, TERMS
from hri_planner.robot import load_robot
from hri_prediction.errors import ConfigError
from hri_prediction.ontology.cost_file import CaseCosts, LearntCosts, load_costs
from hri_prediction.ontology.costs import NUMBER
from hri_prediction.ontology.features import COUNT, pair_features
from hri_prediction.ontology.shipped import SHIPPED_COSTS

ROBOT = load_robot()
RADII = np.array([0.05, 0.04, 0.05])
COLUMNS, STEP = 37, 0.03
TERM = TERMS.index("interaction_learned")
CASES = list(load_costs(SHIPPED_COSTS).cases)


def costs_file(folder: Path, **cases: NDArray[np.float64]) -> str:
    """A file with these weights, case by case."""
    path = folder / "costs.json"
    ones = np.ones(NUMBER)
    LearntCosts({name: CaseCosts(w, ones, 1) for name, w in cases.items()}, 0.3).save(path)
    return str(path)


def robot_arm(postures: NDArray[np.float64]) -> NDArray[np.float64]:
    """Shoulder, elbow, wrist and tool (n, 4, 3)."""
    points = np.stack([ROBOT.frames(q)[:4] for q in postures])
    points[:, 0] = (0.0, 0.0, ROBOT.lengths[0])
    return points


@pytest.mark.parametrize(("precision", "within"), [("double", 2e-7), ("single", 2e-4)])
def test_they_are_the_features_as_nearness(tmp_path: Path, precision: str, within: float) -> None:
    rng = np.random.default_rng(3)
    weights = rng.exponential(size=NUMBER) * (rng.random(NUMBER) < 0.6)
    path = costs_file(tmp_path, case_7=weights)
    config = PtompConfig(
        precision=precision, interaction_costs="case_7", interaction_file=path, interaction_weight=3.0
    )  # fmt: skip
    model = CostModel(ROBOT, config, None)
    arms = rng.uniform([0.1, -0.6, 0.0], [0.9, 0.6, 0.8], (2, COLUMNS, 4, 3))
    forecasts = [HumanForecast(0.0, STEP, arm, np.zeros((COLUMNS, 4)), RADII) for arm in arms]
    model.bind(STEP * np.arange(COLUMNS), np.zeros(3), forecasts, 0.06)
    postures = rng.uniform(ROBOT.lower, ROBOT.upper, (COLUMNS, 7))
    terms = model.evaluate(np.ascontiguousarray(postures.T)[None])[1]
    own = robot_arm(postures)
    nearness = sum(np.exp(-pair_features(own, arm) / 0.3)[FIRST_FREE:].sum(axis=0) for arm in arms)
    wanted = 3.0 * STEP * float(nearness @ weights[:COUNT]) / weights[:COUNT].sum()
    np.testing.assert_allclose(terms[0, TERM], wanted, rtol=within)


def test_nothing_is_charged_unless_a_case_is_named() -> None:
    model = CostModel(ROBOT, PtompConfig(), None)
    arm = np.full((1, 4, 3), 0.3)
    people = HumanForecast(0.0, STEP, arm, np.zeros((1, 4)), RADII)
    model.bind(STEP * np.arange(COLUMNS), np.zeros(3), [people], 0.06)
    assert model.evaluate(np.zeros((2, 7, COLUMNS)))[1][:, TERM].tolist() == [0.0, 0.0]


@settings(max_examples=30, deadline=None)
@given(st.sampled_from(CASES), st.floats(0.1, 10.0), st.integers(0, 10**6))
def test_they_are_linear_in_the_weight_and_less_farther_away(
    case: str, weight: float, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    arm = rng.uniform(-0.3, 0.3, (1, 4, 3)) + np.array([1.5, 0.0, 0.3])  # beyond the robot's reach
    path = np.ascontiguousarray(rng.uniform(-0.5, 0.5, (7, 12)))[None]

    def term(config: PtompConfig, shift: float) -> float:
        model = CostModel(ROBOT, config, None)
        people = HumanForecast(
            0.0, STEP, arm + np.array([shift, 0.0, 0.0]), np.zeros((1, 4)), RADII
        )
        model.bind(STEP * np.arange(12), np.zeros(3), [people], 0.06)
        return float(model.evaluate(path)[1][0, TERM])

    config = PtompConfig(interaction_costs=case, interaction_weight=1.0)
    once = term(config, 0.0)
    assert once > 0.0
    np.testing.assert_allclose(
        term(replace(config, interaction_weight=weight), 0.0), weight * once, rtol=1e-9
    )
    assert term(config, 0.1) < once


def test_every_case_ships_with_what_is_avoided_in_it() -> None:
    shipped = load_costs(SHIPPED_COSTS)
    assert list(shipped.cases) == [f"case_{number}" for number in range(1, 21)]
    directions = []
    for name, one in shipped.cases.items():
        # Learnt of people who moved by costs that are known, which were found again.
        assert one.cosine is not None
        assert one.cosine > 0.95
        found = find_nearness(name)
        assert found.weights.shape == (COUNT,)
        assert found.weights.min() >= 0.0
        np.testing.assert_allclose(found.weights.sum(), 1.0)
        directions.append(found.weights / np.linalg.norm(found.weights))
    # Cases are avoided otherwise: by one edge more of the same kind, or of another.
    alike = np.array(directions) @ np.array(directions).T
    apart: list[int] = []
    for number in range(len(alike)):
        if all(alike[number, other] < 0.99 for other in apart):
            apart.append(number)
    assert len(apart) >= 10


def test_costs_that_are_learnt_anew_are_read_anew(tmp_path: Path) -> None:
    path = costs_file(tmp_path, case_3=np.eye(NUMBER)[8])
    assert find_nearness("case_3", path).weights[8] == 1.0
    assert find_nearness("case_3", path) is find_nearness("case_3", path)
    again = costs_file(tmp_path, case_3=np.eye(NUMBER)[8] + 3.0 * np.eye(NUMBER)[2])
    assert again == path
    assert find_nearness("case_3", path).weights[2] == 0.75


def test_what_cannot_be_had_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"case_21.*expected one of case_1, case_2"):
        PtompConfig(interaction_costs="case_21")
    with pytest.raises(ConfigError, match="without interaction_costs"):
        PtompConfig(interaction_file="costs.json")
    with pytest.raises(ConfigError, match="interaction_file"):
        PtompConfig(interaction_costs="case_1", interaction_file=str(tmp_path / "none.json"))
    other = tmp_path / "other.json"
    other.write_text(json.dumps({"format": "something"}))
    with pytest.raises(ConfigError, match="no file of learnt costs"):
        PtompConfig(interaction_costs="case_1", interaction_file=str(other))
    nothing = costs_file(tmp_path, case_1=np.eye(NUMBER)[COUNT])
    with pytest.raises(ConfigError, match=r"not found to avoid any nearness in it.*has none"):
        PtompConfig(interaction_costs="case_1", interaction_file=nothing)


def test_a_plan_goes_where_nearness_costs_less(tmp_path: Path) -> None:
    """The hand passes an arm that is in nobody's way; where its nearness costs, it passes farther off."""
    path = costs_file(tmp_path, case_3=np.eye(NUMBER)[8])  # hand to hand
    start = np.radians([-40.0, -40.0, 0.0, 90.0, 0.0, -40.0, 0.0])
    goal = ROBOT.frames(np.radians([40.0, -40.0, 0.0, 90.0, 0.0, -40.0, 0.0]))[3]
    arm = np.array([[1.2, 0.0, 0.5], [1.05, 0.0, 0.35], [0.85, 0.0, 0.35], [0.76, 0.0, 0.35]])
    people = HumanForecast(0.0, 0.1, arm[None], np.full((1, 4), 0.01), RADII)

    def nearest(config: PtompConfig) -> float:
        planner = PtompPlanner(ROBOT, config, np.random.default_rng(0), None)
        planner.start(start, np.zeros(7), goal, 1.5, 0.0)
        plan = planner.replan(0.04, [people], iterations=150).plan
        tool = np.stack(
            [ROBOT.frames(q)[3] for q in plan.sample(np.linspace(0.04, plan.end_s, 60))[0]]
        )
        return float(np.linalg.norm(tool - arm[3], axis=1).min())

    plain = PtompConfig()
    learnt = replace(
        plain, interaction_costs="case_3", interaction_file=path, interaction_weight=20.0
    )
    assert nearest(learnt) > nearest(plain) + 0.03


def test_what_a_file_warns_of_its_costs(tmp_path: Path) -> None:
    """Of the case that is used, or of all; not of other cases."""
    one, path = CaseCosts(np.ones(NUMBER), np.ones(NUMBER), 1), tmp_path / "costs.json"
    warnings = ("a smoke run", "case_1: chance", "case_13: few")
    LearntCosts({"case_1": one, "case_13": one}, 0.3, "", warnings).save(path)
    assert doubts_about("case_1", str(path)) == ("a smoke run", "case_1: chance")
    assert doubts_about("case_13", str(path)) == ("a smoke run", "case_13: few")
    assert doubts_about("case_1") == doubts_about("") == ()
