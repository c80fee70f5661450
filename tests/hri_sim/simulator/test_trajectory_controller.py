"""The trajectory controller: splines, scaling, stops, refusals, limits."""

import numpy as np
import pytest
from controlled import END, NAMES, ROBOT, START, STEP, Run, min_jerk
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import BPoly, CubicHermiteSpline

from hri_prediction.errors import ConfigError, DataError
from hri_sim.simulator import ControllerConfig, JointTrajectory, splines


@pytest.mark.parametrize("kind", ["quintic", "cubic"])
def test_splines_match_scipy(kind):
    rng = np.random.default_rng(1)
    t = np.cumsum(rng.uniform(0.05, 0.3, 9))
    q, v, a = rng.normal(size=(3, 9, 7))
    if kind == "cubic":
        ours, reference = splines.cubic(t, q, v), CubicHermiteSpline(t, q, v)
    else:
        ours = splines.quintic(t, q, v, a)
        reference = BPoly.from_derivatives(t, np.stack((q, v, a), axis=1))
    state = np.empty((3, 7))
    for x in rng.uniform(t[0], t[-1], 50):
        splines.evaluate(t, ours, x, int(rng.integers(9)), state)
        for order, row in enumerate(state):
            np.testing.assert_allclose(row, reference.derivative(order)(x), atol=1e-9)


def test_bounds_of_splines_hold_all_samples():
    rng = np.random.default_rng(2)
    t = np.linspace(0.0, 1.0, 6)
    path = splines.quintic(t, *rng.normal(size=(3, 6, 7)))
    low, high = splines.extremes(path, t)
    sampled_low, sampled_high = splines.sampled_extremes(path, t)
    assert (low <= sampled_low + 1e-12).all()
    assert (high >= sampled_high - 1e-12).all()


def test_follows_and_holds_the_end():
    run = Run()
    run.controller.accept(min_jerk(START, END))
    run.go(0.751)
    np.testing.assert_allclose(run.controller.q_ref, 0.5 * (START + END), atol=1e-12)
    assert run.controller.state == "tracking"
    assert run.controller.time_in_trajectory == pytest.approx(0.75)
    run.go(1.0)
    np.testing.assert_allclose(run.controller.q_ref, END, atol=1e-12)
    assert run.controller.state == "idle"
    assert run.controller.outcome == "end reached"
    run.assert_continuous()


def test_columns_in_any_order():
    trajectory = min_jerk(START, END)
    order = [3, 1, 6, 0, 2, 5, 4]
    shuffled = JointTrajectory(
        trajectory.stamp_ns,
        tuple(NAMES[i] for i in order),
        trajectory.time_s,
        trajectory.positions[:, order],
        trajectory.velocities[:, order],
        trajectory.accelerations[:, order],
    )
    runs = [Run(), Run()]
    for run, given_trajectory in zip(runs, (trajectory, shuffled), strict=True):
        run.controller.accept(given_trajectory)
        run.go(1.0)
    assert np.array_equal(runs[0].q, runs[1].q)


def test_zero_stamp_begins_now_and_a_lone_point_is_a_goal():
    run = Run()
    goal = JointTrajectory(0, NAMES, np.array([1.0]), END[None, :])
    run.controller.accept(goal)
    run.go(1.1)
    np.testing.assert_allclose(run.controller.q_ref, END, atol=1e-12)
    run.assert_continuous()


def test_empty_trajectory_stops_smoothly_on_the_path():
    run = Run()
    run.controller.accept(min_jerk(START, END))
    run.go(0.6)
    run.controller.accept(JointTrajectory(0, (), np.zeros(0), np.zeros((0, 0))))
    run.go(0.05)
    assert run.controller.state == "stopping"
    assert run.controller.reason == "stop was asked for"
    run.go(0.03)
    assert run.controller.state == "idle"
    assert run.controller.outcome == "stopped as asked"
    assert np.abs(run.controller.qd_ref).max() == 0.0
    run.assert_continuous()
    # On the straight joint path of the minimum-jerk motion.
    share = (run.q[-1] - START) / (END - START)[:]
    moved = END != START
    assert np.ptp(share[moved]) < 1e-9
    run.go(0.3)
    run.controller.accept(min_jerk(run.q[-1], END, stamp_ns=run.now))
    run.go(1.6)
    np.testing.assert_allclose(run.controller.q_ref, END, atol=1e-12)


def test_speed_scale_slows_time_on_the_same_path():
    run = Run(heartbeat=0.5)
    run.controller.chain.command(0.5, 0)
    run.go(0.1)
    run.controller.accept(min_jerk(START, END, stamp_ns=run.now))
    run.go(1.5)
    np.testing.assert_allclose(run.controller.q_ref, 0.5 * (START + END), atol=1e-3)
    assert max(run.scale) == 0.5
    run.go(1.51)
    np.testing.assert_allclose(run.controller.q_ref, END, atol=1e-12)


