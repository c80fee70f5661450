"""A session changes when a trial is over, and only then."""

import copy
from collections import Counter
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from hri_planner.dmp.policy import DmpPolicy
from hri_planner.pibb.costs import DEVIATION_M2, CostWeights, Terms, total
from hri_planner.pibb.experiment import Experiment, Improvement
from hri_planner.pibb.session import (
    HABITUATION,
    LEARNING,
    OVER,
    Session,
    Trial,
    result_of,
    row_of,
)
from hri_planner.pibb.update import improved
from hri_prediction.errors import DataError, HriError, PlanningError

GOALS = {"a": np.array((0.56, 0.24, 0.12)), "b": np.array((0.6, 0.0, 0.12)),
         "c": np.array((0.56, -0.24, 0.12))}  # fmt: skip
START, POSTURE = np.array((0.39, 0.0, 0.33)), np.zeros(7)
PLAN = Improvement(updates=3, rollouts=4, habituation=2, exploration=0.06, decay=0.8)
EXPERIMENT = Experiment("e", POSTURE, GOALS, GOALS, np.zeros((0, 2, 3)), 2.5, improvement=PLAN)
POLICY = DmpPolicy(START, POSTURE, GOALS, {name: np.zeros((3, 20)) for name in GOALS}, 2.5)


def new(seed: int = 0, experiment: Experiment = EXPERIMENT) -> Session:
    return Session.begin(experiment, POLICY, np.random.default_rng(seed))


def terms_of(session: Session, trial: Trial, time_s: float = 2.0) -> Terms:
    """Of a person who reads ways sooner that go up; all numbers differ."""
    weights = session.policy_of(trial).weights[trial.goal]
    found = time_s + 5.0 * float(np.mean((weights[2] - 0.05) ** 2))
    return Terms(3.0 + 0.1 * trial.number, 4.0, found, trial.number % 2, 1e-4, 0.6, 0.2)


def finish(session: Session, trials: int | None = None) -> list[Trial]:
    done = []
    while len(done) != trials and (trial := session.next_trial()) is not None:
        session.finish(trial, trial.goal, terms_of(session, trial), 0.1)
        done.append(trial)
    return done


def snapshot(session: Session) -> dict[str, Any]:
    """All values of a session's state, such as compare as equal."""
    state = session.state
    return {
        "update": state.update,
        "order": state.order,
        "costs": copy.deepcopy(state.costs),
        "units": dict(state.units),
        "late": {name: own.tolist() for name, own in state.late.items()},
        "results": state.results,
        "rng": copy.deepcopy(state.rng),
        "changes": {name: own.tolist() for name, own in state.changes.items()},
        "weights": {name: own.tolist() for name, own in state.policy.weights.items()},
    }


def test_each_sample_of_each_goal_comes_once_in_an_update() -> None:
    session = new()
    trials = finish(session)
    assert len(trials) == session.trials == 3 * (2 + 3 * 4)
    assert [trial.number for trial in trials] == list(range(len(trials)))
    habituation, learning = trials[:6], trials[6:]
    assert {(t.update, t.sample) for t in habituation} == {(-1, 0)}
    for round_ in (habituation[:3], habituation[3:]):
        assert {trial.goal for trial in round_} == set(GOALS)
    for update in range(3):
        own = Counter((t.goal, t.sample) for t in learning if t.update == update)
        assert own == Counter((goal, sample) for goal in GOALS for sample in range(4))
    assert [t.update for t in learning] == sorted(t.update for t in learning)
    orders = [[(t.goal, t.sample) for t in learning if t.update == u] for u in range(3)]
    assert orders[0] != orders[1] != orders[2], "in random order"


