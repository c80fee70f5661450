"""Where motions come from: timing, postures, detours, the way around."""

import numpy as np
import pytest
from reach_trials import REST

from hri_planner.ptomp import HumanForecast, JointPlan
from hri_planner.ptomp.around import WayAround
from hri_planner.ptomp.detour import detour_motions, retreat_motions
from hri_planner.ptomp.motion import Grid, from_plan
from hri_planner.ptomp.plan import connect
from hri_planner.ptomp.posture import posture_motions
from hri_planner.ptomp.timing import direct_motions, fastest_duration, slowed_motions, stop_motion
from hri_planner.robot import load_robot, solve_ik

ROBOT = load_robot()
LIMIT = 12.0
RNG = np.random.default_rng(0)
START = solve_ik(ROBOT, np.array([0.45, -0.3, 0.2]), REST, RNG)
GOAL = np.array([0.5, 0.3, 0.2])
END = solve_ik(ROBOT, GOAL, START, RNG)
STEP = 1.5 / 42


def _plan():
    t = np.linspace(0, 1.5, 43)
    return JointPlan(t, *connect((START, np.zeros(7), np.zeros(7)), END, 1.5, t))


def _grid(time_s=12 * STEP, knots=70):
    plan = _plan()
    past = plan.sample(time_s - STEP * np.array([2.0, 1.0]))[0]
    return Grid(time_s, STEP, knots, plan.sample(time_s), past)


def _check(motion, grid):
    """Starts at the hand-over's state, ends at rest, keeps what it says about the goal."""
    for part, state in zip((motion.q, motion.qd, motion.qdd), grid.state, strict=True):
        np.testing.assert_allclose(part[0], state, atol=1e-12)
    assert not motion.qd[-1].any()
    assert not motion.qdd[-1].any()
    if motion.arrival is not None:
        tools = ROBOT.frames(motion.q[motion.arrival :])[:, 3]
        assert np.abs(tools - GOAL).max() < 1e-6
        assert not motion.qd[motion.arrival :].any()


def test_all_motions_are_sound():
    plan, grid = _plan(), _grid()
    present = from_plan(plan, grid, True)
    arm = HumanForecast(
        0.0, 1.0, np.full((1, 4, 3), 0.5), np.zeros((1, 4)), np.array([0.05, 0.04, 0.05])
    )
    motions = [
        present,
        stop_motion(ROBOT, LIMIT, grid),
        *direct_motions(ROBOT, LIMIT, grid, END),
        *slowed_motions(plan, grid),
        *detour_motions(present, grid, ROBOT),
        *retreat_motions(grid, ROBOT, LIMIT, [arm], START),
        *posture_motions(present, grid, ROBOT, GOAL, 16, np.random.default_rng(0)),
        *WayAround(ROBOT, LIMIT, np.random.default_rng(0)).proposals(grid, GOAL, END),
    ]
    kinds = {motion.kind for motion in motions}
    assert kinds == {
        "plan", "stop", "direct", "slow", "pause", "detour", "retreat", "posture", "around"
    }  # fmt: skip
    for motion in motions:
        _check(motion, grid)


@pytest.mark.parametrize("seed", range(20))
def test_fastest_duration_keeps_limits_and_is_short(seed):
    rng = np.random.default_rng(seed)
    q = rng.uniform(0.7 * ROBOT.lower, 0.7 * ROBOT.upper)
    end = rng.uniform(0.7 * ROBOT.lower, 0.7 * ROBOT.upper)
    state = (q, 0.3 * rng.uniform(-1, 1, 7) * ROBOT.velocity, np.zeros(7))
    duration = fastest_duration(ROBOT, LIMIT, state, end)
    _, qd, qdd = connect(state, end, duration, np.linspace(0, duration, 200))
    assert np.all(np.abs(qd) <= ROBOT.velocity)
    assert np.abs(qdd).max() <= 1.05 * LIMIT
    _, qd, qdd = connect(state, end, duration / 1.3, np.linspace(0, duration / 1.3, 200))
    assert np.any(np.abs(qd) > 0.9 * ROBOT.velocity) or np.abs(qdd).max() > 0.9 * LIMIT


def test_slowed_motions_keep_the_path():
    plan, grid = _plan(), _grid()
    path = plan.sample(np.linspace(0, 1.5, 3000))[0]
    for motion in slowed_motions(plan, grid):
        gaps = np.linalg.norm(motion.q[:, None] - path[None], axis=-1).min(axis=1)
        assert gaps.max() < 2e-3
        assert motion.arrival > from_plan(plan, grid, True).arrival


def test_the_way_around_is_remembered():
    grid = _grid(0.0)
    around = WayAround(ROBOT, LIMIT, np.random.default_rng(0))
    way = around.proposals(grid, GOAL, END)[5]
    nothing = around.memory
    around.remember(way, grid)
    remembered = around.memory
    again = around.proposals(grid, GOAL, END)[0]
    np.testing.assert_allclose(again.q, way.q, atol=1e-9)
    around.forget()
    assert np.abs(around.proposals(grid, GOAL, END)[0].q - way.q).max() > 0.01
    around.memory = remembered
    np.testing.assert_allclose(around.proposals(grid, GOAL, END)[0].q, way.q, atol=1e-9)
    around.memory = nothing
    assert around.memory[0] is None