def test_scale_changes_are_ramped():
    run = Run(heartbeat=1.0, ramp_down=0.1, ramp_up=0.4)
    run.controller.accept(min_jerk(START, END))
    run.go(0.5)
    run.heartbeat = 0.2
    run.go(0.2)
    run.heartbeat = 1.0
    run.go(2.0)
    change = np.diff(run.scale)
    assert change.min() == pytest.approx(-0.01)
    assert change[:1500].max() == pytest.approx(0.0025)
    run.assert_continuous()


@pytest.mark.parametrize("moment", [0.3, 0.75, 1.1])
def test_missing_heartbeat_stops_within_200_ms_and_resumes(moment):
    run = Run(heartbeat=1.0, command_timeout=0.1)
    run.controller.chain.command(1.0, 0)
    run.controller.accept(min_jerk(START, END))
    run.go(moment)
    run.heartbeat = None
    run.go(0.2)
    assert np.abs(run.controller.qd_ref).max() < 0.01
    assert run.controller.state == "stopping"
    assert "heartbeat" in run.controller.reason
    run.go(0.5)
    run.heartbeat = 1.0
    run.go(2.0)
    np.testing.assert_allclose(run.controller.q_ref, END, atol=1e-12)
    run.assert_continuous()


def test_no_motion_before_the_first_heartbeat():
    run = Run(command_timeout=0.1)
    run.controller.accept(min_jerk(START, END))
    run.go(0.5)
    np.testing.assert_array_equal(run.controller.q_ref, START)


def test_plain_controller_needs_no_heartbeat():
    run = Run()
    run.controller.accept(min_jerk(START, END))
    run.go(1.6)
    assert run.controller.outcome == "end reached"


def test_missing_replan_stops_within_200_ms():
    run = Run(heartbeat=1.0, command_timeout=0.1)
    run.controller.chain.command(1.0, 0)
    run.controller.accept(min_jerk(START, END), needs_replan=True)
    run.go(0.05)
    assert run.controller.state == "tracking"
    run.go(0.15)
    assert np.abs(run.controller.qd_ref).max() < 0.01
    assert "plan" in run.controller.reason
    run.controller.accept(min_jerk(run.q[-1], END, stamp_ns=run.now), needs_replan=False)
    run.go(2.5)
    np.testing.assert_allclose(run.controller.q_ref, END, atol=1e-12)


def test_speed_limit_slows_the_path():
    fast = START + np.array([2.0, 0.0, 0.0, -1.5, 0.0, 0.0, 0.0])
    run = Run()
    run.controller.accept(min_jerk(START, fast, duration=0.9))
    run.go(3.0)
    qd = np.abs(run.qd)
    assert (qd <= ROBOT.velocity * (1 + 1e-12)).all()
    assert qd[:, 0].max() == pytest.approx(ROBOT.velocity[0])
    assert min(run.scale[:1000]) < 0.8
    share = (np.array(run.q)[:, [0, 3]] - START[[0, 3]]) / (fast - START)[[0, 3]]
    assert np.abs(share[:, 0] - share[:, 1]).max() < 1e-9
    np.testing.assert_allclose(run.q[-1], fast, atol=1e-12)
    run.assert_continuous()


def changed(**changes):
    base = min_jerk(START, END)
    values = {name: getattr(base, name) for name in base.__dataclass_fields__} | changes
    return JointTrajectory(**values)


def spoilt(label, value):
    array = getattr(min_jerk(START, END), label).copy()
    array[5, 2] = value
    return changed(**{label: array})


BASE = min_jerk(START, END)
REFUSALS = {
    "wrong name": (changed(joint_names=(*NAMES[:6], "elbow")), "without lwr_joint_7"),
    "partial": (
        changed(joint_names=NAMES[:6], positions=BASE.positions[:, :6]),
        "without lwr_joint_7",
    ),
    "twice": (changed(joint_names=(*NAMES[:6], NAMES[0])), "without lwr_joint_7"),
    "size": (changed(positions=BASE.positions[:-1]), r"shape \(42, 7\).*\(43, 7\)"),
    "velocity size": (changed(velocities=BASE.velocities[:, :5]), "velocities have shape"),
    "nan": (spoilt("positions", np.nan), "positions of lwr_joint_3 at point 5 are nan"),
    "inf": (spoilt("accelerations", np.inf), "accelerations of lwr_joint_3 at point 5 are inf"),
    "nan time": (changed(time_s=BASE.time_s * np.nan), "times are not finite"),
    "negative time": (changed(time_s=BASE.time_s - 0.5), "begins -0.5 s"),
    "times": (changed(time_s=np.round(BASE.time_s, 1)), "point 1 at .* increasing times"),
    "past end": (changed(stamp_ns=-8_000_000_000), "ended 7.000 s ago"),
    "past begin": (changed(stamp_ns=-700_000_000), "began 1.200 s ago"),
    "limits": (spoilt("positions", 3.1), "lwr_joint_3 to 3.1.* -2.9671 to 2.9671 rad"),
    "between points": (spoilt("velocities", 900.0), "lwr_joint_3 to"),
    "end speed": (changed(velocities=BASE.velocities + 0.1), "lwr_joint_1 at 0.100 rad/s"),
}


