"""The situation at the start of a motion, and planners of the size that suits it."""

import numpy as np
import pytest

from hri_planner.adaptation.first_look import FirstLook
from hri_planner.adaptation.grid import Cell
from hri_planner.adaptation.online import KEPT, OnlineAdaptation
from hri_planner.ptomp import HumanForecast, PtompPlanner, load_default_config
from hri_planner.robot import load_robot
from hri_planner.robot.ik import ik_candidates

DURATION_S = 1.5
CONFIG = load_default_config()


@pytest.fixture(scope="module")
def started():
    """A planner, its first plan and goal."""
    robot = load_robot()
    planner = PtompPlanner(robot, CONFIG, np.random.default_rng(0))
    q = np.array([0.6, 0.9, 0.0, -1.2, 0.0, 0.4, 0.0])
    goal = robot.frames(q + np.array([-1.2, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]))[3]
    return q, goal, planner.start(q, np.zeros(7), goal, DURATION_S, 0.0)


def arm_at(point):
    """An arm that stays, all of it within a few centimetres of a point."""
    points = point + 0.02 * np.arange(4)[:, None] * np.array([0.0, 0.0, 1.0])
    mean = np.tile(points, (100, 1, 1))
    return HumanForecast(0.0, 0.02, mean, np.full((100, 4), 0.01), np.array([0.05, 0.04, 0.05]))


def look(started, forecasts, config=CONFIG):
    _, goal, plan = started
    return FirstLook(load_robot(), config, None).situation(
        plan, goal, DURATION_S, forecasts, uncertainties=[0.01], errors=[0.02], distance=0.3
    )


def test_nobody_near_is_no_trouble(started):
    for forecasts in ([], [arm_at(np.array([3.0, 3.0, 0.0]))]):
        seen = look(started, forecasts)
        assert seen.collision_cost == 0.0
        assert seen.time_to_collision == DURATION_S
        assert (seen.uncertainty, seen.error, seen.distance) == (0.01, 0.02, 0.3)


def test_time_to_collision_is_when_the_plan_first_touches(started):
    robot, plan = load_robot(), started[2]
    halfway = robot.frames(plan.sample(0.5 * plan.end_s)[0])[3]
    seen = look(started, [arm_at(halfway)])
    assert seen.collision_cost > 1.0
    # The arm and the hand have an extent: they touch somewhat before the tool's point is there.
    assert 0.2 * plan.end_s < seen.time_to_collision < 0.5 * plan.end_s


class Fixed:
    """A selection that remembers what it was asked."""

    def __init__(self, cell):
        self.cell = cell
        self.seen = []

    def choose(self, situation):
        self.seen.append(situation)
        return self.cell


def test_planners_are_made_when_another_size_is_chosen(started):
    q, goal, _ = started
    robot, rng = load_robot(), np.random.default_rng(0)
    selection = Fixed(Cell(20, 10))
    adaptation = OnlineAdaptation(selection, robot, CONFIG, rng, None)
    first = PtompPlanner(robot, CONFIG, rng)

    def start(planner):
        return adaptation.start(
            planner, (q, np.zeros(7)), goal, DURATION_S, [],
            uncertainties=[], errors=[], distance=np.inf,
        )  # fmt: skip

    second = start(first)
    assert (second.config.num_timesteps, second.config.num_rollouts) == (20, 10)
    assert second.config.margin == CONFIG.margin
    assert second.plan is not None
    assert len(second.plan.time_s) == 21
    assert start(second) is second
    selection.cell = Cell(CONFIG.num_timesteps, CONFIG.num_rollouts)
    third = start(second)
    assert third is not second
    selection.cell = Cell(20, 10)
    assert start(third) is second  # kept
    assert [seen.time_to_collision for seen in selection.seen] == [DURATION_S] * 4


def test_a_final_posture_is_looked_for_once(started, monkeypatch):
    """Half of what a start takes; the planner that is chosen takes over what the first has found."""
    q, goal, _ = started
    looked = []

    def look_for(*arguments, **options):
        looked.append(arguments)
        return ik_candidates(*arguments, **options)

    monkeypatch.setattr("hri_planner.ptomp.first_motion.ik_candidates", look_for)
    robot, rng = load_robot(), np.random.default_rng(0)
    adaptation = OnlineAdaptation(Fixed(Cell(60, 60)), robot, CONFIG, rng, None)
    adaptation.start(
        PtompPlanner(robot, CONFIG, rng), (q, np.zeros(7)), goal, DURATION_S, [],
        uncertainties=[], errors=[], distance=np.inf,
    )  # fmt: skip
    assert len(looked) == 1


def test_no_more_planners_are_kept_than_a_few(started):
    q, goal, _ = started
    robot, rng = load_robot(), np.random.default_rng(0)
    selection = Fixed(Cell(10, 5))
    adaptation = OnlineAdaptation(selection, robot, CONFIG, rng, None)
    present = PtompPlanner(robot, CONFIG, rng)
    found = []
    for rollouts in (*range(5, 5 + KEPT + 1), 5):
        selection.cell = Cell(10, rollouts)
        found.append(
            adaptation.start(
                present, (q, np.zeros(7)), goal, DURATION_S, [],
                uncertainties=[], errors=[], distance=np.inf,
            )
        )  # fmt: skip
    assert found[0] is not found[-1]
    assert len(set(map(id, found))) == len(found)
