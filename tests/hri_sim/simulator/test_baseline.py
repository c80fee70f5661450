"""The run without replanning."""

import numpy as np
import pytest

from hri_planner.robot import load_robot
from hri_prediction.errors import DataError
from hri_sim.people.person import SimulatedPerson
from hri_sim.scenario.schema import PersonSpec, ReachSpec, Scenario
from hri_sim.simulator.baseline import JointMotion, run_baseline, run_motion

ROBOT = load_robot()
LEFT = np.array([0.75, -0.9, 0.0, 1.5, 0.0, -0.75, 0.0])
RIGHT = LEFT * [-1, 1, 1, 1, 1, 1, 1]
SCENARIO = Scenario(
    name="crossing",
    robot_start=tuple(LEFT),
    targets={
        "left": tuple(ROBOT.frames(LEFT)[3]),
        "right": tuple(ROBOT.frames(RIGHT)[3]),
        "cup": (0.42, 0.0, 0.12),
    },
    persons=(PersonSpec(shoulder=(0.78, 0.1, 0.42), home=(0.62, 0.22, 0.12)),),
    reaches=tuple(ReachSpec(robot_target=name) for name in ("right", "left")),
)


def reaching_person():
    person = SimulatedPerson(SCENARIO.persons[0], seed=1)
    person.plan_reach(SCENARIO.targets["cup"], 0.6, 1.2)
    return person.truth


def test_nominal_motions_collide_with_who_reaches_through_them():
    result = run_baseline(SCENARIO, reaching_person(), [0.5, 2.5])
    assert np.allclose(np.diff(result.time_s), 0.004)
    assert result.time_s[0] == pytest.approx(0.4)
    assert result.time_s[-1] == pytest.approx(4.6, abs=0.01)
    assert result.smallest < 0.0
    assert result.clearance_m[0] > 0.05
    for moment, name in ((2.2, "right"), (4.5, "left")):
        tool = ROBOT.frames(result.q[np.searchsorted(result.time_s, moment)])[3]
        np.testing.assert_allclose(tool, SCENARIO.targets[name], atol=1e-3)


def test_clearance_is_that_of_the_executed_motion():
    t = np.linspace(0.0, 1.5, 60)
    x = (t / 1.5)[:, None]
    q = LEFT + (10 * x**3 - 15 * x**4 + 6 * x**5) * (RIGHT - LEFT)
    result = run_motion(SCENARIO, [JointMotion(1.0, t, q)], {"person1": reaching_person()})
    assert np.abs(result.q[result.time_s >= 2.6] - RIGHT).max() < 1e-3
    empty = run_motion(SCENARIO, [JointMotion(1.0, t, q)], {})
    assert np.isinf(empty.clearance_m).all()


def test_motions_must_follow_each_other():
    t, q = np.array([0.0, 1.0]), np.stack((LEFT, LEFT))
    with pytest.raises(DataError, match=r"before the last one ends at 1.000 s"):
        run_motion(SCENARIO, [JointMotion(0.0, t, q), JointMotion(0.5, t, q)], {})
    with pytest.raises(DataError, match="no motion"):
        run_motion(SCENARIO, [], {})
    with pytest.raises(DataError, match="3 starts"):
        run_baseline(SCENARIO, reaching_person(), [0.0, 3.0, 6.0])
