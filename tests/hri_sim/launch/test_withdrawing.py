"""Hands that are left on a robot are taken back, and only those."""

from __future__ import annotations

import pytest

from hri_planner.supervision.touch import TOUCHED
from hri_prediction.ros.messages import Cue
from hri_prediction.ros.time import seconds_to_ns, to_ns
from hri_sim.launch.withdrawing import HELD_NS, LEAD_NS, SLOWEST, Withdrawing, longest_s
from hri_sim.scenario.schema import BACK, PersonSpec, ReachSpec

ANN, BOB = PersonSpec(id="ann", both_arms=True), PersonSpec(id="bob")
REACH = ReachSpec(robot_target="there", person_target="cup", person_delay=0.2, person_duration=1.0)
BOBS = REACH.model_copy(update={"person": "bob"})
STAYS = REACH.model_copy(update={"person_target": None})
BEGIN = seconds_to_ns(100.0)
RESTS = BEGIN + seconds_to_ns(0.2 + SLOWEST)


@pytest.fixture
def sent() -> list[Cue]:
    return []


@pytest.fixture
def told() -> list[str]:
    return []


@pytest.fixture
def withdrawing(sent: list[Cue], told: list[str]) -> Withdrawing:
    made = Withdrawing((ANN, BOB), sent.append, told.append)
    made.begin(4, REACH, BEGIN)
    return made


def looked(
    withdrawing: Withdrawing,
    begin_ns: int,
    seconds: float,
    reason: str = TOUCHED,
    nearest: str = "ann/hand",
) -> list[int]:
    """When it had the hand taken back, looked at each 10 ms."""
    times = range(begin_ns, begin_ns + seconds_to_ns(seconds), 10_000_000)
    return [now_ns for now_ns in times if withdrawing.look(now_ns, reason, nearest)]


def test_a_hand_at_rest_is_taken_back_after_a_second(
    withdrawing: Withdrawing, sent: list[Cue], told: list[str]
) -> None:
    # While it is under way it may leave of itself.
    (when,) = looked(withdrawing, BEGIN, 6.0)
    assert when == RESTS + HELD_NS
    (cue,) = sent
    assert (cue.reach, cue.person_target) == (4, BACK)
    assert (cue.delay, cue.duration) == (0.0, REACH.person_duration)
    assert to_ns(cue.header.stamp) == when + LEAD_NS
    assert withdrawing.rests_ns == when + LEAD_NS + seconds_to_ns(SLOWEST)
    assert "ann" in told[0]


def test_once_for_each_reach(withdrawing: Withdrawing, sent: list[Cue]) -> None:
    assert len(looked(withdrawing, RESTS, 30.0)) == 1
    later = RESTS + seconds_to_ns(30.0)
    withdrawing.begin(5, STAYS, later)  # what it came from would be where it was before
    assert not looked(withdrawing, later, 10.0)
    withdrawing.begin(6, REACH, later)
    assert len(looked(withdrawing, later, 10.0)) == 1
    assert [cue.reach for cue in sent] == [4, 6]


def test_a_short_touch_does_not_count(withdrawing: Withdrawing) -> None:
    assert not looked(withdrawing, RESTS, 0.9)
    assert not looked(withdrawing, RESTS + seconds_to_ns(0.9), 0.1, "slowed for the person")
    assert not looked(withdrawing, RESTS + seconds_to_ns(1.0), 0.9)


def test_what_the_robot_rests_for_otherwise_is_not_the_hand(withdrawing: Withdrawing) -> None:
    assert not looked(withdrawing, RESTS, 10.0, "the newest sample is 0.2 s old")


@pytest.mark.parametrize("nearest", ["", "bob/hand", "ann/left/hand", "somebody/hand"])
def test_who_has_not_reached_is_not_sent_back(withdrawing: Withdrawing, nearest: str) -> None:
    assert not looked(withdrawing, RESTS, 10.0, nearest=nearest)


def test_before_the_first_reach_there_is_nobody_to_tell() -> None:
    assert not looked(Withdrawing((ANN,), pytest.fail, pytest.fail), BEGIN, 5.0)


def test_a_hand_may_be_left_from_an_earlier_reach(
    withdrawing: Withdrawing, sent: list[Cue]
) -> None:
    """The cue has the number of that one: by it the hand is known."""
    withdrawing.begin(5, STAYS, RESTS)
    assert looked(withdrawing, RESTS, 6.0) == [RESTS + HELD_NS]
    assert sent[0].reach == 4


def test_of_two_people_the_one_who_touches_it(withdrawing: Withdrawing, sent: list[Cue]) -> None:
    withdrawing.begin(5, BOBS, RESTS)
    assert len(looked(withdrawing, RESTS, 10.0, nearest="bob/forearm")) == 1
    assert len(looked(withdrawing, RESTS + seconds_to_ns(10.0), 10.0)) == 1
    assert [cue.reach for cue in sent] == [5, 4]


@pytest.mark.parametrize(
    ("changes", "longest"),
    [
        ({}, 1.4),
        ({"speed_factor": 0.5}, 2.8),
        ({"variability": 2.0}, 1.96),
        ({"variability": 0.0}, 1.4),
    ],
)
def test_slow_and_varied_people_are_waited_for(
    changes: dict[str, float], longest: float, sent: list[Cue]
) -> None:
    person = ANN.model_copy(update=changes)
    assert longest_s(person, 1.0) == pytest.approx(longest)
    withdrawing = Withdrawing((person,), sent.append, lambda text: None)
    withdrawing.begin(0, REACH, BEGIN)
    (when,) = looked(withdrawing, BEGIN, 10.0)
    assert when == pytest.approx(BEGIN + seconds_to_ns(0.2 + longest) + HELD_NS, abs=10_000_000)
