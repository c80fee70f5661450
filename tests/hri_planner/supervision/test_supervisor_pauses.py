"""What is seen in mid-motion, and what the robot is told then."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import Any

import pytest
from supervised import MS, RULES, Facts, Run, moving

from hri_planner.supervision.decision import Interval, Outcome, ReadyPlan, Stage, Verdict
from hri_planner.supervision.touch import TOUCHED

WELL = [
    pytest.param({}, id="all is well"),
    pytest.param({"controller_age": None}, id="no controller speaks"),
    pytest.param({"tracked": ()}, id="nobody is tracked"),
    pytest.param({"tracked": (), "prediction_age": None}, id="nobody is tracked or predicted"),
    pytest.param({"stopping": True, "rate": 0.9}, id="a stop that has not begun to bite"),
    pytest.param({"joints_age": 0.09, "controller_age": 0.09}, id="not too old yet"),
    pytest.param({"prediction_age": 0.084}, id="sample not too old yet"),
    pytest.param({"separation": -0.01}, id="the person touches the robot: the planner's business"),
]
ILL = [
    pytest.param({"joints_age": None}, "no /joint_states yet", id="no joint states"),
    pytest.param({"joints_age": 0.15}, "/joint_states are 0.15 s old", id="joint states stale"),
    pytest.param({"joints_age": -0.2}, "0.20 s in the future", id="joint states of the future"),
    pytest.param({"controller_age": 0.2}, "reference is 0.20 s old", id="controller silent"),
    pytest.param(
        {"controller_age": 0.2, "controller_fault": "no names"},
        "0.20 s old: no names",
        id="controller not understood",
    ),
    pytest.param(
        {"controller_age": None, "controller_fault": "no names"},
        "no names",
        id="controller never understood",
    ),
    pytest.param({"tracked": None}, "nothing says who is tracked", id="no tracking"),
    pytest.param(
        {"tracked": (), "unlisted": "nothing says any longer who is tracked"},
        "nothing says any longer who is tracked",
        id="nobody is tracked, as a source said that is silent now",
    ),
    pytest.param({"prediction_age": None}, "no prediction of p1 yet", id="no prediction"),
    pytest.param(
        {"invalid": "no samples"}, "p1 is invalid: no samples", id="prediction says it is invalid"
    ),
    pytest.param({"prediction_age": 0.1}, "p1 is 0.100 s old", id="prediction stale"),
    pytest.param({"prediction_age": -0.1}, "0.100 s in the future", id="prediction of the future"),
    pytest.param(
        {"stopping": True, "rate": 0.4, "controller_reason": "no heartbeat"},
        "no heartbeat",
        id="a stop of the controller that bites",
    ),
]


@pytest.mark.parametrize("facts", WELL)
def test_the_robot_goes_on(facts: dict[str, Any]) -> None:
    run = moving(**facts)
    before = len(run.intervals)
    run.run(0.2)
    assert run.supervisor.scale == 1.0
    assert run.supervisor.stage == Stage.MOVING
    assert len(run.intervals) - before == 5  # a replan each 36 ms, without a gap
    handovers = [interval.handover_ns for interval in run.intervals]
    assert {b - a for a, b in pairwise(handovers[1:])} == {36 * MS}
    assert not (run.drops)
    assert not (run.faults)
    assert not (run.endings)


@pytest.mark.parametrize(("facts", "words"), ILL)
def test_the_robot_stops_at_once_goes_on_and_ends(facts: dict[str, Any], words: str) -> None:
    run = moving(**facts)
    run.tick()
    assert run.supervisor.scale == 0.0
    assert run.supervisor.heartbeat_due(run.now_ns)
    assert run.supervisor.stage == Stage.STOPPING == run.reports[-1].stage
    assert words in run.reports[-1].reason
    assert run.faults == [("paused", run.reports[-1].reason)]
    before = len(run.intervals)
    run.run(0.5)
    assert len(run.intervals) == before
    assert len(run.reports) < 40  # told again and again, not each tick

    well = moving(**facts)  # the same, and then all is well again
    well.run(0.5)
    well.facts = Facts(active=False, speed=0.0)  # it stands by now
    well.tick()
    assert well.supervisor.scale == 1.0
    assert well.supervisor.stage == Stage.MOVING
    assert not well.endings

    ending = run.end(2.0)
    assert ending.outcome == Outcome.LOST_INPUT
    assert words[-8:] in ending.reason
    assert not run.supervisor.holding


LEANING = Facts(active=False, speed=0.0, separation=-0.001)
LET_GO = replace(LEANING, separation=0.03)


def leant_on() -> Run:
    """A motion that was stopped, and a hand that has come onto the robot since."""
    run = moving(prediction_age=0.1)
    run.run(0.2)
    run.facts = LEANING
    run.run(0.5)
    return run


def test_a_robot_that_is_touched_while_it_rests_stays_at_rest() -> None:
    """Whoever has a hand on it is not pushed; once it is let go it goes on."""
    run = leant_on()
    before = len(run.intervals)
    run.run(10.0)  # it takes as long as the person does
    assert run.supervisor.scale == 0.0
    assert run.supervisor.stage == Stage.STOPPING
    assert run.reports[-1].reason == TOUCHED
    assert len(run.intervals) == before
    assert not run.endings
    run.facts = LET_GO
    run.run(0.3)
    assert run.supervisor.scale == 1.0
    assert run.supervisor.stage == Stage.MOVING
    run.facts = replace(LEANING, active=True, speed=0.5)
    run.run(0.1)  # nearer than ever, but it moves: the planner's business
    assert run.supervisor.scale == 1.0


def test_a_controller_that_stands_by_itself_is_left_alone_while_it_is_touched() -> None:
    run = moving(stopping=True, rate=0.0, speed=0.0, separation=-0.001)
    run.tick()
    assert run.supervisor.scale == 0.0
    assert run.reports[-1].reason == TOUCHED
    # It is told to drop what it follows, and does not come to rest: that is something else.
    run.change(rate=0.4, separation=0.4)
    assert run.end(2.1).outcome == Outcome.LOST_INPUT


def test_who_has_no_plan_in_time_gives_up_though_it_is_touched() -> None:
    run = moving()
    run.plans = False
    run.run(0.3)
    assert run.supervisor.scale == 0.0
    run.facts = LEANING
    assert run.end(2.2).outcome == Outcome.FAILED


def test_noise_does_not_let_go() -> None:
    run = leant_on()
    for tick in range(500):
        run.change(separation=(0.009, 0.019, 0.03)[tick % 3])
        run.tick()
        assert run.supervisor.scale == 0.0


def test_a_motion_whose_robot_is_never_let_go_ends_as_blocked() -> None:
    run = leant_on()
    ending = run.end(20.0)
    assert ending.outcome == Outcome.BLOCKED
    assert TOUCHED in ending.reason
    assert ending.min_separation == -0.001


@pytest.mark.parametrize("how", ["after it", "instead"])
def test_a_robot_sets_out_for_a_new_goal_though_somebody_touches_it(how: str) -> None:
    """Who is held by it can be freed."""
    run = leant_on()
    if how == "after it":
        run.end(20.0)
    run.go()
    run.run(0.1)
    assert run.supervisor.stage == Stage.MOVING
    assert run.supervisor.scale == 1.0


def test_a_stop_is_told_again_until_the_robot_stands() -> None:
    run = moving(prediction_age=0.1)
    run.tick()
    assert not run.drops  # the speed scale stops it
    run.change(rate=0.5, stopping=True)
    run.tick()
    assert run.drops == 1
    run.change(prediction_age=0.02)  # all is well again, but it has not come to rest yet
    run.run(0.096)
    assert (run.drops, run.supervisor.scale) == (1, 0.0)
    run.run(0.008)
    assert run.drops == 2
    run.facts = Facts(active=False, speed=0.0)
    run.tick()
    assert run.supervisor.scale == 1.0


def test_without_a_heartbeat_a_stop_is_a_dropped_trajectory() -> None:
    run = Run(replace(RULES, heartbeat=False), Facts(active=False, speed=0.0))
    run.go()
    run.run(0.1)
    run.facts = Facts(prediction_age=0.1)
    run.tick()
    assert run.drops == 1
    assert not run.supervisor.heartbeat_due(run.now_ns)


@pytest.mark.parametrize("how", ["silent", "failing", "late"])
def test_no_plan_in_time(how: str) -> None:
    """The optimiser still computes, or fails, or its plans are always late: it is all the same."""
    run = moving(busy=how == "silent")
    run.plans = False

    def step() -> None:
        decision = run.tick()
        if decision.interval is not None and how == "failing":
            run.take(run.supervisor.failed(decision.interval.number, "no such plan"))
        if decision.interval is not None and how == "late":
            assert run.ready(decision.interval, early_ns=4 * MS) == Verdict.DROP

    start_ns = run.now_ns
    while run.supervisor.scale == 1.0:
        step()
    # The last plan (16 ms ahead of the clock here), one interval to the next, and late_timeout.
    assert 120 <= (run.now_ns - start_ns) / MS <= 16 + 36 + 120 + 8
    tried = len(run.intervals)
    for _ in range(600):
        if run.endings:
            break
        step()
    assert run.endings[-1].outcome == Outcome.FAILED
    assert "late" in run.endings[-1].reason
    assert ("no such plan" in run.endings[-1].reason) == (how == "failing")
    assert (len(run.intervals) > tried + 30) == (how != "silent")  # it goes on trying
    if how != "silent":
        assert run.endings[-1].number == 1
        assert run.supervisor.intervals.misses >= 30


def test_one_plan_in_time_ends_that() -> None:
    run = moving()
    run.plans = False
    run.run(0.3)
    assert run.supervisor.scale == 0.0
    run.facts = Facts(active=False, speed=0.0)
    run.plans = True
    run.run(0.08)
    assert run.supervisor.scale == 1.0
    assert run.supervisor.stage == Stage.MOVING


def test_every_interval_without_a_plan_counts_once() -> None:
    run = moving()
    run.change(busy=True)
    run.run(0.1)
    run.change(busy=False)
    run.tick()
    assert run.supervisor.motion is not None
    assert run.supervisor.motion.misses == run.supervisor.intervals.misses == 2


@pytest.mark.parametrize(
    ("early_ms", "due_ms", "verdict"),
    [
        (20, 20, Verdict.PUBLISH),
        (5, 5, Verdict.PUBLISH),
        (4, 4, Verdict.DROP),  # it could not get through in time
        (-10, -10, Verdict.DROP),
        (20, 0, Verdict.PUBLISH),
        (20, -1, Verdict.DROP),  # the robot, slowed before, has passed where it begins
        (20, None, Verdict.DROP),  # the robot is on another path
    ],
)
def test_a_plan_that_begins_in_the_past_is_dropped(
    early_ms: int, due_ms: int | None, verdict: Verdict
) -> None:
    run = moving()
    handover_ns = run.now_ns + early_ms * MS
    plan = ReadyPlan(1, handover_ns, None if due_ms is None else run.now_ns + due_ms * MS)
    misses = run.supervisor.intervals.misses
    assert run.supervisor.judge(plan, run.now_ns) == verdict
    assert run.supervisor.intervals.misses - misses == (verdict == Verdict.DROP)


def test_plans_and_failures_of_what_has_ended_do_not_count() -> None:
    run = moving()
    run.go()
    supervisor = run.supervisor
    old = Interval(run.now_ns, run.now_ns + 36 * MS, 1)
    assert run.ready(old) == Verdict.FORGET
    run.take(supervisor.failed(1, "no such plan"))
    assert not run.faults
    assert supervisor.intervals.failures == supervisor.intervals.misses == 0


def test_a_plan_for_a_robot_that_is_being_stopped_is_dropped() -> None:
    run = moving()
    interval = run.intervals[-1]
    run.change(prediction_age=0.2)
    run.tick()
    assert run.ready(interval) == Verdict.DROP


def test_the_heartbeat_never_pauses() -> None:
    run = Run(facts=Facts(active=False, speed=0.0))
    beats = 0
    for _ in range(250):
        run.tick()
        beats += run.supervisor.heartbeat_due(run.now_ns)
    assert beats == 50
