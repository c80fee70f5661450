"""Sessions on disk go on as if nothing had happened."""

import csv
from dataclasses import fields
from pathlib import Path

import numpy as np
from sessions import GOALS, PERSON, advanced, begun, bits, experiment, known, step

from hri_planner.dmp.model_file import load_dmp, read_dmp
from hri_planner.dmp.policy import DmpPolicy
from hri_planner.pibb.costs import TERM_NAMES, Terms
from hri_planner.pibb.experiment import Experiment
from hri_planner.pibb.experiment_file import to_mapping
from hri_planner.pibb.session import Session, State
from hri_planner.pibb.storage import (
    COLUMNS,
    FORMAT,
    POLICY,
    SESSION,
    TRIALS,
    learnt_in,
    learnt_policy,
    load_session,
    save_session,
)
from hri_prediction.promp.storage import read_npz, write_npz


def test_all_that_a_session_knows_is_saved() -> None:
    # Whoever adds to these must save it, too.
    names = {"policy", "update", "changes", "order", "costs", "units", "results", "rng", "late"}
    assert {own.name for own in fields(State)} == names
    assert {own.name for own in fields(Experiment)} == set(to_mapping(experiment()))
    assert {own.name for own in fields(DmpPolicy)} - {"_back"} == {
        "start",
        "posture",
        "goals",
        "weights",
        "duration",
    }


def test_broken_off_after_each_trial_it_goes_on_as_if_never(tmp_path: Path) -> None:
    whole, broken = begun(), begun()
    first, second = np.random.default_rng(99), np.random.default_rng(99)
    for _ in range(whole.trials):
        save_session(tmp_path, broken, **PERSON)
        broken, header = load_session(tmp_path)
        assert (header["person"], header["seed"]) == ("ann", 7)
        assert known(broken) == known(whole)
        trial = whole.next_trial()
        assert trial is not None
        assert broken.next_trial() == trial
        assert bits(broken.policy_of(trial)) == bits(whole.policy_of(trial))
        assert broken.sd == whole.sd
        step(whole, first)
        step(broken, second)
    save_session(tmp_path, broken, **PERSON)
    over, _ = load_session(tmp_path)
    assert over.stage == "over"
    assert over.next_trial() is None
    assert known(over) == known(whole)


def test_what_others_read_is_the_mean_of_the_updates_so_far(tmp_path: Path) -> None:
    session, rng, after = begun(), np.random.default_rng(99), []
    while session.next_trial() is not None:
        before = session.state.policy
        step(session, rng)
        if session.state.update > 0 and session.state.policy is not before:
            after.append(session.state.policy)
            save_session(tmp_path, session, **PERSON)
            assert learnt_in(session, **PERSON)["averaged"] == len(after)
            if len(after) < 3:
                wanted = np.mean([one.weights["b"] for one in after], axis=0)
                found = load_dmp(tmp_path / POLICY).weights["b"]
                np.testing.assert_allclose(found, wanted, atol=1e-15)
    np.testing.assert_array_equal(
        load_dmp(tmp_path / POLICY).weights["b"], session.state.policy.weights["b"]
    )


def test_sessions_from_before_averaging_go_on(tmp_path: Path) -> None:
    plan = {"updates": 3, "rollouts": 4, "habituation": 2, "exploration": 0.03}
    session = advanced(6 + 12 + 5, improvement=plan)
    save_session(tmp_path, session, **PERSON)
    arrays, header = read_npz(tmp_path / SESSION, FORMAT)
    assert header["experiment"]["improvement"].pop("averaged") == 1
    write_npz(tmp_path / SESSION, arrays, header)
    assert known(load_session(tmp_path)[0]) == known(session)


