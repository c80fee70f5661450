"""A planner that plans once: before the robot sets off, nothing is late, and all else is as ever."""

from __future__ import annotations

from dataclasses import replace

from supervised import MS, RULES, Facts, Run

from hri_planner.supervision.decision import Outcome, Stage

ONCE = replace(RULES, plans_once=True)
STANDS = Facts(active=False, speed=0.0)


def planning() -> Run:
    """A run whose first plan is under way."""
    run = Run(rules=ONCE, facts=STANDS, plans=False)
    run.go()
    run.run(0.1)
    return run


def test_the_first_plan_has_the_duration_of_the_motion_and_is_not_late():
    run = planning()
    run.change(busy=True)
    run.run(1.35)
    (interval,) = run.intervals
    assert interval.ahead
    assert interval.handover_ns - interval.begin_ns == 1500 * MS
    assert {report.stage for report in run.reports} == {Stage.WAITING}
    assert 14 <= len(run.reports) <= 16
    assert run.supervisor.scale == 1.0
    run.change(busy=False)
    run.ready(interval)
    run.facts, run.plans = Facts(), True
    run.run(0.2)
    lengths = {found.handover_ns - found.begin_ns for found in run.intervals[1:]}
    assert lengths == {36 * MS}
    assert not any(found.ahead for found in run.intervals[1:])
    assert run.supervisor.stage == Stage.MOVING
    assert run.supervisor.motion.misses == 0


def test_a_plan_that_never_comes_stops_the_robot():
    run = planning()
    run.change(busy=True)
    run.run(1.5)
    assert run.supervisor.scale == 1.0
    run.run(0.3)
    assert run.supervisor.scale == 0.0
    assert "late" in run.supervisor.reason


def test_after_a_pause_the_time_is_given_again():
    run = planning()
    run.change(prediction_age=0.5)
    run.run(0.3)
    assert run.supervisor.stage == Stage.STOPPING
    assert run.ready(run.intervals[0]).name == "DROP"
    run.change(prediction_age=0.02)
    run.run(1.2)
    assert run.supervisor.stage == Stage.WAITING
    assert run.supervisor.scale == 1.0
    assert [found.ahead for found in run.intervals] == [True, True]
    assert run.intervals[1].handover_ns - run.intervals[1].begin_ns == 1500 * MS


def test_a_failure_is_said_while_it_tries_again():
    run = planning()
    run.take(run.supervisor.failed(1, "no way"))
    run.run(2.0)
    assert len(run.intervals) == 2
    assert "no way" in run.reports[-1].reason
    run.facts = replace(STANDS, busy=True)
    ending = run.end(20.0)
    assert ending.outcome in (Outcome.FAILED, Outcome.BLOCKED)
    assert "no way" in ending.reason


def test_a_robot_in_motion_comes_to_rest_first():
    run = Run(rules=ONCE, facts=Facts(on_plan=True, speed=0.5), plans=False)
    run.go()
    run.run(0.2)
    assert run.drops >= 1
    assert run.intervals == []
    run.facts = STANDS
    run.run(0.2)
    assert len(run.intervals) == 1


def test_an_interval_without_time_for_a_replan_is_a_miss():
    run = Run(facts=STANDS)
    run.go()
    run.run(0.1)
    misses = run.supervisor.motion.misses
    run.supervisor.out_of_time(1)
    run.supervisor.out_of_time(7)  # another motion
    assert run.supervisor.motion.misses == misses + 1
