"""A person who takes part reaches for the goal that is meant, and goes home again."""

import numpy as np
import pytest

from hri_prediction.errors import PlanningError
from hri_sim.readability.participant import HOME, Participant, participant_spec
from hri_sim.readability.traits import Traits

START = np.array((0.39, 0.0, 0.33))
GOALS = {"left": np.array((0.56, 0.24, 0.12)), "right": np.array((0.56, -0.24, 0.12))}
TARGETS = {"left": np.array((0.74, 0.32, 0.04)), "right": np.array((0.76, -0.26, 0.04))}
TRAITS = Traits(noise=0.0)


def new(hand: bool = True, traits: Traits = TRAITS, seed: int = 0, targets=TARGETS) -> Participant:
    return Participant(traits, targets, hand=hand, rng=np.random.default_rng(seed))


def shown(person: Participant, goal: str, begin: float = 0.0) -> float:
    """A trial; the time when it ends."""
    person.begin(begin, START, GOALS)
    for time in np.arange(0.0, 3.0, 0.008):
        person.watch(begin + float(time), START + min(time / 2.0, 1.0) * (GOALS[goal] - START))
    return begin + 3.0


def hand_of(person: Participant, time: float) -> np.ndarray:
    return person.person.truth(time)[-1]


@pytest.mark.parametrize("name", list(GOALS))
def test_the_hand_reaches_the_target_of_the_goal(name: str) -> None:
    person = new()
    assert person.guess == ""
    assert person.decision is None
    shown(person, name)
    assert person.guess == name
    decision = person.decision
    assert decision is not None
    np.testing.assert_allclose(hand_of(person, 0.0), HOME)
    np.testing.assert_allclose(hand_of(person, decision.shown_s), HOME, atol=1e-9)
    arrived = person.person.rests_from_s
    assert 0.3 < arrived - decision.shown_s < 1.5
    assert np.linalg.norm(hand_of(person, arrived) - TARGETS[name]) < 0.05
    assert np.linalg.norm(hand_of(person, 0.5 * (arrived + decision.shown_s)) - HOME) > 0.03


def test_it_goes_home_and_the_next_trial_begins_there() -> None:
    person, clock = new(), 0.0
    for name in ("left", "right", "right", "left"):
        clock = shown(person, name, clock)
        assert person.guess == name
        assert np.linalg.norm(hand_of(person, clock) - TARGETS[name]) < 0.05
        person.go_home(clock)
        assert person.decision is None
        assert person.guess == ""
        back = person.person.rests_from_s
        assert back > clock
        assert np.linalg.norm(hand_of(person, back) - HOME) < 0.05
        clock = back + 1.0
    # Motions of long ago are forgotten.
    assert len(person.person.motions) <= 4


def test_who_is_still_reaching_goes_home_afterwards() -> None:
    person = new()
    shown(person, "left")
    arrives = person.person.rests_from_s
    person.go_home(arrives - 0.3)
    assert person.person.motions[-1].start_s == pytest.approx(arrives)
    person.go_home(arrives)
    assert len(person.person.motions) == 2, "and only once"


def test_who_presses_a_key_does_not_move() -> None:
    person = new(hand=False)
    end = shown(person, "left")
    assert person.guess == "left"
    for time in (0.0, 1.0, end):
        np.testing.assert_allclose(hand_of(person, time), HOME)
    person.go_home(end)
    assert person.person.motions == ()


def test_nobody_who_watches_nothing_moves() -> None:
    person = new()
    person.watch(0.5, GOALS["left"])
    assert person.decision is None
    assert person.person.motions == ()
    person.go_home(1.0)
    assert person.person.motions == ()


def test_faster_people_take_less_time() -> None:
    took = []
    for speed in (0.8, 1.2):
        person = new(traits=Traits(noise=0.0, hand_speed=speed))
        shown(person, "left")
        decision = person.decision
        assert decision is not None
        took.append(person.person.rests_from_s - decision.shown_s)
    assert took[0] == pytest.approx(1.5 * took[1], rel=0.01)


def test_the_same_seed_does_the_same() -> None:
    people = [new(traits=Traits(noise=0.02), seed=seed) for seed in (3, 3, 4)]
    for person in people:
        shown(person, "right")
    hands = [person.person.truth(np.linspace(0.0, 4.0, 50)) for person in people]
    np.testing.assert_array_equal(hands[0], hands[1])
    assert not np.array_equal(hands[0], hands[2])


def test_goals_are_known_by_name_in_any_order() -> None:
    person = new()
    person.begin(0.0, START, dict(reversed(GOALS.items())))
    for time in np.arange(0.0, 3.0, 0.008):
        person.watch(float(time), START + min(time / 2.0, 1.0) * (GOALS["right"] - START))
    assert person.guess == "right"


def test_targets_out_of_reach_are_refused() -> None:
    far = {**TARGETS, "right": np.array((0.2, -0.9, 0.0))}
    with pytest.raises(PlanningError, match="target of right is out of the reach of person1"):
        new(targets=far)
    # Who presses a key need not reach.
    assert new(hand=False, targets=far).guess == ""
    assert participant_spec("ann").id == "ann"