def test_an_update_that_was_cut_short_goes_on_too(tmp_path: Path) -> None:
    session = advanced(6 + 9)
    session.update_now()
    save_session(tmp_path, session, **PERSON)
    again, _ = load_session(tmp_path)
    rngs = np.random.default_rng(3), np.random.default_rng(3)
    while session.next_trial() is not None:
        for one, rng in zip((session, again), rngs, strict=True):
            step(one, rng)
    assert known(again) == known(session)
    save_session(tmp_path, again, **PERSON)
    assert known(load_session(tmp_path)[0]) == known(session)


def test_numbers_of_numpy_and_without_bounds_are_kept(tmp_path: Path) -> None:
    session = begun()
    trial = session.next_trial()
    assert trial is not None
    terms = Terms(*(np.float32(0.1) * k for k in range(len(TERM_NAMES))))
    session.finish(trial, trial.goal, terms, np.inf)
    save_session(tmp_path, session, person="ann", seed=np.int64(7))
    (result,) = load_session(tmp_path)[0].state.results
    assert result == session.state.results[0]
    assert type(result.terms.task) is float


def test_whole_numbers_in_a_policy_are_kept(tmp_path: Path) -> None:
    what = experiment(posture=[0, 0, 0, 1, 0, -1, 0])
    goals = {name: np.array(place) for name, place in GOALS.items()}
    weights = {name: np.zeros((3, 20), dtype=int) for name in GOALS}
    policy = DmpPolicy(np.array([0, 0, 1]), np.zeros(7, int), goals, weights, 1)
    save_session(tmp_path, Session.begin(what, policy, np.random.default_rng(0)), **PERSON)
    again = load_session(tmp_path)[0].state.policy
    np.testing.assert_array_equal(again.start, [0.0, 0.0, 1.0])


def test_the_same_session_makes_the_same_file(saved: Path, tmp_path: Path) -> None:
    before = (saved / SESSION).read_bytes()
    save_session(saved, load_session(saved)[0], **PERSON)
    assert (saved / SESSION).read_bytes() == before


# ------------------------------------------------------------------ what is beside it
def test_trials_are_a_table(saved: Path) -> None:
    with (saved / TRIALS).open(newline="") as file:
        rows = list(csv.DictReader(file))
    results = advanced(23).state.results
    assert [row["number"] for row in rows] == [str(number) for number in range(23)]
    for row, result in zip(rows, results, strict=True):
        assert tuple(row) == COLUMNS
        assert row["goal"] == result.trial.goal
        assert float(row["cost"]) == result.cost
        assert float(row["prediction_time"]) == result.terms.prediction_time


def test_a_table_without_trials_has_its_columns(tmp_path: Path) -> None:
    save_session(tmp_path, begun(), **PERSON)
    assert (tmp_path / TRIALS).read_text() == ",".join(COLUMNS) + "\n"


def test_the_policy_says_how_it_came_about(tmp_path: Path) -> None:
    session = advanced(6 + 12 + 12 + 5)
    save_session(tmp_path / "new" / "folder", session, **PERSON, commit="v1-3-gabc")
    policy, learnt = read_dmp(tmp_path / "new" / "folder" / POLICY)
    assert bits(policy) == bits(learnt_policy(session))
    costs = [
        np.mean([r.cost for r in session.state.results if r.trial.update == update])
        for update in (0, 1)
    ]
    assert learnt.pop("saved").startswith("20")
    assert learnt == {
        "experiment": "made_up",
        "person": "ann",
        "seed": 7,
        "updates": 2,
        "averaged": 2,
        "trials": 35,
        "costs": costs,
        "cost_first": costs[0],
        "cost_last": costs[1],
        "commit": "v1-3-gabc",
    }


def test_before_the_first_update_there_are_no_costs(tmp_path: Path) -> None:
    save_session(tmp_path, advanced(6 + 3), **PERSON)
    _, learnt = read_dmp(tmp_path / POLICY)
    assert (learnt["updates"], learnt["trials"], learnt["costs"]) == (0, 9, [])
    assert learnt["cost_first"] is None
