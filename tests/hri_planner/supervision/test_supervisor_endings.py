"""How motions end: outcome, reason, and what the robot is told."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from supervised import GOAL, MS, RULES, Facts, Run, moving

from hri_planner.supervision.decision import Goal, Outcome, Stage
from hri_planner.supervision.motion import held_up
from hri_prediction.ros.messages import PlannerStatus, ReachTarget

REST = {"speed": 0.0, "active": False}
SHORT = replace(RULES, max_duration_s=1.0)


def reached(run: Run) -> None:
    run.change(plan_over=True, distance=0.004, **REST)


def held_back(run: Run) -> None:
    run.change(plan_over=True, distance=0.1, **REST)


def cancelled(run: Run) -> None:
    run.supervisor.cancel(1)
    run.run(0.05)
    run.change(**REST)


def cancelled_and_unseen(run: Run) -> None:
    run.supervisor.cancel(1)
    run.change(joints_age=1.0, **REST)


def cancelled_and_still_moving(run: Run) -> None:
    run.supervisor.cancel(1)


def newer(run: Run) -> None:
    run.go()


def newer_while_cancelling(run: Run) -> None:
    run.supervisor.cancel(1)
    run.tick()
    run.go()


def clock_back(run: Run) -> None:
    run.now_ns -= 1500 * MS


def lost(run: Run) -> None:
    run.change(prediction_age=1.0)


def no_plans(run: Run) -> None:
    run.plans = False


ENDINGS = [
    # what happens, within [s], outcome, words, whether the robot is told to stop, stage after
    (reached, 0.01, Outcome.REACHED, "reached, 4.0 mm off", False, Stage.HOLDING),
    (held_back, 2.1, Outcome.BLOCKED, "held up 0.100 m away", True, Stage.IDLE),
    (cancelled, 0.1, Outcome.CANCELLED, "the robot stands", True, Stage.IDLE),
    (cancelled_and_unseen, 2.1, Outcome.LOST_INPUT, "not seen to come to rest: /joint", True, 0),
    (cancelled_and_still_moving, 2.1, Outcome.LOST_INPUT, "rest: it still moves", True, 0),
    (newer, 0.01, Outcome.PREEMPTED, "a newer goal took over", False, None),
    (newer_while_cancelling, 0.01, Outcome.CANCELLED, "and a newer goal", True, None),
    (clock_back, 0.01, Outcome.FAILED, "the clock went back", True, Stage.IDLE),
    (lost, 2.1, Outcome.LOST_INPUT, "stopped: the newest sample", False, None),
    (no_plans, 2.3, Outcome.FAILED, "stopped: the replan is 2.1", True, Stage.IDLE),
]


@pytest.mark.parametrize(
    ("happens", "seconds", "outcome", "words", "stops", "stage"),
    ENDINGS,
    ids=[row[0].__name__ for row in ENDINGS],
)
def test_how_a_motion_ends(
    happens: Callable[[Run], None],
    seconds: float,
    outcome: Outcome,
    words: str,
    stops: bool,
    stage: Stage | None,
) -> None:
    run = moving()
    happens(run)
    ending = run.endings[0] if run.endings else run.end(seconds)
    assert (ending.number, ending.outcome) == (1, outcome)
    assert words in ending.reason
    assert ending.duration_s >= 0.0
    assert ending.min_separation == 0.4
    assert ending.replans > 0
    assert ending.costs == {"collision": 2.0}
    np.testing.assert_array_equal(ending.target, GOAL.target)
    assert len(run.endings) == 1
    assert bool(run.drops) >= stops
    if stage is not None:
        assert run.supervisor.stage == stage == run.reports[-1].stage
        assert run.reports[-1].reason == ending.reason
        assert run.supervisor.holding == (stage == Stage.HOLDING)
    run.run(0.5)
    assert len([e for e in run.endings if e.number == 1]) == 1


@pytest.mark.parametrize(
    "facts",
    [
        pytest.param({"plan_over": True, "distance": 0.004}, id="it still moves"),
        pytest.param({"plan_over": True, "distance": 0.006, **REST}, id="not near enough yet"),
        pytest.param({"distance": 0.004, **REST}, id="the plan goes on"),
    ],
)
def test_not_there_yet(facts: dict[str, Any]) -> None:
    run = moving(**facts)
    run.run(1.9)
    assert not run.endings


def test_held_up_must_last() -> None:
    run = moving(plan_over=True, distance=0.1)
    for over in (False, True):
        run.run(1.9)
        run.change(plan_over=over)
        run.tick()
    assert not run.endings
    assert "given no table" not in held_up(0.1, knows_table=True)
    assert "given no table" in held_up(0.1, knows_table=False)


@pytest.mark.parametrize("where", ["goal inside the person", "person too near the way"])
def test_no_safe_way_ends_as_blocked_with_what_the_plans_said(where: str) -> None:
    run = Run(SHORT, Facts(**REST), waits="no safe way to the goal now")
    run.go()
    run.run(0.1)
    run.change(speed=0.0 if "inside" in where else 0.3, separation=0.03)
    assert run.supervisor.stage == Stage.WAITING
    ending = run.end(1.0)
    assert ending.outcome == Outcome.BLOCKED
    assert ending.reason == "gave up 0.30 m away: no safe way to the goal now"
    assert ending.min_separation == 0.03
    assert run.drops == 1


def test_no_beginning_at_all_ends_as_blocked() -> None:
    """Somebody else's trajectory, and the controller does not obey."""
    run = Run(SHORT, Facts(on_plan=False))
    run.go()
    ending = run.end(1.1)
    assert ending.outcome == Outcome.BLOCKED
    assert ending.reason.endswith("no way to the goal was found in time")
    assert not run.intervals
    assert run.drops > 3  # it was told to stop, again and again


