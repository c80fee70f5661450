"""Trials without ROS: the robot arrives and touches nobody, and policies improve by them."""

from dataclasses import replace

import numpy as np
import pytest

from hri_planner.pibb.costs import DEVIATION_M2, Terms, deviation
from hri_planner.pibb.experiment import Improvement
from hri_planner.pibb.experiment_file import find_experiment, load_experiment
from hri_planner.policy.config import PolicyConfig
from hri_planner.robot.model import load_robot
from hri_prediction.errors import DataError
from hri_sim.readability.learning import generator, learn, read_policy
from hri_sim.readability.participant import Participant
from hri_sim.readability.traits import Traits, draw_traits
from hri_sim.readability.trial import Bench, TrialRecord

ROBOT = load_robot()
HANDS = load_experiment(find_experiment("transfer"))
KEYS = load_experiment(find_experiment("preliminary_end_effector"))


def taken(experiment, name: str, seed: int = 0, traits: Traits | None = None) -> TrialRecord:
    rng = np.random.default_rng(seed)
    own = traits or draw_traits(rng, len(experiment.goals))
    person = Participant(own, experiment.targets, hand=experiment.response == "hand", rng=rng)
    bench = Bench(ROBOT, experiment)
    return bench.run(experiment.initial_policy(ROBOT), name, person)


@pytest.mark.parametrize("name", list(HANDS.goals))
def test_a_robot_that_is_reached_past_arrives_and_touches_nobody(name: str) -> None:
    record = taken(HANDS, name)
    assert record.missed_m < 0.004
    assert 1.5 < record.arrived_s < 6.0
    assert record.clearance > 0.0
    assert record.fastest <= 0.9 + 1e-9
    assert record.guess in HANDS.goals
    assert 0.0 < record.shown_s < record.response_s
    assert record.hand_s == pytest.approx(record.response_s - record.shown_s)
    assert len(record.times) == len(record.tool) == len(record.joints) == len(record.person)
    np.testing.assert_allclose(np.diff(record.times), 0.004)
    np.testing.assert_allclose(ROBOT.frames(record.joints)[:, 3], record.tool, atol=2e-3)
    assert record.times[-1] >= max(record.arrived_s, record.response_s)
    arrived = int(np.searchsorted(record.times, record.response_s))
    assert np.linalg.norm(record.person[arrived, -1] - HANDS.targets[record.guess]) < 0.06


@pytest.mark.parametrize("name", list(KEYS.goals))
def test_obstacles_are_passed_while_a_key_is_pressed(name: str) -> None:
    record = taken(KEYS, name)
    assert record.missed_m < 0.004
    assert record.clearance > 0.0
    assert record.hand_s == 0.0
    assert record.response_s == record.shown_s
    assert np.ptp(record.person, axis=0).max() == 0.0


def test_terms_are_those_of_the_record() -> None:
    record, policy = taken(HANDS, "left"), HANDS.initial_policy(ROBOT)
    found = record.terms(policy, "left", 0.3)
    found.check()
    assert found.prediction_time == record.response_s
    assert found.human_duration == record.hand_s
    assert found.indistinct == 0.3
    assert found.task == float(record.guess != "left")
    assert found.deviation == deviation(record.tool, policy.path("left"))
    wrong = replace(record, guess="right")
    assert wrong.terms(policy, "left", 0.3).task == 1.0
    assert isinstance(found, Terms)


def test_alone_the_robot_goes_its_way() -> None:
    """Without field, a person who presses a key far away changes nothing of it."""
    joint = load_experiment(find_experiment("preliminary_joint"))
    record, policy = taken(joint, "g1"), joint.initial_policy(ROBOT)
    assert record.terms(policy, "g1", 0.3).deviation < 0.01 * DEVIATION_M2
    assert record.filtered == 0.0


def test_trials_follow_each_other_on_one_clock() -> None:
    rng = np.random.default_rng(1)
    person = Participant(draw_traits(rng, 3), HANDS.targets, hand=True, rng=rng)
    bench, policy = Bench(ROBOT, HANDS), HANDS.initial_policy(ROBOT)
    for name in ("left", "right", "left"):
        record = bench.run(policy, name, person)
        assert np.isfinite(record.response_s)
        np.testing.assert_allclose(record.person[0, -1], person.spec.home, atol=0.05)
        assert record.clearance > 0.0


def test_the_same_seed_makes_the_same_trial() -> None:
    one, other, third = (taken(HANDS, "middle", seed) for seed in (2, 2, 3))
    np.testing.assert_array_equal(one.joints, other.joints)
    np.testing.assert_array_equal(one.person, other.person)
    assert one.response_s == other.response_s
    assert one.response_s != third.response_s


