"""Movement primitives as joint plans: they arrive, keep clear, and know their goals and the way home."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hri_planner.dmp.model_file import save_dmp
from hri_planner.dmp.policy import DmpPolicy
from hri_planner.dmp.potential_field import FieldConfig
from hri_planner.dmp.runner import DmpRunner
from hri_planner.pibb.initial import straight_policy
from hri_planner.policy.config import PolicyConfig
from hri_planner.policy.model_file import find_any, load_any
from hri_planner.policy.partner import Partner
from hri_planner.policy.planner import PolicyPlanner, limits_of
from hri_planner.policy.separation import NO_BOXES
from hri_planner.policy.tool_velocity import ToolVelocity, ToolVelocityConfig
from hri_planner.rnn.model import PolicyModel
from hri_planner.rnn.model_file import find_policy, load_policy, shipped_policies
from hri_planner.robot.model import load_robot
from hri_prediction.errors import ConfigError, DataError, PlanningError

ROBOT = load_robot()
POSTURE = np.array((0.0, -0.1376, 0.0, 1.9745, 0.0, -1.0, 0.0))
START = ROBOT.frames(POSTURE)[3]
GOALS = {"left": np.array((0.56, 0.24, 0.12)), "right": np.array((0.56, -0.24, 0.12))}
BOX = np.array([((0.48, 0.13, 0.15), (0.03, 0.03, 0.05))])
POLICY = straight_policy(ROBOT, POSTURE, GOALS, NO_BOXES, 2.0)
INTERVAL, HORIZON = 0.032, 0.128
AT_REST = np.zeros(7)


def new(policy: DmpPolicy | PolicyModel = POLICY, boxes=NO_BOXES, floor=None, **config: Any):
    return PolicyPlanner(
        ROBOT, policy, PolicyConfig(**config), np.random.default_rng(0), floor=floor, boxes=boxes
    )


def run(planner: PolicyPlanner, seconds: float, partners=(), begin: float = 0.0) -> np.ndarray:
    """Tool positions every 4 ms; each plan begins where the one before leads, and keeps limits."""
    tools = []
    for step in range(round(seconds / INTERVAL)):
        time = begin + step * INTERVAL
        assert planner.plan is not None
        q, qd, _ = planner.plan.sample(time)
        seen = [replace(p.later(time - begin), age=0.0) for p in partners]
        cycle = planner.replan(time, seen, HORIZON)
        assert cycle.plan.q[0] == pytest.approx(q, abs=1e-9)
        assert cycle.plan.qd[0] == pytest.approx(qd, abs=1e-9)
        assert (np.abs(cycle.plan.qd) <= 0.9 * ROBOT.velocity + 1e-9).all()
        assert ROBOT.within_limits(cycle.plan.q, 1e-9)
        assert (cycle.plan.qd[-1] == 0.0).all()
        now = time + 0.004 * np.arange(round(INTERVAL / 0.004))
        tools.append(ROBOT.frames(cycle.plan.sample(now)[0])[:, 3])
    return np.concatenate(tools)


@pytest.mark.parametrize("name", list(GOALS))
def test_the_tool_goes_the_way_that_was_learnt_and_is_held(name: str) -> None:
    planner = new()
    planner.start(POSTURE, AT_REST, GOALS[name], 0.0)
    tools = run(planner, 2.56)
    path = POLICY.path(name)
    assert np.linalg.norm(tools[: len(path)] - path, axis=1).max() < 1e-3
    assert np.linalg.norm(tools[-1] - GOALS[name]) < 5e-4
    cycle = planner.replan(2.56, (), HORIZON)
    assert (cycle.stage, cycle.reason, cycle.filtered) == ("holding", "", False)


def test_any_interval_gives_the_same_motion() -> None:
    paths = []
    for interval in (0.016, 0.048):
        planner = new()
        planner.start(POSTURE, AT_REST, GOALS["left"], 0.0)
        for step in range(round(0.96 / interval)):
            plan = planner.replan(step * interval, (), 0.064).plan
        paths.append(plan.sample(0.96)[0])
    assert paths[0] == pytest.approx(paths[1], abs=1e-9)


def test_a_reach_takes_as_long_as_is_asked_for() -> None:
    slow = new()
    slow.start(POSTURE, AT_REST, GOALS["left"], 0.0, duration_s=4.0)
    tools = run(slow, 4.48)
    path = POLICY.response(4.0).rollouts(START, GOALS["left"], POLICY.weights["left"])
    assert np.linalg.norm(tools[: len(path)] - path, axis=1).max() < 1e-3
    # The next one takes again what the policy says.
    slow.start(POSTURE, AT_REST, GOALS["left"], 10.0)
    assert np.linalg.norm(run(slow, 2.24, begin=10.0)[500] - GOALS["left"]) < 1e-3


@pytest.mark.parametrize("duration", [-1.0, np.nan, np.inf, 1e-6, 1e6])
def test_durations_that_are_none_are_refused(duration: float) -> None:
    planner = new()
    with pytest.raises(PlanningError, match="duration"):
        planner.start(POSTURE, AT_REST, GOALS["left"], 0.0, duration_s=duration)


def test_goals_that_the_policy_does_not_know_are_answered_with_those_that_it_does() -> None:
    planner = new()
    with pytest.raises(PlanningError, match=r"knows no way to \(0\.600, 0\.000, 0\.200\)") as found:
        planner.start(POSTURE, AT_REST, np.array((0.6, 0.0, 0.2)), 0.0)
    for name in ("left (0.560, 0.240, 0.120)", "right (0.560, -0.240, 0.120)", "start (0.394"):
        assert name in str(found.value)
    assert planner.plan is None


def test_it_goes_home_the_way_it_came() -> None:
    planner = new()
    planner.start(POSTURE, AT_REST, GOALS["left"], 0.0)
    there = run(planner, 2.56)
    assert planner.plan is not None
    q, qd, _ = planner.plan.sample(2.56)
    planner.start(q, qd, START, 2.56)
    back = run(planner, 2.56, begin=2.56)
    assert np.linalg.norm(back[-1] - START) < 5e-4
    way = there[:500]
    off = [np.linalg.norm(way - at, axis=1).min() for at in back]
    assert max(off) < 5e-3
    # And from there again to another goal.
    q, qd, _ = planner.plan.sample(5.12)
    planner.start(q, qd, GOALS["right"], 5.12)
    again = run(planner, 2.56, begin=5.12)
    assert np.linalg.norm(again[-1] - GOALS["right"]) < 5e-4


def test_from_elsewhere_the_way_is_a_similar_one() -> None:
    elsewhere = POSTURE + np.array((0.3, 0.1, 0.0, -0.2, 0.0, 0.1, 0.0))
    tool = ROBOT.frames(elsewhere)[3]
    raised = POLICY.moved(START, POSTURE)
    bow = np.zeros((3, 20))
    bow[2] = 0.1 * np.sin(np.linspace(0.0, np.pi, 20))
    raised = DmpPolicy(START, POSTURE, GOALS, {n: w + bow for n, w in raised.weights.items()}, 2.0)
    planner = new(raised)
    planner.start(elsewhere, AT_REST, GOALS["right"], 0.0)
    tools = run(planner, 2.56)
    path = raised.moved(tool, elsewhere).path("right")
    assert np.linalg.norm(tools[: len(path)] - path, axis=1).max() < 1e-3
    assert np.linalg.norm(tools[-1] - GOALS["right"]) < 5e-4


def arm(hand: np.ndarray, velocity=(0.0, 0.0, 0.0)) -> Partner:
    joints = hand + np.array(((0.45, 0.1, 0.3), (0.25, 0.05, 0.1), (0.05, 0.02, 0.0), (0, 0, 0)))
    speeds = np.tile(velocity, (4, 1))
    return Partner(hand, speeds[-1], 0.0, joints, speeds)


@pytest.mark.parametrize("strength", [0.0, FieldConfig.strength])
def test_an_arm_in_the_way_is_kept_clear_of(strength: float) -> None:
    partner = arm(0.5 * (START + GOALS["left"]) + np.array((0.0, 0.02, 0.0)))
    planner = new(field_strength=strength)
    planner.start(POSTURE, AT_REST, GOALS["left"], 0.0)
    tools = run(planner, 3.2, [partner])
    assert min(partner.distance(tool) for tool in tools) >= 0.15 - 2e-3
    assert np.linalg.norm(tools[-1] - START) > 0.02


def test_whoever_leaves_lets_the_tool_arrive() -> None:
    hand = 0.5 * (START + GOALS["left"])
    planner = new()
    planner.start(POSTURE, AT_REST, GOALS["left"], 0.0)
    stays = arm(hand)
    run(planner, 1.6, [stays])
    away = arm(hand, (0.4, 0.0, 0.3))
    tools = run(planner, 4.8, [away], begin=1.6)
    assert np.linalg.norm(tools[-1] - GOALS["left"]) < 1e-3
    assert planner.replan(6.4, (), HORIZON).stage == "holding"


def test_what_kept_it_is_said() -> None:
    planner = new(field_strength=0.0)
    planner.start(POSTURE, AT_REST, GOALS["left"], 0.0)
    partner = arm(START + np.array((0.05, 0.16, -0.02)))
    reasons = set()
    for step in range(40):
        cycle = planner.replan(step * INTERVAL, [partner], HORIZON)
        reasons.add(cycle.reason)
        assert cycle.filtered == (cycle.reason.startswith("kept at a distance"))
    assert any("kept at a distance from the partner, the table or a box" in r for r in reasons)


@pytest.mark.parametrize("strength", [0.0, FieldConfig.strength])
def test_boxes_are_kept_out_of(strength: float) -> None:
    planner = new(boxes=BOX, field_strength=strength)
    planner.start(POSTURE, AT_REST, GOALS["left"], 0.0)
    tools = run(planner, 3.2)
    off = np.linalg.norm(np.maximum(np.abs(tools - BOX[0, 0]) - BOX[0, 1], 0.0), axis=1)
    assert off.min() >= float(ROBOT.capsule_radii[2]) + 0.02 - 1e-3
    free = new()
    free.start(POSTURE, AT_REST, GOALS["left"], 0.0)
    off = np.linalg.norm(np.maximum(np.abs(run(free, 2.24) - BOX[0, 0]) - BOX[0, 1], 0.0), axis=1)
    assert off.min() < 0.03, "which was in the way"


def test_goals_in_boxes_are_refused() -> None:
    """Also the one that a goal moves to."""
    planner = new(boxes=BOX)
    for over in (0.0, 0.1, 0.12):  # in it, too near for the tool, and for the filter
        with pytest.raises(PlanningError, match=r"cm from box 0; expected at least 8\.0 cm"):
            planner.check(BOX[0, 0] + np.array((0.0, 0.0, over)), POSTURE)
    planner.check(BOX[0, 0] + np.array((0.0, 0.0, 0.131)), POSTURE)


def test_the_floor_is_kept_above() -> None:
    planner = new(floor=0.1)
    with pytest.raises(PlanningError, match="puts the hand into the table"):
        planner.start(POSTURE, AT_REST, GOALS["left"] - np.array((0.0, 0.0, 0.05)), 0.0)
    low = {name: goal - np.array((0.0, 0.0, 0.019)) for name, goal in GOALS.items()}
    sunk = DmpPolicy(START, POSTURE, low, {n: np.zeros((3, 20)) - 0.3 for n in low}, 2.0)
    planner = new(sunk, floor=0.1)
    planner.start(POSTURE, AT_REST, low["left"], 0.0)
    assert run(planner, 2.56)[:, 2].min() >= 0.1 - 1e-3


def test_a_robot_that_was_stopped_goes_on_to_its_goal() -> None:
    planner = new()
    planner.start(POSTURE, AT_REST, GOALS["left"], 0.0)
    run(planner, 0.96)
    assert planner.plan is not None
    q, _, _ = planner.plan.sample(0.96)
    planner.resync(q, AT_REST, 1.5)
    tools = run(planner, 3.2, begin=1.5)
    assert np.linalg.norm(tools[0] - ROBOT.frames(q)[3]) < 1e-3
    assert np.linalg.norm(tools[-1] - GOALS["left"]) < 1e-3


def test_a_robot_that_was_stopped_does_not_make_its_detour_again() -> None:
    """It goes on with what is left of its way."""
    bow = np.zeros((3, 20))
    bow[2] = 0.25 * np.sin(np.linspace(0.0, np.pi, 20))
    raised = DmpPolicy(START, POSTURE, GOALS, dict.fromkeys(GOALS, bow), 2.5)
    planner = new(raised)
    planner.start(POSTURE, AT_REST, GOALS["left"], 0.0)
    run(planner, 1.6)
    assert planner.plan is not None
    q, _, _ = planner.plan.sample(1.6)
    begun = ROBOT.frames(q)[3]
    planner.resync(q, AT_REST, 2.5)
    after = run(planner, 3.2, begin=2.5)
    left = raised.path("left")
    left = left[int(np.argmin(np.linalg.norm(left - begun, axis=1))) :]
    off = np.linalg.norm(after[:, None] - left[None, ::5], axis=2).min(axis=1)
    assert off.max() < 0.02
    went, rest = (np.linalg.norm(np.diff(way, axis=0), axis=1).sum() for way in (after, left))
    assert went < 1.1 * rest
    assert np.linalg.norm(after[-1] - GOALS["left"]) < 1e-3


def test_small_ways_begin_gently() -> None:
    """A goal next to the start is reached in the same time, not at once."""
    goals = {"near": START + np.array((0.03, 0.0, -0.02))}
    planner = new(straight_policy(ROBOT, POSTURE, goals, NO_BOXES, 2.0))
    planner.start(POSTURE, AT_REST, goals["near"], 0.0)
    tools = run(planner, 2.24)
    bends = np.linalg.norm(np.diff(tools, 2, axis=0), axis=1) / 0.004**2
    assert bends.max() < 0.25
    assert np.linalg.norm(tools[-1] - goals["near"]) < 5e-4


def test_a_goal_that_moves_a_little_is_followed() -> None:
    planner = new()
    planner.start(POSTURE, AT_REST, GOALS["left"], 0.0)
    run(planner, 0.64)
    planner.retarget(GOALS["left"] + np.array((0.0, 0.02, 0.0)))
    tools = run(planner, 2.56, begin=0.64)
    assert np.linalg.norm(tools[-1] - GOALS["left"] - (0.0, 0.02, 0.0)) < 5e-4


def test_networks_and_primitives_take_turns() -> None:
    network = load_policy(find_policy(shipped_policies()[0]))
    planner = new()
    planner.start(POSTURE, AT_REST, GOALS["left"], 0.0)
    run(planner, 0.32)
    planner.check_model(network)
    assert planner.model is POLICY
    planner.use(network)
    assert planner.model is network
    assert planner.plan is None
    anywhere = np.array((0.5, 0.1, 0.3))
    planner.start(POSTURE, AT_REST, anywhere, 1.0)
    run(planner, 0.64, begin=1.0)
    planner.use(POLICY)
    with pytest.raises(PlanningError, match="knows no way"):
        planner.start(POSTURE, AT_REST, anywhere, 3.0)
    planner.start(POSTURE, AT_REST, GOALS["right"], 3.0)
    assert np.linalg.norm(run(planner, 2.56, begin=3.0)[-1] - GOALS["right"]) < 5e-4


def test_what_did_not_take_effect_is_undone() -> None:
    planner = new()
    planner.start(POSTURE, AT_REST, GOALS["left"], 0.0)
    run(planner, 0.64)
    before = planner.snapshot()
    planner.replan(0.64, [arm(START + 0.15)], HORIZON)
    planner.restore(before)
    one = planner.replan(0.64, (), HORIZON).plan
    planner.restore(before)
    other = planner.replan(0.64, (), HORIZON).plan
    np.testing.assert_array_equal(one.q, other.q)


def test_joints_keep_to_the_posture_of_the_policy() -> None:
    assert new()._runner.posture is POLICY.posture
    planner = new()
    planner.start(POSTURE, AT_REST, GOALS["left"], 0.0)
    run(planner, 2.24)
    assert planner.plan is not None
    planner.start(planner.plan.sample(2.24)[0], AT_REST, START, 2.24)
    run(planner, 2.24, begin=2.24)
    assert np.abs(planner.plan.sample(4.4)[0] - POSTURE).max() < 0.1


def runner() -> DmpRunner:
    limits = limits_of(ROBOT, PolicyConfig(), floor=None)
    return DmpRunner(POLICY, FieldConfig(), limits, 0.004)


def test_what_is_not_finite_is_refused() -> None:
    own, inverse = runner(), ToolVelocity(ROBOT, ToolVelocityConfig())
    own.set_out(START, GOALS["left"], 0.0)
    for place, speed in (
        (START * np.nan, np.zeros(3)),
        (START, np.full(3, np.inf)),
        (START[:2], 0.0),
    ):
        with pytest.raises(DataError, match="hand at"):
            own.begin(place, speed)
    hand = own.begin(START)
    with pytest.raises(DataError, match="goal"):
        own.move(hand, GOALS["left"] * np.nan, [], POSTURE, AT_REST, 4, inverse)
    for bad in (arm(START * np.nan), Partner(START, np.array((np.nan, 0.0, 0.0)))):
        with pytest.raises(DataError, match="a partner is not finite"):
            own.move(hand, GOALS["left"], [bad], POSTURE, AT_REST, 4, inverse)


def test_hands_say_what_a_motion_remembers() -> None:
    own, inverse = runner(), ToolVelocity(ROBOT, ToolVelocityConfig(), POSTURE)
    own.set_out(START, GOALS["left"], 0.0)
    moved, hands = own.move(own.begin(START), GOALS["left"], [], POSTURE, AT_REST, 5, inverse)
    assert len(hands) == len(moved.position) == 5
    for step, hand in enumerate(hands):
        np.testing.assert_array_equal(hand.position, moved.position[step])
        np.testing.assert_array_equal(hand.velocity, moved.velocity[step])
        assert hand.memory[0] == pytest.approx((step + 1) * 0.004 / 2.0)
        assert not hand.filtered
    assert own.settled(GOALS["left"])[0] == 1.0
    assert not own.recurrent


def test_policies_of_both_kinds_are_loaded(tmp_path: Path) -> None:
    save_dmp(tmp_path / "p.npz", POLICY, {})
    found = load_any(tmp_path / "p.npz")
    assert isinstance(found, DmpPolicy)
    assert found.names == POLICY.names
    assert isinstance(load_any(find_any(shipped_policies()[0])), PolicyModel)
    assert find_any("a/p.npz") == Path("a/p.npz")
    with pytest.raises(ConfigError, match=r"policy 'x'; expected a \.npz file, or one of .*rnn"):
        find_any("x")
    (tmp_path / "q.npz").write_bytes(b"PK")
    with pytest.raises(DataError, match=r"q\.npz"):
        load_any(tmp_path / "q.npz")