def test_a_node_that_was_not_run_does_not_blame_the_way() -> None:
    run = Run(SHORT, Facts(on_plan=False))
    run.go()
    run.run(0.1)
    run.now_ns += 20_000_000_000
    ending = run.end(0.1)
    assert ending.outcome == Outcome.BLOCKED
    assert ending.reason.endswith("this node was not run for 20.0 s")


@pytest.mark.parametrize(("in_flight", "drops"), [(True, 1), (False, 0)])
def test_unreachable(in_flight: bool, drops: int) -> None:
    run = moving() if in_flight else Run(facts=Facts(on_plan=False, **REST))
    run.begins = False
    number = run.go(Goal(np.array([3.0, 0.0, 0.3]), 1.0))
    run.run(0.05)
    ending = run.endings[-1]
    assert (ending.number, ending.outcome, ending.reason) == (
        number,
        Outcome.UNREACHABLE,
        "too far",
    )
    assert run.drops == drops
    assert run.supervisor.stage == Stage.IDLE


def test_malformed_goals_leave_the_present_motion_alone() -> None:
    run = moving()
    number, decision = run.supervisor.refuse("no target 'moon'", run.now_ns)
    assert number == 2
    (ending,) = decision.endings
    assert (ending.outcome, ending.reason) == (Outcome.REJECTED, "no target 'moon'")
    assert ending.target is None
    assert not (decision.drop)
    assert not (decision.reports)
    run.run(0.2)
    assert not run.endings
    assert run.supervisor.stage == Stage.MOVING


def test_only_the_present_motion_can_be_cancelled() -> None:
    run = moving()
    assert not run.supervisor.cancel(2)
    run.go()
    assert not run.supervisor.cancel(1)
    assert run.supervisor.cancel(2)


def test_a_goal_right_after_a_cancellation_waits_for_rest() -> None:
    run = moving()
    newer_while_cancelling(run)
    before = len(run.intervals)
    run.run(0.05)
    assert run.supervisor.scale == 0.0
    assert run.supervisor.reason == "cancelled: the robot comes to rest"
    assert len(run.intervals) == before
    run.change(**REST)
    run.run(0.05)
    assert run.supervisor.stage == Stage.MOVING
    assert run.intervals[before].start is GOAL


def test_a_held_goal_is_kept_and_given_up() -> None:
    run = moving()
    reached(run)
    run.end(0.01)
    before = len(run.intervals)
    run.run(0.2)
    assert len(run.intervals) - before >= 5
    assert run.supervisor.stage == Stage.HOLDING
    lost(run)
    run.run(3.0)
    assert run.supervisor.stage == Stage.STOPPING
    run.change(prediction_age=0.02)
    run.run(0.1)
    assert run.supervisor.stage == Stage.HOLDING

    clock_back(run)
    run.tick()
    assert run.supervisor.stage == Stage.IDLE == run.reports[-1].stage
    assert not run.supervisor.active
    assert run.drops == 1


def test_a_clock_that_is_set_by_a_little_changes_nothing() -> None:
    run = moving()
    run.now_ns -= 90 * MS
    run.run(0.2)
    assert not (run.endings)
    assert not (run.drops)
    assert run.supervisor.stage == Stage.MOVING


def test_after_the_clock_went_back_a_new_motion_begins() -> None:
    run = moving()
    clock_back(run)
    run.tick()
    run.change(**REST)
    assert run.go() == 2
    run.run(0.1)
    assert run.supervisor.stage == Stage.MOVING


def test_feedback_comes_ten_times_a_second_while_there_is_a_motion() -> None:
    run = moving()
    told = 0
    for _ in range(250):
        run.tick()
        told += run.supervisor.feedback_due(run.now_ns)
    assert told == 10
    reached(run)
    run.end(0.01)
    assert not run.supervisor.feedback_due(run.now_ns + 1000 * MS)


def test_names_and_numbers_are_those_of_the_messages() -> None:
    for stage in Stage:
        assert getattr(PlannerStatus, stage.name) == stage
    for outcome in Outcome:
        assert getattr(ReachTarget.Result, outcome.name) == outcome
