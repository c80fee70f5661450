"""The condition generator keeps its promises."""

import numpy as np
import pytest

from hri_planner.robot import load_robot
from hri_prediction.arm.geometry import ArmRadii, arm_capsules
from hri_prediction.errors import ConfigError, PlanningError
from hri_prediction.geometry.segments import capsule_distances
from hri_sim.people.person import nominal_motion_of
from hri_sim.scenario import conditions
from hri_sim.scenario.conditions import DrawCounts, draw_scenario, vary_scenario
from hri_sim.scenario.examination import examine_scenario
from hri_sim.scenario.nominal import nominal_goal, nominal_motion, speed_share

SEEDS = range(8)


def inside(point, box):
    return all(low <= value <= high for value, (low, high) in zip(point, box, strict=True))


@pytest.mark.parametrize("seed", SEEDS)
def test_numbers_lie_in_their_ranges_and_sides_alternate(seed):
    scenario = draw_scenario(seed)
    (person,) = scenario.persons
    assert inside(person.shoulder, conditions.SHOULDER)
    assert inside(person.home, conditions.TARGET)
    assert (person.upper_arm, person.forearm, person.hand) == (0.29, 0.26, 0.09)
    robot = load_robot()
    places = [robot.frames(np.array(scenario.robot_start))[3]]
    for index, reach in enumerate(scenario.reaches):
        assert inside(scenario.targets[reach.person_target], conditions.TARGET)
        assert 1.0 <= reach.person_duration <= 1.7
        places.append(scenario.targets[reach.robot_target])
        assert np.sign(places[index][1]) == -np.sign(places[index + 1][1])
    for x, y, _ in places:
        assert 0.2999 <= x <= 0.6001
        assert 0.2499 <= abs(y) <= 0.5001


@pytest.mark.parametrize("seed", SEEDS)
def test_rules_hold_when_computed_afresh(seed):
    """Checked by other code than the generator's, at another rate."""
    scenario = draw_scenario(seed, 2)
    robot, radii = load_robot(), ArmRadii().array
    q = np.array(scenario.robot_start)
    for index, reach in enumerate(scenario.reaches):
        goal = scenario.targets[reach.robot_target]
        time, motion = nominal_motion(robot, q, goal, reach.duration, rate_hz=100.0)
        person = nominal_motion_of(
            scenario.persons[0],
            scenario.person_from(index),
            scenario.targets[reach.person_target],
            reach.person_delay,
            reach.person_duration,
        )

        def clearance(at, posture, person=person):
            arm, axes = arm_capsules(person.truth(at)), robot.robot_capsules(posture)
            return capsule_distances(axes, robot.capsule_radii, arm, radii).min()

        distances = [clearance(at, posture) for at, posture in zip(time, motion, strict=True)]
        assert min(distances) < 0.0
        assert distances[0] >= 0.10
        hold = [clearance(reach.duration + t, motion[-1]) for t in np.linspace(0.0, 1.1, 45)]
        assert min(hold) >= 0.029
        speeds = np.abs(np.diff(motion, axis=0)) / np.diff(time)[:, None]
        assert np.all(speeds <= 0.9 * robot.velocity)
        heights = robot.robot_capsules(motion)[..., 2].min(axis=-1) - robot.capsule_radii
        assert heights.min() > scenario.table.top
        np.testing.assert_allclose(robot.frames(motion[-1])[3], goal, atol=1e-6)
        q = motion[-1]


def test_same_seed_same_scenario():
    assert draw_scenario(3) == draw_scenario(3)
    assert draw_scenario(3) != draw_scenario(4)


def test_ambiguous_scenarios_offer_two_or_three_targets():
    seen = set()
    for seed in SEEDS:
        scenario = draw_scenario(seed, 2, ambiguous=True)
        for index, reach in enumerate(scenario.reaches):
            names = scenario.candidates(index)
            assert reach.person_target in names
            seen.add(len(names))
            points = np.array([scenario.targets[name] for name in names])
            gaps = np.linalg.norm(points[:, None] - points[None], axis=-1)
            assert gaps[~np.eye(len(names), dtype=bool)].min() >= conditions.CANDIDATES_APART_M
    assert seen == {2, 3}


@pytest.mark.parametrize("side", ["left", "right"])
def test_moving_scenarios_collide_only_because_the_person_moves(side):
    scenario = draw_scenario(1, 2, moving=True, side=side)
    assert scenario.persons[0].side == side
    for report in examine_scenario(scenario):
        assert report.accepted
        assert report.staying_clearance >= 0.02
        assert report.clearance <= -0.02


def test_conditions_of_a_task_differ_in_timing_only():
    task = draw_scenario(5, 2)
    first, second = vary_scenario(task, 1), vary_scenario(task, 2)
    assert first == vary_scenario(task, 1)
    assert (first.targets, first.persons) == (task.targets, task.persons)
    assert first.reaches != second.reaches
    assert first.seed != second.seed
    assert all(report.accepted for report in examine_scenario(second))


def test_counts_tell_the_acceptance():
    counts = DrawCounts()
    draw_scenario(2, 2, counts=counts)
    assert counts.robot_goals >= counts.robot_accepted >= counts.reaches_accepted >= 2
    assert counts.reaches >= counts.reaches_accepted


def test_bad_requests():
    with pytest.raises(ConfigError, match="at least 1"):
        draw_scenario(1, 0)
    with pytest.raises(ConfigError, match="left or right"):
        draw_scenario(1, side="both")
    with pytest.raises(PlanningError, match="positive time"):
        nominal_motion(load_robot(), np.zeros(7), (0.4, 0.3, 0.3), 0.0)


def test_nominal_motion_peaks_at_the_speed_that_speed_share_says():
    robot = load_robot()
    q0 = np.array(draw_scenario(0, 1).robot_start)
    goal = (0.45, 0.3, 0.25)
    time, q = nominal_motion(robot, q0, goal, 1.5, rate_hz=2000.0)
    measured = np.max(np.abs(np.diff(q, axis=0)) / np.diff(time)[:, None] / robot.velocity)
    assert time[-1] == 1.5
    np.testing.assert_allclose(q[-1], nominal_goal(robot, q0, goal), atol=1e-12)
    assert speed_share(robot, q0, q[-1], 1.5) == pytest.approx(measured, rel=1e-4)