def test_a_session_is_over_at_the_end() -> None:
    session = new()
    stages = []
    while (trial := session.next_trial()) is not None:
        stages.append(session.stage)
        session.finish(trial, trial.goal, terms_of(session, trial), 0.1)
    assert stages == [HABITUATION] * 6 + [LEARNING] * 36
    assert session.stage == OVER
    assert len(session.state.results) == 42
    with pytest.raises(PlanningError, match="expected those of None"):
        session.finish(Trial(42, 3, "a", 0), "a", Terms(1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0), 0.1)
    with pytest.raises(PlanningError, match="no goal has two trials"):
        session.update_now()


def test_a_trial_that_is_broken_off_leaves_no_trace() -> None:
    session = new()
    for done in (3, 5):  # in the habituation, and while learning
        finish(session, done)
        before, state = snapshot(session), session.state
        trial = session.next_trial()
        assert trial is not None
        policy = session.policy_of(trial)
        policy.path(trial.goal)
        policy.weights_from(GOALS["a"], "start")
        session.indistinctness(trial)
        assert session.next_trial() == trial
        assert session.state is state
        assert snapshot(session) == before
        again = session.policy_of(trial)
        for name in GOALS:
            np.testing.assert_array_equal(again.weights[name], policy.weights[name])


WRONG: list[tuple[Any, Any, Any, Any]] = [
    ({"number": 99}, "a", {}, "expected those of Trial"),
    ({"sample": 7}, "a", {}, "expected those of Trial"),
    ({"goal": "nowhere"}, "a", {}, "expected those of Trial"),
    ({"update": 2}, "a", {}, "expected those of Trial"),
    ({}, "d", {}, "the guess 'd' is no goal; expected a, b, c"),
    ({}, "", {}, "the guess '' is no goal"),
    ({}, "start", {}, "the guess 'start' is no goal"),
    ({}, "a", {"prediction_time": np.inf}, "prediction_time = inf"),
    ({}, "a", {"joint_jerk": np.nan}, "joint_jerk = nan"),
    ({}, "a", {"task": -1.0}, r"task = -1\.0"),
    ({}, "a", {"prediction_time": 1e308}, "cost|prediction_time"),
]


@pytest.mark.parametrize(("trial", "guess", "terms", "match"), WRONG)
@pytest.mark.parametrize("done", [0, 5, 7, 17])
def test_what_is_wrong_is_refused_and_changes_nothing(
    done: int, trial: dict[str, Any], guess: str, terms: dict[str, float], match: str
) -> None:
    session = new()
    finish(session, done)
    before, state = snapshot(session), session.state
    following = session.next_trial()
    assert following is not None
    if done < 6 and match.startswith("cost"):
        return  # the habituation has no costs
    own = replace(terms_of(session, following), **terms)
    with pytest.raises(HriError, match=match):
        session.finish(replace(following, **trial), guess, own, 0.1)
    assert session.state is state
    assert snapshot(session) == before
    session.finish(following, following.goal, terms_of(session, following), 0.1)
    assert len(session.state.results) == done + 1


def test_a_state_never_changes_once_it_is_there() -> None:
    """So that it can be saved while trials go on, and gone back to."""
    session = new()
    kept = []
    while (trial := session.next_trial()) is not None:
        kept.append((session.state, snapshot(session)))
        session.finish(trial, trial.goal, terms_of(session, trial), 0.1)
    for state, values in kept:
        assert snapshot(Session(EXPERIMENT, state)) == values


@pytest.mark.parametrize("done", [0, 4, 6, 11, 18])
def test_a_session_goes_on_from_any_state_as_it_would_have(done: int) -> None:
    session = new(3)
    finish(session, done)
    resumed = Session(EXPERIMENT, session.state)
    assert finish(resumed) == finish(session)
    assert snapshot(resumed) == snapshot(session)


def test_the_same_seed_makes_the_same_session() -> None:
    one, other, third = new(5), new(5), new(6)
    assert finish(one) == finish(other)
    assert snapshot(one) == snapshot(other)
    finish(third)
    assert snapshot(third)["weights"] != snapshot(one)["weights"]