@pytest.mark.parametrize("case", REFUSALS)
def test_refusals_name_the_trouble_and_keep_the_motion(case):
    trajectory, message = REFUSALS[case]
    run = Run()
    run.controller.accept(min_jerk(START, END))
    run.go(0.5)
    with pytest.raises(DataError, match=message):
        run.controller.accept(trajectory)
    assert run.controller.rejection
    assert run.controller.reason == run.controller.rejection
    run.go(1.1)
    np.testing.assert_allclose(run.controller.q_ref, END, atol=1e-12)
    run.assert_continuous()
    run.controller.accept(min_jerk(END, START, stamp_ns=run.now))
    assert run.controller.rejection == ""


def test_path_and_goal_tolerance():
    run = Run(path_tolerance=0.05)
    run.controller.accept(min_jerk(START, END))
    run.go(0.5)
    run.controller.step(run.now + STEP, run.controller.q_ref + 0.04)
    stuck = run.controller.q_ref + 0.06
    run.controller.step(run.now + 2 * STEP, stuck)
    assert "lwr_joint" in run.controller.outcome
    assert run.controller.state == "idle"
    np.testing.assert_array_equal(run.controller.q_ref, stuck)

    run = Run(goal_tolerance=0.01, goal_time=0.1)
    run.controller.accept(min_jerk(START, END))
    run.go(1.5)
    for step in range(200):
        run.controller.step(run.now + (step + 1) * STEP, END + 0.02)
    assert "missed the end by 0.0200 rad" in run.controller.outcome


@pytest.mark.parametrize("scale", [np.nan, -0.1, 1.1, np.inf])
def test_unusable_scale_is_no_heartbeat(scale):
    run = Run(command_timeout=0.1)
    with pytest.raises(DataError, match="speed scale"):
        run.controller.chain.command(scale, 0)
    run.controller.accept(min_jerk(START, END))
    run.go(0.3)
    assert np.array_equal(run.controller.q_ref, START)


def test_clock_must_not_go_back_and_config_is_checked():
    run = Run().go(0.1)
    with pytest.raises(DataError, match=r"went back by 0.050"):
        run.controller.step(50_000_000)
    with pytest.raises(ConfigError, match="ramp_down"):
        ControllerConfig(ramp_down=0.0)


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), kind=st.sampled_from(["quintic", "cubic", "linear"]))
def test_references_keep_limits_and_continuity_under_any_commands(seed, kind):
    rng = np.random.default_rng(seed)
    run = Run(
        q=rng.uniform(0.9 * ROBOT.lower, 0.9 * ROBOT.upper),
        command_timeout=0.1,
        max_lateness=0.1,
        handover_tolerance=float(rng.choice([0.001, 3.2])),
        slowed_tolerance=float(rng.choice([0.002, 3.2])),
    )
    for _ in range(6):
        begin = run.controller.q_ref + rng.normal(0.0, 0.02, 7)
        end = rng.uniform(ROBOT.lower, ROBOT.upper)
        stamp = run.now + int(rng.integers(-80_000_000, 120_000_000))
        trajectory = min_jerk(
            np.clip(begin, ROBOT.lower, ROBOT.upper),
            end,
            duration=rng.uniform(0.5, 3.0),
            stamp_ns=max(stamp, 1),
            kind=kind,
        )
        try:
            run.controller.accept(trajectory, needs_replan=bool(rng.integers(2)))
        except DataError as error:
            assert "blend" in str(error) or "off the present" in str(error)  # noqa: PT017
        run.heartbeat = None if rng.random() < 0.2 else float(rng.random())
        run.go(rng.uniform(0.05, 0.3))
    q, qd = np.array(run.q), np.array(run.qd)
    assert np.isfinite(q).all()
    assert (q >= ROBOT.lower).all()
    assert (q <= ROBOT.upper).all()
    assert (np.abs(qd) <= ROBOT.velocity * (1 + 1e-9)).all()
    assert (np.abs(np.diff(q, axis=0)) <= ROBOT.velocity * 1.05e-3 + 2e-5).all()
