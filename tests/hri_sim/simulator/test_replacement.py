"""The trajectory controller: how a new trajectory takes the place of the old."""

import numpy as np
import pytest
from controlled import END, NAMES, ROBOT, START, STEP, Run, min_jerk

from hri_prediction.errors import DataError
from hri_sim.simulator import ControllerConfig, JointTrajectory


@pytest.mark.parametrize("kind", ["quintic", "cubic"])
def test_a_matching_plan_replaces_without_a_trace(kind):
    run, alone = Run(), Run()
    for each in (run, alone):
        each.controller.accept(min_jerk(START, END, kind=kind))
        each.go(0.5)
    old = min_jerk(START, END)
    late = slice(18, None)
    stamp = STEP + round(old.time_s[18] * 1e9)
    run.controller.accept(
        JointTrajectory(
            stamp,
            NAMES,
            old.time_s[late] - old.time_s[18],
            old.positions[late],
            old.velocities[late],
            old.accelerations[late] if kind == "quintic" else None,
        )
    )
    assert run.controller.handover_jump_position < 1e-9
    assert run.controller.handover_jump_velocity < 1e-9
    run.go(1.2), alone.go(1.2)
    np.testing.assert_allclose(run.q, alone.q, atol=2e-5)
    assert run.controller.stamp_ns == stamp


def test_a_differing_plan_is_blended_and_its_jump_measured():
    run = Run()
    run.controller.accept(min_jerk(START, END))
    run.go(0.7)
    other = min_jerk(run.q[-1] + 0.01, END + 0.02, stamp_ns=run.now + 20_000_000)
    run.controller.accept(other)
    assert 0.005 < run.controller.handover_jump_position < 0.05
    assert run.controller.handover_jump_velocity > 0.5
    after = run.go(0.02 + other.time_s[9]).q[-1]
    np.testing.assert_allclose(after, other.positions[9], atol=1e-3)
    run.go(2.0)
    np.testing.assert_allclose(run.controller.q_ref, END + 0.02, atol=1e-12)
    assert np.abs(np.diff(run.qd, axis=0)).max() < 0.5


@pytest.mark.parametrize("due_s", [0.0, 0.025, 0.2])
def test_a_far_first_point_is_joined_no_faster_than_the_arm_can(due_s):
    run = Run()
    run.controller.accept(min_jerk(START, END))
    run.go(0.5)
    far = START + np.array([0.0, 0.5, 0.0, 0.5, 0.0, 0.0, 0.0])
    run.controller.accept(min_jerk(far, END, stamp_ns=run.now + round(due_s * 1e9)))
    run.go(2.5)
    assert (np.abs(run.qd).max(axis=0) <= ROBOT.velocity + 1e-9).all()
    run.assert_continuous()
    np.testing.assert_allclose(run.controller.q_ref, END, atol=1e-9)


def replan(old, late_s, turn):
    """The rest of a trajectory from a time on, with what turns it another way."""
    later = old.time_s >= late_s - 1e-9
    t = old.time_s[later] - late_s
    x = np.clip(t / 0.8, 0.0, 1.0)[:, None]
    turned = [turn * p for p in (x**3 * (10 - 15 * x + 6 * x * x), 30 / 0.8 * (x * (1 - x)) ** 2)]
    turned.append(turn * 60 / 0.64 * x * (1 - x) * (1 - 2 * x))
    return JointTrajectory(
        old.stamp_ns + round(late_s * 1e9),
        NAMES,
        t,
        old.positions[later] + turned[0],
        old.velocities[later] + turned[1],
        old.accelerations[later] + turned[2],
    )


@pytest.mark.parametrize(("turn", "refused"), [(0.3, True), (0.13, True), (0.02, False)])
def test_a_plan_that_comes_too_late_is_refused_when_the_robot_has_gone_elsewhere(turn, refused):
    run = Run(max_lateness=0.1)
    old = min_jerk(START, END, count=151)
    run.controller.accept(old)
    run.go(0.5 + 0.09)
    late = replan(old, 0.5, turn)
    if refused:
        with pytest.raises(DataError, match=r"began 0\.089 s ago, 0\.00\d+ rad off"):
            run.controller.accept(late)
        assert run.controller.stamp_ns == old.stamp_ns
    else:
        run.controller.accept(late)
        assert run.controller.stamp_ns == late.stamp_ns
    assert run.controller.late_refusals == refused
    assert run.controller.handover_jump_position <= 1e-3
    # In time, the same plan is taken without a trace: also as the next one, after a refusal.
    again = replan(old, 0.6, turn)
    if refused:
        run.controller.accept(again)
        assert run.controller.handover_jump_position < 1e-9
    run.go(1.5)
    np.testing.assert_allclose(run.controller.q_ref, END + turn, atol=1e-9)
    run.assert_continuous()