def test_experiments_without_avoidance_have_neither_field_nor_null_space() -> None:
    joint = load_experiment(find_experiment("preliminary_joint"))
    for experiment, strength in ((joint, 0.0), (KEYS, PolicyConfig().field_strength)):
        assert Bench(ROBOT, experiment).config.field_strength == strength
    assert Bench(ROBOT, joint).config.link_reach == 0.0


SMALL = replace(
    HANDS, improvement=Improvement(updates=2, rollouts=2, habituation=1, exploration=0.05)
)


def test_an_experiment_is_learnt_from_one_person() -> None:
    seen = []
    found = learn(ROBOT, SMALL, 3, readings=1, on_trial=seen.append)
    assert tuple(seen) == found.results
    assert len(found.results) == 3 * (1 + 2 * 2)
    assert found.contacts == 0
    assert found.first.names == found.last.names == tuple(HANDS.goals)
    assert any(
        not np.array_equal(found.first.weights[n], found.last.weights[n]) for n in HANDS.goals
    )
    for reading in (found.before, found.after, found.others_before, found.others_after):
        assert reading.trials == 3
        assert np.isfinite(reading.prediction_time)
        assert 0.0 <= reading.error <= 1.0
        assert reading.contacts == 0
        assert reading.decision_time + reading.human_duration == pytest.approx(
            reading.prediction_time
        )
    better = replace(
        found,
        before=replace(found.before, prediction_time=2.0, error=0.1),
        after=replace(found.after, prediction_time=1.7, error=0.1),
    )
    assert better.improved
    assert not replace(better, after=replace(better.after, error=0.2)).improved
    assert not replace(better, after=replace(better.after, prediction_time=1.9)).improved


def test_learning_is_known_by_its_seed_and_may_begin_with_a_policy() -> None:
    tiny = replace(SMALL, improvement=replace(SMALL.improvement, updates=1))
    one, other = (learn(ROBOT, tiny, 4, readings=1) for _ in range(2))
    assert one.results == other.results
    assert one.after == other.after
    for name in HANDS.goals:
        np.testing.assert_array_equal(one.last.weights[name], other.last.weights[name])
    begun = learn(ROBOT, tiny, 4, first=one.last, readings=1)
    assert begun.first is one.last
    assert begun.before == one.after, "the same person in the same moods reads the same policy"
    assert begun.traits == one.traits


def test_moods_are_those_of_the_seed_for_any_policy() -> None:
    bench, policy = Bench(ROBOT, HANDS), HANDS.initial_policy(ROBOT)
    traits = draw_traits(generator(5, 0), 3)
    one = read_policy(bench, policy, traits, 5, 1)
    assert one == read_policy(bench, policy, traits, 5, 1)
    assert one != read_policy(bench, policy, traits, 6, 1)


def test_trials_in_which_the_robot_does_not_arrive_are_made_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    tiny = HANDS.with_(improvement=Improvement(updates=1, rollouts=2, habituation=1))
    whole, calls, missed = Bench.run, [], {2, 5}

    def run(self: Bench, *given: object) -> TrialRecord:
        record = whole(self, *given)
        calls.append(record)
        return replace(record, arrived_s=np.inf) if len(calls) in missed else record

    monkeypatch.setattr(Bench, "run", run)
    found = learn(ROBOT, tiny, 4, readings=1)
    assert found.broken_off == 2
    assert len(found.results) == 9
    missed |= set(range(len(calls) + 1, len(calls) + 200))
    with pytest.raises(DataError, match=r"person 4, .*: 5 trials in a row broken off"):
        learn(ROBOT, tiny, 4, readings=1)


def test_a_policy_is_judged_by_trials_that_come_to_an_end(monkeypatch: pytest.MonkeyPatch) -> None:
    bench, traits = Bench(ROBOT, HANDS), draw_traits(generator(1, 0), 3)
    policy, record = HANDS.initial_policy(ROBOT), taken(HANDS, "left")
    records = iter([replace(record, response_s=np.inf, guess=""), record, record])
    monkeypatch.setattr(Bench, "run", lambda *_: next(records))
    found = read_policy(bench, policy, traits, 1, 1)
    assert (found.trials, found.broken_off) == (3, 1)
    assert found.prediction_time == pytest.approx(record.response_s)
    monkeypatch.setattr(Bench, "run", lambda *_: replace(record, arrived_s=np.inf))
    with pytest.raises(DataError, match="in none of 3 trials"):
        read_policy(bench, policy, traits, 1, 1)
