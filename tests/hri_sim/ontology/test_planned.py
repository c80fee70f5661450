"""Learnt costs in the planner: what is compared, and how."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hri_planner.robot import load_robot
from hri_sim.benchmark.outcome import Execution
from hri_sim.ontology import planned
from hri_sim.ontology.planned import AGAIN, NONE, Way, crossed, effect, effect_lines


def way(condition: int, case: str, shift: float, cost: float, seconds: float | None = 1.5) -> Way:
    tool = np.linspace([0.3, -0.3, 0.3], [0.3, 0.3, 0.3], planned.POINTS) + np.array(
        (0.0, 0.0, shift)
    )
    weight = 2.0 if case else 0.0
    return Way(
        condition, case, weight, tool, {"case_3": cost}, 0.1 + shift, seconds, seconds is not None
    )


def again(condition: int, shift: float) -> Way:
    return replace(way(condition, AGAIN, shift, 1.0), weight=0.0)


def test_the_effect_is_of_the_same_reaches() -> None:
    ways = [
        way(0, NONE, 0.0, 1.0), again(0, 0.005), way(0, "case_3", 0.02, 0.9),
        way(10, NONE, 0.0, 2.0), again(10, 0.007), way(10, "case_3", 0.04, 1.6, None),
    ]  # fmt: skip
    found = effect(ways, "case_3", 2.0)
    assert found["reaches"] == 2
    assert found["apart_cm"] == pytest.approx(3.0)
    assert found["cost_percent"] == pytest.approx(-15.0)
    assert found["cost_less_share"] == 1.0
    assert found["seconds"] == 0.0
    assert (found["ok_without"], found["ok_with"]) == (1.0, 0.5)
    text = "\n".join(effect_lines(ways, ["case_3"]))
    assert "| case_3 | 2 | 3.0 cm | -15.0 % | 100 % |" in text
    # What changes anyway, by the same measures.
    assert planned.anyway(ways, "case_3")["cost_percent"] == pytest.approx(-25.0)
    assert "| none, another seed, by case_3 | – | 0.6 cm | -25.0 % | 50 % | +0.6 cm |" in text


def test_costs_are_crossed_with_those_of_other_cases() -> None:
    names = ["case_1", "case_3"]
    ways = [
        replace(way(0, case, 0.0, 1.0), costs={"case_1": one, "case_3": three})
        for case, one, three in ((NONE, 1.0, 2.0), ("case_1", 0.9, 2.0), ("case_3", 0.95, 1.0))
    ]
    ways.append(replace(again(0, 0.01), costs={"case_1": 1.0, "case_3": 2.0}))
    np.testing.assert_allclose(crossed(ways, names, 2.0), [[-10.0, 0.0], [-5.0, -50.0]])
    assert "| case_3 | -5.0 % | -50.0 % |" in "\n".join(effect_lines(ways, names))


def test_the_learnt_cost_is_less_farther_away() -> None:
    q = np.tile(np.radians([0.0, -40.0, 0.0, 90.0, 0.0, -40.0, 0.0]), (20, 1))
    arm = np.tile(np.linspace([0.9, 0.0, 0.5], [0.6, 0.0, 0.3], 4), (20, 1, 1))
    still = np.zeros_like(q)

    def cost(shift: float) -> float:
        run = Execution(0.004, q, still, still, arm + np.array([shift, 0.0, 0.0]), None)
        return planned.learnt_cost(run, "case_3")

    assert 0.0 < cost(0.3) < cost(0.0) < 20 * 0.004


def test_the_robot_as_an_arm() -> None:
    robot = load_robot()
    q = np.radians([[10.0, -40.0, 0.0, 90.0, 0.0, -40.0, 0.0]])
    points = planned.robot_keypoints(q)[0]
    np.testing.assert_allclose(np.linalg.norm(np.diff(points, axis=0), axis=1), robot.lengths[1:])


def test_a_picture(tmp_path: Path) -> None:
    ways = [way(n, case, 0.01 * n, 1.0) for n in range(3) for case in (NONE, "case_3")]
    planned.draw_ways(tmp_path / "ways.png", ways, ["case_3"], 2.0)
    assert (tmp_path / "ways.png").stat().st_size > 5_000