@pytest.mark.parametrize(("off_s", "refused"), [(0.0005, False), (0.02, True)])
def test_a_plan_that_was_timed_for_another_speed_is_refused_while_slowed(off_s, refused):
    """Its first point is on the present path, but the robot will not be there in time."""
    run = Run(heartbeat=0.5)
    old = min_jerk(START, END, count=151)
    run.controller.accept(old)
    run.go(0.7)
    position = run.controller.time_in_trajectory
    late_s = np.ceil((position + 0.02) * 100) / 100
    plan = replan(old, late_s, 0.0)
    due_ns = run.now + round((late_s - position + off_s) * 1e9)
    timed = JointTrajectory(
        due_ns, NAMES, plan.time_s, plan.positions, plan.velocities, plan.accelerations
    )
    if refused:
        with pytest.raises(DataError, match="comes while slowed"):
            run.controller.accept(timed)
    else:
        run.controller.accept(timed)
    assert run.controller.late_refusals == refused
    assert run.controller.handover_jump_position <= 2e-3
    run.go(3.0)
    np.testing.assert_allclose(run.controller.q_ref, END, atol=1e-9)
    run.assert_continuous()


@pytest.mark.parametrize("rate", [0.1, 0.5])
@pytest.mark.parametrize("transport_s", [-0.003, 0.006, 0.0075, 0.015])
def test_a_slowed_robot_meets_a_plan_that_was_long_on_its_way(rate, transport_s):
    """Meanwhile the robot hardly moved, but the plan grew old by the clock."""
    run = Run(heartbeat=rate)
    old = min_jerk(START, END, count=151)
    run.controller.accept(old)
    run.go(0.75 / rate)  # where the motion is fastest
    position = run.controller.time_in_trajectory
    joined_s = np.ceil((position + 0.02) * 100) / 100
    plan = replan(old, joined_s, 0.0)
    due_ns = run.now + round((joined_s - position - transport_s) * 1e9)
    run.controller.accept(
        JointTrajectory(
            due_ns, NAMES, plan.time_s, plan.positions, plan.velocities, plan.accelerations
        )
    )
    speed = np.abs(min_jerk(START, END, count=151).velocities).max()
    assert speed * abs(transport_s) > 1.5e-3  # so much it would be off without
    assert (
        run.controller.last_jump_position <= 0.05e-3 * speed + 1e-4
    )  # steps of a tenth of a millisecond
    run.go(3.0 / rate)
    np.testing.assert_allclose(run.controller.q_ref, END, atol=1e-9)
    run.assert_continuous()


def test_a_robot_just_back_at_full_speed_meets_a_plan_that_was_timed_while_it_was_slowed():
    run = Run(heartbeat=0.5)
    old = min_jerk(START, END, count=151)
    run.controller.accept(old)
    run.go(1.0)
    run.heartbeat = 1.0
    while run.controller.scale < 1.0:
        run.go(STEP * 1e-9)
    position = run.controller.time_in_trajectory
    joined_s = np.ceil((position + 0.02) * 100) / 100
    plan = replan(old, joined_s, 0.0)
    due_ns = run.now + round((joined_s - position - 0.0065) * 1e9)
    run.controller.accept(
        JointTrajectory(
            due_ns, NAMES, plan.time_s, plan.positions, plan.velocities, plan.accelerations
        )
    )
    speed = np.abs(old.velocities).max()
    assert run.controller.last_jump_position <= 0.05e-3 * speed + 1e-4
    run.go(3.0)
    np.testing.assert_allclose(run.controller.q_ref, END, atol=1e-9)
    run.assert_continuous()


@pytest.mark.parametrize("late_s", [0.015, 0.025])
def test_a_trajectory_that_is_much_too_late_is_refused_at_rest_too(late_s):
    run = Run()
    run.go(0.1)
    late = min_jerk(START, END, stamp_ns=run.now - round(late_s * 1e9))
    if late_s > ControllerConfig().max_lateness:
        with pytest.raises(DataError, match=r"began 0\.025 s ago"):
            run.controller.accept(late)
        assert run.controller.late_refusals == 1
        assert run.controller.state == "idle"
    else:
        run.controller.accept(late)
        assert run.controller.handover_jump_position < 1e-4
    run.go(0.1)
    run.assert_continuous()


def test_jump_is_reset_when_a_motion_begins():
    run = Run()
    run.controller.accept(min_jerk(START, END))
    run.go(0.5)
    run.controller.accept(min_jerk(START, END, stamp_ns=run.now))
    run.go(2.0)
    assert run.controller.handover_jump_position > 0.01
    run.controller.accept(min_jerk(END, START, stamp_ns=run.now))
    assert run.controller.handover_jump_position == 0.0
