"""A policy's hand as joint plans: they join, arrive, keep limits and come to rest."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline

from hri_planner.policy.config import PolicyConfig
from hri_planner.policy.partner import Partner
from hri_planner.policy.planner import CONTROL_PERIOD_S, PolicyPlanner
from hri_planner.rnn.model_file import find_policy, load_policy, shipped_policies
from hri_planner.robot.model import load_robot
from hri_prediction.errors import ConfigError, PlanningError

ROBOT = load_robot()
START = np.array((-0.8847, -0.4889, 0.0, 1.6675, 0.0, -0.8601, 0.0))
GOAL = np.array((0.331, 0.406, 0.322))
INTERVAL, HORIZON = 0.016, 0.064
ARM = np.array(((0.9, 0.0, 0.4), (0.7, 0.1, 0.2), (0.6, 0.05, 0.2), (0.45, 0.1, 0.3)))


def new(floor: float | None = None, **config: float) -> PolicyPlanner:
    policy = load_policy(find_policy(shipped_policies()[0]))
    return PolicyPlanner(
        ROBOT, policy, PolicyConfig(**config), np.random.default_rng(0), floor=floor
    )


def run(planner: PolicyPlanner, seconds: float, partners=(), begin: float = 0.0) -> np.ndarray:
    """Tool positions at hand-overs; each plan begins where the one before leads, and keeps limits."""
    tools = []
    for step in range(round(seconds / INTERVAL)):
        time = begin + step * INTERVAL
        before = planner.plan
        assert before is not None
        q, qd, _ = before.sample(time)
        cycle = planner.replan(time, partners, HORIZON)
        assert cycle.plan.q[0] == pytest.approx(q, abs=1e-9)
        assert cycle.plan.qd[0] == pytest.approx(qd, abs=1e-9)
        assert (np.abs(cycle.plan.qd) <= 0.9 * ROBOT.velocity + 1e-9).all()
        assert ROBOT.within_limits(cycle.plan.q, 1e-9)
        assert (cycle.plan.qd[-1] == 0.0).all()
        # Not only at knots.
        fine = cycle.plan.sample(np.arange(cycle.plan.start_s, cycle.plan.end_s, 0.001))
        assert ROBOT.within_limits(fine[0], 1e-6)
        tools.append(ROBOT.frames(cycle.plan.q[0])[3])
    return np.array(tools)


def test_the_tool_arrives_and_is_held() -> None:
    planner = new()
    planner.start(START, np.zeros(7), GOAL, 0.0)
    tools = run(planner, 4.0)
    assert np.linalg.norm(tools[-1] - GOAL) < 0.004
    assert planner.replan(4.0, (), HORIZON).stage == "holding"


def test_any_interval_gives_the_same_motion() -> None:
    """What is planned beyond a hand-over is what is planned at it, as long as nobody does anything."""
    paths = []
    for interval in (0.016, 0.048):
        planner = new()
        planner.start(START, np.zeros(7), GOAL, 0.0)
        for step in range(round(0.96 / interval)):
            plan = planner.replan(step * interval, (), HORIZON).plan
        paths.append(plan.sample(0.96)[0])
    assert paths[0] == pytest.approx(paths[1], abs=1e-9)


def test_the_arm_of_a_partner_in_the_way_is_kept_at_a_distance() -> None:
    planner = new()
    planner.start(START, np.zeros(7), GOAL, 0.0)
    partner = Partner(ARM[3], np.zeros(3), 0.0, ARM, np.zeros((4, 3)))
    tools = run(planner, 3.0, [partner])
    assert min(partner.distance(tool) for tool in tools) >= 0.15 - 1e-3
    without = new(filter=False)
    without.start(START, np.zeros(7), ARM[3] + (0.0, 0.0, 0.05), 0.0)
    tools = run(without, 3.0, [partner])
    assert min(partner.distance(tool) for tool in tools) < 0.15


def test_a_plan_that_is_dropped_is_as_if_it_had_not_been_made() -> None:
    planner = new()
    planner.start(START, np.zeros(7), GOAL, 0.0)
    run(planner, 0.32)
    before = planner.snapshot()
    first = planner.replan(0.32, (), HORIZON).plan
    planner.restore(before)
    assert planner.replan(0.32, (), HORIZON).plan.q == pytest.approx(first.q, abs=1e-12)
    # The next begins on the plan before, one interval later.
    planner.restore(before)
    later = planner.replan(0.336, (), HORIZON).plan
    assert later.q[0] == pytest.approx(first.sample(0.336)[0], abs=1e-9)


def test_it_goes_on_from_wherever_the_robot_is() -> None:
    planner = new()
    planner.start(START, np.zeros(7), GOAL, 0.0)
    run(planner, 0.32)
    assert planner.plan is not None
    q = planner.plan.sample(0.25)[0]
    planner.resync(q, np.zeros(7), 0.32)
    assert planner.replan(0.32, (), HORIZON).plan.q[0] == pytest.approx(q)
    assert np.linalg.norm(run(planner, 4.0, begin=0.336)[-1] - GOAL) < 0.004
    # Later on the same plan, as speed scaling makes it: off the grid of control steps.
    planner.start(START, np.zeros(7), GOAL, 0.0)
    run(planner, 0.32)
    planner.follow(planner.plan.shifted(0.0031))
    assert np.linalg.norm(run(planner, 4.0, begin=0.336)[-1] - GOAL) < 0.004


def test_a_robot_that_is_held_back_remembers_what_it_did_there() -> None:
    """Memory is that of the place on the way, not of where the plan would have ended."""
    planner = new()
    planner.start(START, np.zeros(7), GOAL, 0.0)
    run(planner, 0.32)
    passage = planner.snapshot().passage
    assert passage is not None
    hands = passage.hands
    for index in (0, 5, len(hands) - 1):
        behind = planner.plan
        assert behind is not None
        before = planner.snapshot()
        lag_s = 0.0017
        planner.follow(behind.shifted(lag_s))
        time_s = behind.start_s + index * CONTROL_PERIOD_S + lag_s
        # Half a millisecond off the grid of control steps.
        found = planner.replan(time_s + 0.0005, (), HORIZON).hand
        assert found.memory == pytest.approx(hands[index].memory)
        planner.restore(before)


NEAR = ROBOT.frames(START[None])[0, 3] + np.array((0.06, 0.0, 0.0))


@pytest.mark.parametrize(
    ("goal", "rate", "off_m"),
    [
        *((GOAL, rate, 0.003) for rate in (0.9, 0.5, 0.3, 0.1)),
        (GOAL, 0.03, 0.015),
        (NEAR, 0.3, 0.003),
        (NEAR, 0.05, 0.006),
    ],
)
def test_a_slowed_robot_takes_the_same_way(goal: np.ndarray, rate: float, off_m: float) -> None:
    planner = new()
    planner.start(START, np.zeros(7), goal, 0.0)
    fast = run(planner, 4.0)
    planner = new()
    planner.start(START, np.zeros(7), goal, 0.0)
    slow = [planner.replan(0.0, (), HORIZON).hand.position]
    for cycle in range(1, round(4.0 / (INTERVAL * rate))):
        assert planner.plan is not None
        # Of an interval the robot makes a part.
        planner.follow(planner.plan.shifted((1.0 - rate) * INTERVAL))
        slow.append(planner.replan(cycle * INTERVAL, (), HORIZON).hand.position)
    way = make_interp_spline(np.arange(len(fast)), fast)(np.arange(0.0, len(fast) - 0.9, 0.1))
    away = np.linalg.norm(np.array(slow)[:, None] - way, axis=2).min(axis=1)
    assert away.max() < off_m
    assert np.linalg.norm(slow[-1] - goal) < 0.004


def test_a_goal_that_moves_away_slowly_is_followed_without_beginning_anew() -> None:
    tool = ROBOT.frames(START[None])[0, 3]
    for direction in np.array(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, -1.0, 0.0))):
        planner = new()
        planner.start(START, np.zeros(7), tool + 0.03 * direction, 0.0)
        way = []
        for step in range(125):
            planner.retarget(tool + (0.03 + 0.1 * min(step * INTERVAL, 1.0)) * direction)
            way.append(planner.replan(step * INTERVAL, (), HORIZON).hand.position - tool)
        sideways = np.array(way) - np.outer(np.array(way) @ direction, direction)
        assert np.linalg.norm(sideways, axis=1).max() < 0.015


def test_a_goal_that_jumps_is_followed_without_a_jump() -> None:
    planner = new()
    planner.start(START, np.zeros(7), GOAL, 0.0)
    run(planner, 0.48)
    other = np.array((0.5, -0.1, 0.3))
    planner.check(other, START)
    planner.retarget(other)
    assert np.linalg.norm(run(planner, 4.0, begin=0.48)[-1] - other) < 0.004


@pytest.mark.parametrize("away_m", [0.0, 0.005, 0.02, 0.04])
def test_a_goal_next_to_the_hand_is_reached_without_a_detour(away_m: float) -> None:
    tool = ROBOT.frames(START[None])[0, 3]
    goal = tool + np.array((0.0, away_m, 0.0))
    planner = new()
    planner.start(START, np.zeros(7), goal, 0.0)
    way = run(planner, 3.0)
    assert np.linalg.norm(way - goal, axis=1).max() < away_m + 0.001
    assert np.linalg.norm((way - goal)[:, [0, 2]], axis=1).max() < 0.003
    assert np.linalg.norm(way[-1] - goal) < 0.001
    # Halted, and let go on, it stays.
    assert planner.plan is not None
    planner.resync(planner.plan.sample(3.0)[0], np.zeros(7), 3.0)
    assert np.linalg.norm(run(planner, 1.0, begin=3.016) - goal, axis=1).max() < 0.002


def test_the_tool_stays_above_the_floor() -> None:
    planner = new(floor=0.25)
    planner.start(START, np.zeros(7), GOAL, 0.0)
    planner.retarget(np.array((0.4, 0.2, 0.1)))
    assert run(planner, 3.0)[:, 2].min() > 0.25 - 2e-3


def test_what_cannot_be_done_is_refused() -> None:
    planner = new(floor=0.05)
    for goal, word in (
        ((np.nan, 0.0, 0.3), "finite"),
        ((0.4, 0.2, 0.0), "table"),
        ((2.0, 0.0, 0.3), "out of reach"),
        ((0.05, 0.0, 0.31), "out of reach"),
    ):
        with pytest.raises(PlanningError, match=word):
            planner.start(START, np.zeros(7), np.array(goal), 0.0)
    with pytest.raises(PlanningError, match="limits"):
        planner.start(np.full(7, 9.0), np.zeros(7), GOAL, 0.0)
    with pytest.raises(PlanningError, match="without an active reach"):
        planner.replan(0.0, (), HORIZON)
    with pytest.raises(ConfigError, match="partner_acceleration"):
        PolicyConfig(partner_acceleration=9.0)
    assert INTERVAL / CONTROL_PERIOD_S == 4.0


def test_a_network_that_has_settled_elsewhere_begins_anew() -> None:
    policy = load_policy(find_policy(shipped_policies()[0]))
    still = replace(policy.network, weight=0.0 * policy.network.weight, bias=np.zeros(3))
    planner = PolicyPlanner(
        ROBOT, replace(policy, network=still), PolicyConfig(), np.random.default_rng(0)
    )
    planner.start(START, np.zeros(7), GOAL, 0.0)
    forgot = [
        step * INTERVAL
        for step in range(1, 100)
        if not planner.replan(step * INTERVAL, (), HORIZON).hand.memory.any()
    ]
    # The first after the start is without memory too; from then on each 0.4 s.
    assert np.diff(forgot[1:]) == pytest.approx(0.4, abs=INTERVAL + 1e-9)
    assert len(forgot) >= 3
    # One that moves gets to its goal from any memory.
    planner = new()
    planner.start(START, np.zeros(7), GOAL, 0.0)
    run(planner, 0.32)
    assert planner.plan is not None
    odd = np.full_like(planner.model.network.initial_state(), 0.9)
    now = planner.snapshot()
    assert now.passage is not None
    hands = tuple(replace(hand, memory=odd) for hand in now.passage.hands)
    planner.restore(replace(now, passage=replace(now.passage, hands=hands)))
    assert np.linalg.norm(run(planner, 9.0, begin=0.32)[-1] - GOAL) < 0.01
