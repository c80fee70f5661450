"""The planner's contract: hand-over, goal, limits, reasons."""

import numpy as np
import pytest
from reach_trials import REST, TABLE

from hri_planner.ptomp import HumanForecast, JointPlan, PtompConfig, PtompPlanner
from hri_planner.robot import load_robot, solve_ik
from hri_prediction.errors import PlanningError
from hri_prediction.geometry import capsule_distances

ROBOT = load_robot()
RADII = np.array([0.05, 0.04, 0.05])
START = solve_ik(ROBOT, np.array([0.45, -0.35, 0.2]), REST, np.random.default_rng(0))
GOAL = np.array([0.45, 0.35, 0.2])
FAR_ARM = np.array([[0.9, 0, 0.5], [0.9, 0, 0.25], [0.8, 0, 0.1], [0.75, 0, 0.1]])


def _planner(seed=0, **changes):
    return PtompPlanner(ROBOT, PtompConfig(**changes), np.random.default_rng(seed), TABLE)


def _still(arm, time_s=0.0):
    return HumanForecast(time_s, 0.1, np.asarray(arm)[None], np.full((1, 4), 0.01), RADII)


def _run(planner, forecast_at, interval=1.5 / 42, limit=4.0, iterations=8):
    now, results = 0.0, []
    while now < limit and not planner.finished(now):
        before = planner.plan
        handover = now + interval
        result = planner.replan(handover, forecast_at(now), iterations=iterations)
        for old, new in zip(before.sample(handover), result.plan.sample(handover), strict=True):
            np.testing.assert_allclose(new, old, atol=1e-9)
        results.append(result)
        now = handover
    return now, results


@pytest.mark.parametrize("interval", [1.5 / 42, 0.02, 0.0313, 0.05])
def test_reaches_the_goal_on_any_hand_over_grid(interval):
    planner = _planner()
    planner.start(START, np.zeros(7), GOAL, 1.5, 0.0)
    now, results = _run(planner, lambda t: [_still(FAR_ARM, t)], interval)
    assert now < 1.5 + 2 * interval
    q, qd, _ = planner.plan.sample(now)
    assert np.linalg.norm(ROBOT.frames(q)[3] - GOAL) < 1e-3
    assert np.abs(qd).max() < 1e-9
    for result in results:
        t = np.linspace(result.plan.start_s, result.plan.end_s, 100)
        q, qd, qdd = result.plan.sample(t)
        assert ROBOT.within_limits(q)
        assert np.all(np.abs(qd) <= ROBOT.velocity)
        assert np.abs(qdd).max() < 40.0
        assert result.feasible
        assert result.reason == ""
        assert result.goal_error_m < 1e-6


def test_a_reach_can_be_taken_over_with_other_time_steps():
    first, other, same = _planner(), _planner(1, num_timesteps=20, num_rollouts=10), _planner(2)
    with pytest.raises(PlanningError, match="without an active reach"):
        other.take_over(first)
    speed = np.linspace(-0.1, 0.1, 7)
    plan = first.start(START, speed, GOAL, 1.5, 0.3)
    np.testing.assert_array_equal(same.take_over(first).q, plan.q)
    taken = other.take_over(first)
    assert len(taken.time_s) == 21
    times = np.linspace(0.3, plan.end_s, 50)
    for mine, its in zip(taken.sample(times), plan.sample(times), strict=True):
        np.testing.assert_allclose(mine, its, atol=1e-9)
    end = other.replan(0.4, [_still(FAR_ARM)], iterations=5).plan.q[-1]
    assert np.linalg.norm(ROBOT.frames(end)[3] - GOAL) < 1e-6
    assert first.plan is plan


def test_works_without_people():
    planner = _planner()
    planner.start(START, np.zeros(7), GOAL, 1.5, 0.0)
    result = planner.replan(0.04, [])
    assert result.feasible
    assert result.predicted_clearance_m == np.inf
    assert result.predicted_first_contact_s is None


def test_same_seed_same_plans():
    plans = []
    for _ in range(2):
        planner = _planner(5)
        planner.start(START, np.zeros(7), GOAL, 1.5, 0.0)
        _run(planner, lambda t: [_still(FAR_ARM - [0.3, 0, 0], t)], limit=0.3)
        plans.append(planner.plan.q)
    np.testing.assert_array_equal(*plans)


