"""The benchmark's conditions: as promised, the same however they are drawn, tuning apart from test."""

import subprocess
import sys
from collections import Counter

import numpy as np
import pytest

from hri_planner.robot import load_robot
from hri_prediction.arm.geometry import ArmRadii, arm_capsules
from hri_prediction.errors import ConfigError
from hri_prediction.geometry.segments import capsule_distances
from hri_sim.benchmark.conditions import (
    CONDITION_RULES,
    CONDITIONS_A_TASK,
    SPLITS,
    TASK_RULES,
    TASKS,
    task_conditions,
)
from hri_sim.scenario import conditions as ranges
from hri_sim.scenario.nominal import nominal_motion, speed_share

NUMBERS = (0, 4, 9)


def inside(point, box):
    return all(low <= value <= high for value, (low, high) in zip(point, box, strict=True))


@pytest.mark.parametrize("number", NUMBERS)
def test_numbers_lie_in_their_ranges(number):
    found = task_conditions("test", number)
    person = found.task.person
    assert len(found.conditions) == CONDITIONS_A_TASK
    assert inside(person.shoulder, ranges.SHOULDER)
    assert (person.upper_arm, person.forearm, person.hand) == (0.29, 0.26, 0.09)
    assert (person.noise_sd, person.variability) == (0.002, 1.0)
    for place in (person.home, *found.task.targets.values()):
        assert inside(place, ranges.TARGET)
    robot = load_robot()
    for condition in found.conditions:
        (reach,) = condition.scenario.reaches
        assert 1.0 <= reach.person_duration <= 1.7
        start = robot.frames(np.array(condition.scenario.robot_start))[3]
        for x, y, _ in (start, condition.robot_goal):
            assert 0.2999 <= x <= 0.6001
            assert 0.2499 <= abs(y) <= 0.5001
        assert np.sign(start[1]) == -np.sign(condition.robot_goal[1])


@pytest.mark.parametrize("number", NUMBERS)
def test_rules_hold_for_the_true_motion_when_computed_afresh(number):
    robot, radii = load_robot(), ArmRadii().array
    for condition in task_conditions("tuning", number).conditions:
        scenario, person = condition.scenario, condition.person()
        q = np.array(scenario.robot_start)
        time, motion = nominal_motion(robot, q, condition.robot_goal, 1.5, rate_hz=100.0)

        def clearance(at, posture, person=person):
            arm = arm_capsules(person.truth(at))
            axes = robot.robot_capsules(posture)
            return capsule_distances(axes, robot.capsule_radii, arm, radii).min()

        series = [clearance(t, posture) for t, posture in zip(time, motion, strict=True)]
        assert series[0] >= 0.10
        assert min(series) < 0.0
        assert min(clearance(t, motion[-1]) for t in np.arange(1.5, 2.6, 0.02)) >= 0.03
        assert speed_share(robot, q, motion[-1], 1.5) <= 0.9
        ends = robot.robot_capsules(motion)[..., 2].min(axis=2) - robot.capsule_radii
        assert ends.min() > scenario.table.top


def test_six_tasks_are_ambiguous_and_each_of_their_targets_is_reached_for():
    tasks = [task_conditions("test", number) for number in range(TASKS)]
    ambiguous = [found for found in tasks if found.task.ambiguous]
    assert len(ambiguous) == 6
    for found in ambiguous:
        names = tuple(found.task.targets)
        assert len(names) in (2, 3)
        reached = {c.scenario.reaches[0].person_target for c in found.conditions}
        assert reached == set(names)
        assert all(c.scenario.candidates(0) == names for c in found.conditions)
    assert all(len(t.task.targets) == 1 for t in tasks if not t.task.ambiguous)


def test_tuning_and_test_share_no_person_place_or_noise():
    found = {split: [task_conditions(split, n) for n in range(TASKS)] for split in SPLITS}
    people = [task.task.person for tasks in found.values() for task in tasks]
    assert len({person.shoulder for person in people}) == 2 * TASKS
    seeds = [c.scenario.seed for tasks in found.values() for t in tasks for c in t.conditions]
    assert len(seeds) == 900
    assert len(set(seeds)) == 900


def test_repetitions_differ_by_motor_variability():
    motions = [c.person().motions[0] for c in task_conditions("test", 0).conditions]
    assert len({motion.end.tobytes() for motion in motions}) == CONDITIONS_A_TASK
    assert 0.001 < np.std([motion.end for motion in motions], axis=0).max() < 0.05


def test_every_draw_is_accounted_for():
    found = [task_conditions("test", number) for number in range(TASKS)]
    drawn = sum((task.drawn for task in found), Counter())
    rejected = sum((task.rejected for task in found), Counter())
    assert set(rejected) <= set(TASK_RULES) | set(CONDITION_RULES)
    assert drawn["tasks"] - sum(rejected[rule] for rule in TASK_RULES) == TASKS
    kept = drawn["conditions"] - sum(rejected[rule] for rule in CONDITION_RULES)
    assert kept == TASKS * CONDITIONS_A_TASK
    assert rejected["collision"] > 0


def test_the_same_whatever_was_drawn_before_and_in_another_process():
    text = "from hri_sim.benchmark.conditions import task_conditions as t; print(t('test', 7))"
    other = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, check=True)
    assert other.stdout.strip() == str(task_conditions("test", 7))


def test_unknown_split_is_refused():
    with pytest.raises(ConfigError, match="tuning, test"):
        task_conditions("training", 0)