def test_samples_are_around_the_mean_and_the_first_is_the_mean() -> None:
    session = new()
    finish(session, 6)
    while (trial := session.next_trial()) is not None and trial.update < 1:
        mean, own = session.state.policy, session.policy_of(trial)
        same = np.array_equal(own.weights[trial.goal], mean.weights[trial.goal])
        assert same == (trial.sample == 0)
        for name in GOALS:
            if name != trial.goal:
                np.testing.assert_array_equal(own.weights[name], mean.weights[name])
        np.testing.assert_array_equal(own.start, START)
        session.finish(trial, trial.goal, terms_of(session, trial), 0.1)


def test_exploration_decays() -> None:
    plan = replace(PLAN, updates=6, rollouts=30)
    session = new(experiment=EXPERIMENT.with_(improvement=plan))
    assert session.sd == 0.06
    finish(session, 6)
    for update in range(6):
        assert session.sd == pytest.approx(0.06 * 0.8**update)
        drawn = np.array([own[1:] for own in session.state.changes.values()])
        # The ends take some of it away.
        assert 0.75 * session.sd < np.sqrt(np.mean(drawn**2)) < 1.05 * session.sd
        finish(session, 90)
    assert session.stage == OVER


def test_an_update_is_that_of_pi_bb() -> None:
    session = new()
    finish(session, 6)
    state = session.state
    done = finish(session, 12)
    costs = {(r.trial.goal, r.trial.sample): r.cost for r in session.state.results[6:]}
    assert len(costs) == len(done) == 12
    for name in GOALS:
        wanted = improved(
            state.policy.weights[name], state.changes[name], [costs[name, k] for k in range(4)],
            PLAN.greed,
        )  # fmt: skip
        np.testing.assert_allclose(session.state.policy.weights[name], wanted, atol=1e-15)
        assert np.abs(wanted).max() > 0.0


@pytest.mark.parametrize("averaged", [1, 2, 3])
def test_what_is_learnt_is_the_mean_of_the_last_updates(averaged: int) -> None:
    experiment = EXPERIMENT.with_(improvement=replace(PLAN, averaged=averaged))
    session = new(4, experiment)
    finish(session, 6)
    after = []
    for update in range(3):
        state = session.state
        finish(session, 12)
        costs = {(r.trial.goal, r.trial.sample): r.cost for r in session.state.results[-12:]}
        after.append({
            name: improved(state.policy.weights[name], state.changes[name],
                           [costs[name, k] for k in range(4)], PLAN.greed)
            for name in GOALS
        })  # fmt: skip
        if update < 2:
            # What is averaged changes nothing of what is tried.
            for name in GOALS:
                own = session.state.policy.weights[name]
                np.testing.assert_allclose(own, after[-1][name], atol=1e-15)
    for name in GOALS:
        wanted = np.mean([own[name] for own in after[-averaged:]], axis=0)
        np.testing.assert_allclose(session.state.policy.weights[name], wanted, atol=1e-15)


def test_costs_are_in_units_of_the_habituation() -> None:
    session = new()
    finish(session, 6)
    units = session.state.units
    first = session.state.results
    times = [r.terms.prediction_time for r in first]
    for name in GOALS:
        own = [r.terms.tool_jerk for r in first if r.trial.goal == name]
        assert units[name].tool_jerk == pytest.approx(np.mean(own))
        assert units[name].prediction_time == pytest.approx(np.mean(times))
        assert (units[name].task, units[name].deviation) == (1.0, DEVIATION_M2)
    assert all(result.cost == 0.0 for result in first)
    finish(session)
    assert session.state.units == units, "fixed"
    for result in session.state.results[6:]:
        wanted = total(result.terms, units[result.trial.goal], EXPERIMENT.weights)
        assert result.cost == pytest.approx(wanted)