def test_evades_at_rest_and_comes_back():
    planner = _planner()
    planner.start(START, np.zeros(7), ROBOT.frames(START)[3], 0.3, 0.0)
    tool = ROBOT.frames(START)[3]
    close = FAR_ARM + (tool + np.array([0.03, 0, 0]) - FAR_ARM[3])
    now, stages, gap = 0.0, [], []
    while now < 4.0:
        share = np.clip((now - 0.5) / 0.7, 0, 1) if now < 2.2 else np.clip((2.9 - now) / 0.7, 0, 1)
        # The forecast: linear motion for another 0.35 s.
        ahead = np.clip(share + (0.5 if 0.5 <= now < 1.2 else 0.0), 0, 1)
        mean = FAR_ARM + np.array([share, ahead])[:, None, None] * (close - FAR_ARM)
        people = HumanForecast(now, 0.35, mean, np.full((2, 4), 0.01), RADII)
        result = planner.replan(now + 0.036, [people], iterations=40)
        q = planner.plan.sample(now + 0.036)[0]
        axes = np.stack((mean[0, :-1], mean[0, 1:]), axis=1)
        gap.append(
            capsule_distances(ROBOT.robot_capsules(q), ROBOT.capsule_radii, axes, RADII).min()
        )
        stages.append(result.stage)
        now += 0.036
    assert min(gap) > 0.0
    assert {"holding", "waiting"} <= set(stages)
    assert stages[-1] == "holding"
    assert planner.finished(now)


def test_blocked_goal_is_reported():
    planner = _planner()
    planner.start(START, np.zeros(7), GOAL, 1.5, 0.0)
    arm = FAR_ARM + (GOAL - FAR_ARM[3])
    _, results = _run(planner, lambda t: [_still(arm, t)], limit=2.5, iterations=20)
    last = results[-1]
    assert last.stage == "waiting"
    assert "no safe way" in last.reason
    assert last.predicted_clearance_m > 0.0
    assert not planner.finished(2.5)


def test_resync_starts_where_the_controller_is():
    planner = _planner()
    planner.start(START, np.zeros(7), GOAL, 1.5, 0.0)
    _run(planner, lambda t: [], limit=0.6)
    q, qd, _ = planner.plan.sample(0.4)
    planner.resync(q, 0.3 * qd, 0.6)
    here = planner.plan.sample(0.6)
    np.testing.assert_allclose(here[0], q, atol=1e-12)
    np.testing.assert_allclose(here[1], 0.3 * qd, atol=1e-12)
    result = planner.replan(0.64, [])
    assert result.goal_error_m < 1e-6
    assert np.all(np.abs(result.plan.qd) <= ROBOT.velocity)


def test_a_followed_plan_that_waits_is_not_taken_for_the_goal():
    planner = _planner()
    plan = planner.start(START, np.zeros(7), GOAL, 1.0, 0.0)
    # The controller never got beyond a plan that waits at the start.
    planner.follow(JointPlan(np.array([0.4]), START[None], np.zeros((1, 7)), np.zeros((1, 7))))
    assert not planner.finished(0.5)
    result = planner.replan(0.5, [])
    assert result.stage == "reaching"
    assert result.goal_error_m < 1e-6
    planner.follow(plan.shifted(0.2))
    assert planner.finished(1.2)


def test_impossible_requests_say_why():
    planner = _planner()
    with pytest.raises(PlanningError, match="out of reach by"):
        planner.start(START, np.zeros(7), np.array([1.2, 0, 0.2]), 1.5, 0.0)
    with pytest.raises(PlanningError, match="into the table"):
        planner.start(START, np.zeros(7), np.array([0.5, 0, 0.0]), 1.5, 0.0)
    with pytest.raises(PlanningError, match="joint limits"):
        planner.start(START + 4.0, np.zeros(7), GOAL, 1.5, 0.0)
    with pytest.raises(PlanningError, match="finite"):
        planner.start(START * np.nan, np.zeros(7), GOAL, 1.5, 0.0)
    with pytest.raises(PlanningError, match="duration"):
        planner.start(START, np.zeros(7), GOAL, 0.0, 0.0)
    for call in (lambda: planner.replan(0.1, []), lambda: planner.resync(START, START, 0.0)):
        with pytest.raises(PlanningError, match="without an active reach"):
            call()


@pytest.mark.parametrize("duration", [1.5, 3.0])
def test_free_steps_are_those_of_the_motion_that_was_asked_for(duration):
    planner = _planner()
    planner.start(START, np.zeros(7), GOAL, duration, 0.0)
    found = [planner.free_steps(share * duration) for share in (0.0, 0.5, 1.0, 2.0)]
    assert found == [42, 21, 0, 0]
