"""Plans executed on paper and by the simulated robot: nearly the same, and repeatable."""

import json

import numpy as np
import pytest

from hri_planner.ptomp.plan import JointPlan, connect
from hri_planner.robot import load_robot
from hri_prediction.errors import ConfigError
from hri_sim.benchmark import command
from hri_sim.benchmark.conditions import task_conditions
from hri_sim.benchmark.episode import run_episode
from hri_sim.benchmark.execution import EXECUTIONS, PAPER, check_execution
from hri_sim.benchmark.in_mujoco import InMujoco
from hri_sim.benchmark.joints import OnPaper, standing
from hri_sim.benchmark.learning import task_library
from hri_sim.benchmark.planners import NOMINAL, PLANNERS, nominal_plan
from hri_sim.benchmark.run import Plan, do_unit
from hri_sim.benchmark.summary import summarise

TRACKING_RAD = 1e-3


@pytest.fixture(scope="module")
def condition():
    return task_conditions("tuning", 0).conditions[1]


@pytest.fixture(scope="module")
def library():
    return task_library("tuning", 0)


@pytest.fixture
def robot():
    return load_robot()


@pytest.mark.parametrize("planner", ["ptomp", NOMINAL])
def test_mujoco_tracks_what_is_planned(condition, library, planner, record_property):
    def run(execution):
        return run_episode(
            condition, PLANNERS[planner], library, slowdown=8.0, seed=0, execution=execution
        )

    paper, mujoco = run("paper"), run("mujoco")
    assert paper.tracking_error == 0.0
    record_property("tracking_error_rad", mujoco.tracking_error)
    assert 0.0 < mujoco.tracking_error < TRACKING_RAD, f"{mujoco.tracking_error} rad"
    assert (mujoco.replans, mujoco.failures) == (paper.replans, paper.failures)
    assert mujoco.clearance == pytest.approx(paper.clearance, abs=1e-3)
    assert mujoco.time_to_goal == pytest.approx(paper.time_to_goal, abs=0.02)
    assert mujoco.goal_error == pytest.approx(paper.goal_error, abs=1e-3)
    assert mujoco.accel_cost == pytest.approx(paper.accel_cost, rel=0.1)
    assert mujoco == run("mujoco")


def test_the_motion_is_that_of_the_joints(robot, condition):
    """Velocities and accelerations belong to the angles, and gravity does not move the arm."""
    scenario = condition.scenario
    joints = InMujoco(scenario)
    times = np.arange(0, 376) * 0.004
    q, qd, qdd = joints.move(nominal_plan(robot, scenario), times, 1.504)
    np.testing.assert_allclose(np.gradient(q, 0.004, axis=0)[1:-1], qd[1:-1], atol=5e-3)
    np.testing.assert_allclose(np.gradient(qd, 0.004, axis=0)[5:-5], qdd[5:-5], atol=0.3)
    np.testing.assert_array_equal(qdd[0], 0.0)
    assert np.abs(
        q - OnPaper(scenario).move(nominal_plan(robot, scenario), times, 1.504)[0]
    ).max() == (pytest.approx(joints.tracking_error))


def test_a_plan_that_is_too_fast_is_followed_later_and_the_planner_told(robot, condition):
    scenario = condition.scenario
    joints = InMujoco(scenario)
    start = np.array(scenario.robot_start)
    end = np.clip(start + 1.0, robot.lower, robot.upper)
    rest = (start, np.zeros(7), np.zeros(7))
    knots = np.array([0.0, 0.4])
    plan = JointPlan(knots, *connect(rest, end, 0.4, knots))
    q = joints.move(plan, np.arange(0, 75) * 0.004, 0.3)[0]
    followed = joints.followed(plan)
    assert followed.start_s > 0.02
    np.testing.assert_allclose(followed.sample(0.296)[0], q[-1], atol=0.02)
    # What follows from there is taken without a jump.
    rest_of_it = followed.remaining(0.3)
    joints.move(rest_of_it, np.arange(75, 150) * 0.004, 0.6)
    assert joints.refusals == 0
    assert joints.tracking_error < 0.03


def test_a_plan_that_the_controller_refuses_leaves_the_robot_where_it_was(robot, condition):
    scenario = condition.scenario
    joints = InMujoco(scenario)
    outside = JointPlan(
        np.array([0.0, 1.0]),
        np.stack((np.array(scenario.robot_start), robot.upper + 1.0)),
        np.zeros((2, 7)),
        np.zeros((2, 7)),
    )
    q = joints.move(outside, np.arange(0, 20) * 0.004, 0.08)[0]
    assert joints.refusals == 1
    np.testing.assert_allclose(q, np.broadcast_to(scenario.robot_start, q.shape), atol=1e-3)
    assert joints.followed(outside).end_s == 0.0
    stay = standing(np.array(scenario.robot_start))
    assert OnPaper(scenario).followed(stay) is stay


def test_command_gives_the_same_file_as_a_single_process(tmp_path, monkeypatch):
    options = ("--smoke", "--split", "tuning", "--budget", "64", "--execute", "mujoco")
    arguments = ("--out", str(tmp_path), "--planners", "ptomp_staying", "--workers", "2")
    monkeypatch.setattr("sys.argv", ["script", *options, *arguments])
    with pytest.raises(SystemExit):
        command.main()
    assert "Executed in MuJoCo" in (tmp_path / "results.md").read_text()
    results = json.loads((tmp_path / "results.json").read_text())
    assert results["execution"] == "mujoco"
    assert 0.0 < results["planners"]["ptomp_staying"]["tracking_error_rad"] < TRACKING_RAD
    plan = Plan((PLANNERS["ptomp_staying"],), "tuning", 64.0, (0,), (0, 4), 2, execution="mujoco")
    alone = summarise(plan, {unit: do_unit(plan, unit) for unit in plan.units})
    assert json.loads(json.dumps(alone)) == results


def test_ways_of_execution():
    assert PAPER in EXECUTIONS
    for name in EXECUTIONS:
        check_execution(name)
    with pytest.raises(ConfigError, match="paper, mujoco"):
        check_execution("gazebo")