def test_what_the_habituation_does_not_have_counts_as_it_is() -> None:
    """A key is pressed: hands do not move, and times may be none."""
    session = new()
    nothing = Terms(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    while session.stage == HABITUATION:
        trial = session.next_trial()
        assert trial is not None
        session.finish(trial, "a", nothing, 0.1)
    finish(session)
    assert all(np.isfinite(result.cost) for result in session.state.results)
    assert session.state.results[0].guess == "a"


def test_an_update_may_come_before_all_its_trials() -> None:
    session = new()
    with pytest.raises(PlanningError, match="no goal has two trials in this update"):
        session.update_now()
    finish(session, 6 + 7)
    state = session.state
    many = [name for name, own in state.costs.items() if len(own) > 1]
    session.update_now()
    assert session.state.update == 1
    following = session.next_trial()
    assert following is not None
    assert (following.number, following.update) == (13, 1)
    assert len(session.state.order) == 12
    assert session.state.results == state.results
    for name in GOALS:
        same = np.array_equal(session.state.policy.weights[name], state.policy.weights[name])
        assert same == (name not in many)
    for name in many:
        own = sorted(state.costs[name])
        wanted = improved(
            state.policy.weights[name], state.changes[name][own],
            [state.costs[name][k] for k in own], PLAN.greed,
        )  # fmt: skip
        np.testing.assert_allclose(session.state.policy.weights[name], wanted, atol=1e-15)
    before = snapshot(session)
    with pytest.raises(PlanningError, match="no goal has two trials"):
        session.update_now()
    assert snapshot(session) == before


def test_what_is_rewarded_is_learnt() -> None:
    """Ways are read sooner the nearer the heights' weights are to 5 cm: they come nearer."""
    plan = Improvement(updates=15, rollouts=6, habituation=1, exploration=0.05, decay=0.92)
    weights = CostWeights(0.0, 0.0, 100.0, 0.0, 0.0, 0.0, 0.0)
    session = new(1, EXPERIMENT.with_(improvement=plan, weights=weights))
    finish(session)
    for name in GOALS:
        # What the ends take is not there to be learnt.
        heights = session.state.policy.weights[name][2, 2:-6]
        assert np.mean((heights - 0.05) ** 2) < 0.5 * 0.05**2


def test_indistinctness_is_beside_the_means_of_the_others() -> None:
    session = new()
    finish(session, 6)
    trial = next(Trial(6, 0, "b", k) for k in (2,))
    straight = session.indistinctness(replace(trial, sample=0))
    other = session.indistinctness(trial)
    assert straight > 0.0
    assert other > 0.0
    assert straight != other
    paths = {name: POLICY.path(name)[5::5] for name in GOALS}
    steps = np.arange(1, len(paths["b"]) + 1)
    apart = [np.sum(np.linalg.norm(paths["b"] - paths[n], axis=1) / steps) for n in ("a", "c")]
    assert straight == pytest.approx(1.0 / sum(apart))


def test_policies_with_other_goals_are_refused() -> None:
    two = {name: GOALS[name] for name in "ab"}
    other = DmpPolicy(START, POSTURE, two, {name: np.zeros((3, 20)) for name in two}, 2.5)
    with pytest.raises(PlanningError, match="policy with goals a, b; expected a, b, c"):
        Session.begin(EXPERIMENT, other, np.random.default_rng(0))


def test_results_survive_their_rows() -> None:
    session = new()
    finish(session, 9)
    for result in session.state.results:
        row = row_of(result)
        assert result_of(row) == result
        assert result_of({name: str(value) for name, value in row.items()}) == result
        for name in row:
            with pytest.raises((KeyError, TypeError)):
                result_of({key: value for key, value in row.items() if key != name})


def test_errors_are_of_the_kinds_that_are_told() -> None:
    session = new()
    trial = session.next_trial()
    assert trial is not None
    with pytest.raises(DataError, match="costs of the trial"):
        session.finish(trial, "a", replace(terms_of(session, trial), task=np.nan), 0.1)
