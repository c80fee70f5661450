"""Sessions on disk: they go on as if nothing had happened, and no kill leaves half of one."""

import csv
import json
import os
import random
import resource
import signal
import time
from collections.abc import Callable
from dataclasses import asdict, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hri_planner.dmp.model_file import load_dmp, read_dmp, save_dmp
from hri_planner.dmp.policy import DmpPolicy
from hri_planner.pibb import storage
from hri_planner.pibb.costs import TERM_NAMES, Terms
from hri_planner.pibb.experiment import Experiment
from hri_planner.pibb.experiment_file import experiment_of, to_mapping
from hri_planner.pibb.session import Session, State, row_of
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
    write_whole,
)
from hri_prediction.errors import DataError, HriError
from hri_prediction.promp.storage import read_npz, write_npz

GOALS = {"near, left": [0.5, 0.3, 0.2], "b": [0.6, -0.1, 0.25], "ü": [0.5, -0.3, 0.3]}
PERSON = {"person": "ann", "seed": 7}


def experiment(**changes: Any) -> Experiment:
    content = {
        "name": "made_up",
        "posture": [0.1, -0.2, 0.3, 1.1, 0.0, -0.7, 1.0 / 3.0],
        "goals": GOALS,
        "targets": {name: [0.8, y, 0.04] for name, (_, y, _) in GOALS.items()},
        "boxes": [{"center": [0.48, -0.17, 0.06], "size": [0.1, 0.3, 0.7]}],
        "duration": 1.0,
        "improvement": {
            "updates": 3,
            "rollouts": 4,
            "habituation": 2,
            "exploration": 0.03,
            "averaged": 3,
        },
    }
    return experiment_of({**content, **changes})


def begun(seed: int = 0, **changes: Any) -> Session:
    what = experiment(**changes)
    rng = np.random.default_rng(seed)
    # In another order than the experiment's, and one in another order in memory.
    weights = {name: 0.05 * rng.standard_normal((3, 20)) for name in reversed(GOALS)}
    weights["b"] = np.asfortranarray(weights["b"])
    goals = {name: np.array(GOALS[name]) for name in weights}
    policy = DmpPolicy(np.array([0.3, 0.0, 0.4]), what.posture, goals, weights, 1.0)
    return Session.begin(what, policy, rng)


def step(session: Session, rng: np.random.Generator) -> None:
    trial = session.next_trial()
    assert trial is not None
    drawn = rng.lognormal(size=len(TERM_NAMES))
    terms = Terms(*drawn)
    terms = replace(terms, task=float(rng.random() < 0.2), indistinct=session.indistinctness(trial))
    guess = str(rng.choice(list(GOALS)))
    session.finish(trial, guess, terms, float(rng.normal()))


def advanced(trials: int, **changes: Any) -> Session:
    session, rng = begun(**changes), np.random.default_rng(99)
    for _ in range(trials):
        step(session, rng)
    return session


def bits(policy: DmpPolicy) -> Any:
    parts = {"start": policy.start, "posture": policy.posture}
    parts |= {f"goal {name}": place for name, place in policy.goals.items()}
    parts |= {f"weights {name}": own for name, own in policy.weights.items()}
    parts |= {f"path {name}": policy.path(name) for name in policy.names}
    return policy.duration, [(name, values.tobytes()) for name, values in parts.items()]


def known(session: Session) -> Any:
    """All of a session, so that equal ones are so bit for bit."""
    state = session.state
    return (
        json.dumps(to_mapping(session.experiment)),
        bits(state.policy),
        state.update,
        [(name, own.shape, own.tobytes()) for name, own in state.changes.items()],
        sorted((name, own.shape, own.tobytes()) for name, own in state.late.items()),
        state.order,
        json.dumps(state.costs),
        json.dumps({name: asdict(terms) for name, terms in state.units.items()}),
        json.dumps([row_of(result) for result in state.results]),
        state.rng,
    )


@pytest.fixture
def saved(tmp_path: Path) -> Path:
    """The folder of a session in the middle of its second update."""
    save_session(tmp_path, advanced(6 + 12 + 5), **PERSON)
    return tmp_path


# ------------------------------------------------------------------ going on
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


# ------------------------------------------------------------------ what breaks a save
def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


class Killed(BaseException):
    """Nothing catches it, as nothing runs after a kill."""


@pytest.mark.parametrize("error", [OSError(28, "No space left on device"), Killed()])
@pytest.mark.parametrize("what", ["write_npz", "save_dmp", "_write_rows", "_sync", "os.replace"])
def test_what_was_there_survives_a_save_that_fails(
    saved: Path, monkeypatch: pytest.MonkeyPatch, what: str, error: BaseException
) -> None:
    before = contents(saved)

    def fail(path: Path, *rest: Any) -> None:
        if what != "os.replace":
            Path(path).write_bytes(b"half of i")
        raise error

    monkeypatch.setattr(storage if "." not in what else os, what.removeprefix("os."), fail)
    with pytest.raises(HriError if isinstance(error, OSError) else Killed) as caught:
        save_session(saved, advanced(24), **PERSON)
    if isinstance(error, OSError):
        assert "No space left on device" in str(caught.value)
        assert "still there" in str(caught.value)
        assert "\n" not in str(caught.value)
    assert contents(saved) == before


@pytest.mark.parametrize("moved", [0, 1, 2])
def test_a_kill_between_two_files_leaves_a_whole_session(
    saved: Path, monkeypatch: pytest.MonkeyPatch, moved: int
) -> None:
    now = advanced(24)
    put, done = os.replace, []

    def some(source: Path, target: Path) -> None:
        if len(done) == moved:
            raise Killed
        done.append(target)
        put(source, target)

    monkeypatch.setattr(os, "replace", some)
    with pytest.raises(Killed):
        save_session(saved, now, **PERSON)
    monkeypatch.undo()
    # The session comes last: what is beside it is never older.
    assert known(load_session(saved)[0]) == known(advanced(23))
    read_dmp(saved / POLICY)
    save_session(saved, now, **PERSON)
    assert known(load_session(saved)[0]) == known(now)
    assert sorted(contents(saved)) == sorted([SESSION, TRIALS, POLICY])


def test_files_are_on_the_disk_before_they_take_their_places(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    done: list[str] = []
    sync, put = os.fsync, os.replace

    def synced(opened: int) -> None:
        done.append("sync " + Path(os.readlink(f"/proc/self/fd/{opened}")).name)
        sync(opened)

    def replaced(source: Path, target: Path) -> None:
        done.append(f"put {target.name}")
        put(source, target)

    monkeypatch.setattr(os, "fsync", synced)
    monkeypatch.setattr(os, "replace", replaced)
    save_session(tmp_path, begun(), **PERSON)
    assert done == [
        "sync .trials.part.csv",
        "sync .policy.part.npz",
        "sync .session.part.npz",
        f"put {TRIALS}",
        f"put {POLICY}",
        f"put {SESSION}",
        f"sync {tmp_path.name}",
    ]


@pytest.mark.parametrize("room", [100, 1500, 3000])
def test_a_disk_that_is_full(saved: Path, room: int) -> None:
    before = contents(saved)
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (room, hard))
    try:
        with pytest.raises(HriError, match=r"cannot write .*still there"):
            save_session(saved, advanced(24), **PERSON)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert contents(saved) == before


def test_folders_that_cannot_be_written_to(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(HriError, match=r"cannot write .*file"):
        save_session(tmp_path / "file", begun(), **PERSON)
    with pytest.raises(HriError, match="cannot write"):
        save_session(Path("/proc/nowhere"), begun(), **PERSON)


def test_processes_that_are_killed_leave_whole_files(tmp_path: Path) -> None:
    sessions = [advanced(trials) for trials in (18, 23)]
    wanted = [known(session) for session in sessions]
    save_session(tmp_path, sessions[0], **PERSON)
    pause = random.Random(5)
    for _ in range(15):
        before = (tmp_path / SESSION).stat().st_mtime_ns
        child = os.fork()
        if not child:
            try:
                while True:
                    for session in sessions:
                        save_session(tmp_path, session, **PERSON)
            finally:
                os._exit(1)
        end = time.monotonic() + 30.0
        while (tmp_path / SESSION).stat().st_mtime_ns == before and time.monotonic() < end:
            time.sleep(0.001)
        time.sleep(pause.uniform(0.0, 0.03))
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        assert (tmp_path / SESSION).stat().st_mtime_ns != before
        assert known(load_session(tmp_path)[0]) in wanted
        read_dmp(tmp_path / POLICY)
        with (tmp_path / TRIALS).open(newline="") as file:
            assert len(list(csv.DictReader(file))) in (18, 23)


def test_what_a_kill_left_is_in_nobodys_way(saved: Path) -> None:
    (saved / ".session.part.npz").write_bytes(b"half")
    load_session(saved)
    save_session(saved, advanced(24), **PERSON)
    assert sorted(contents(saved)) == sorted([SESSION, TRIALS, POLICY])


def test_other_generators_are_refused_before_anything_is_written(saved: Path) -> None:
    before = contents(saved)
    session = advanced(8)
    session.state = replace(
        session.state, rng=dict(np.random.Generator(np.random.MT19937(0)).bit_generator.state)
    )
    with pytest.raises(DataError, match="PCG64"):
        save_session(saved, session, **PERSON)
    assert contents(saved) == before


def test_whole_files_come_in_their_order(tmp_path: Path) -> None:
    def writer(text: str) -> Callable[[Path], object]:
        return lambda path: path.write_text(text)

    write_whole({tmp_path / name: writer(name) for name in ("b.txt", "a.txt")})
    assert {name: text.decode() for name, text in contents(tmp_path).items()} == {
        "a.txt": "a.txt",
        "b.txt": "b.txt",
    }


# ------------------------------------------------------------------ what cannot be loaded
def test_where_there_is_no_session(tmp_path: Path) -> None:
    with pytest.raises(DataError, match=r"no session in .*expected a folder with session\.npz"):
        load_session(tmp_path)
    with pytest.raises(DataError, match="no session in"):
        load_session(tmp_path / "nowhere")


def test_foreign_files(saved: Path) -> None:
    policy, _ = read_dmp(saved / POLICY)
    path = saved / SESSION
    save_dmp(path, policy, {})
    with pytest.raises(DataError, match=r"hri-dmp-1.*hri-trials-1"):
        load_session(saved)
    for content in (b"", b"PK\x03\x04", b"number,update\n", (saved / TRIALS).read_bytes()):
        path.write_bytes(content)
        with pytest.raises(DataError, match=r"cannot read .*session\.npz"):
            load_session(saved)
    path.unlink()
    path.mkdir()
    with pytest.raises(DataError, match="cannot read"):
        load_session(saved)


@pytest.mark.filterwarnings("ignore")
def test_damage_is_found_whatever_it_is(saved: Path) -> None:
    path = saved / SESSION
    whole, wanted = path.read_bytes(), known(load_session(saved)[0])
    rng = np.random.default_rng(11)
    said = []
    for turn in range(250):
        damaged = bytearray(whole)
        if turn % 5 == 0:
            del damaged[int(rng.integers(len(whole))) :]
        elif turn % 5 == 1:
            at = int(rng.integers(len(whole)))
            damaged[at : at + int(rng.integers(1, 400))] = rng.bytes(int(rng.integers(0, 400)))
        else:
            for at in rng.integers(len(whole), size=int(rng.integers(1, 4))):
                damaged[at] ^= int(rng.integers(1, 256))
        path.write_bytes(damaged)
        try:
            found = known(load_session(saved)[0])
        except DataError as error:
            said.append(str(error))
        else:  # dates and the like, which mean nothing
            assert found == wanted
    assert len(said) > 200
    assert all(str(path) in text and "\n" not in text for text in said)


def no(header: dict[str, Any], arrays: dict[str, Any], name: str) -> None:
    header.pop(name, None)
    arrays.pop(name, None)


CHANGES: dict[str, Callable[[dict[str, Any], dict[str, Any]], object]] = {
    "update = None": lambda header, arrays: no(header, arrays, "update"),
    "no array weights_1": lambda header, arrays: no(header, arrays, "weights_1"),
    "no array late_1": lambda header, arrays: no(header, arrays, "late_1"),
    "made_up', late": lambda header, arrays: no(header, arrays, "late_0"),
    "made_up', late; ": lambda header, arrays: arrays.update(late_2=np.zeros((3, 4))),
    "no array changes_0": lambda header, arrays: no(header, arrays, "changes_0"),
    "no array start": lambda header, arrays: arrays.update(start=np.array(["a", "b", "c"])),
    "start has shape": lambda header, arrays: arrays.update(start=np.zeros(4)),
    "posture has shape": lambda header, arrays: arrays.update(posture=np.full(7, np.nan)),
    "update = True": lambda header, arrays: header.update(update=True),
    "update = '1'": lambda header, arrays: header.update(update="1"),
    "made_up', update": lambda header, arrays: header.update(update=4),
    "changed, costs, late, units": lambda header, arrays: header.update(update=-1),
    "made_up', order": lambda header, arrays: header.update(order=[]),
    "order, costs": lambda header, arrays: header.update(
        order=[["b", 4]], costs={"b": [[-1, 0.0]]}
    ),
    "order = 'b'": lambda header, arrays: header.update(order="b"),
    "ValueError": lambda header, arrays: header.update(order=[["b"]]),
    "made_up', costs": lambda header, arrays: header.update(costs={"b": [[0, float("nan")]]}),
    "made_up', units": lambda header, arrays: header["units"]["b"].update(task=0.0),
    "KeyError: 'task'": lambda header, arrays: header["units"]["b"].pop("task"),
    "KeyError: 'guess'": lambda header, arrays: header["results"][3].pop("guess"),
    "made_up', results": lambda header, arrays: header["results"].pop(3),
    "costs of the trial: task": lambda header, arrays: header["results"][3].update(task=-1.0),
    "TypeError": lambda header, arrays: header.update(results=[1]),
    "generator": lambda header, arrays: header["rng"].update(bit_generator="MT19937"),
    "generator.* large": lambda header, arrays: header["rng"]["state"].update(state=2**200),
    "generator: ": lambda header, arrays: header["rng"].pop("state"),
    "no person or no seed": lambda header, arrays: no(header, arrays, "person"),
    "no goals|no name, goals": lambda header, arrays: no(header["experiment"], arrays, "goals"),
    "rollouts": lambda header, arrays: header["experiment"]["improvement"].update(rollouts=-1),
    "cannot be used": lambda header, arrays: header["experiment"].update(improvement=5),
    "duration 90": lambda header, arrays: header.update(duration=90.0),
    "goals at least|goals \\[\\]": lambda header, arrays: header.update(goals=[]),
    "made_up', goals": lambda header, arrays: header.update(goals=["other", *header["goals"][1:]]),
}


@pytest.mark.parametrize("match", CHANGES)
def test_files_that_do_not_hold_together_are_refused(saved: Path, match: str) -> None:
    arrays, header = read_npz(saved / SESSION, FORMAT)
    CHANGES[match](header, arrays)
    json.dumps(header)
    write_npz(saved / SESSION, arrays, header)
    with pytest.raises(DataError, match=match) as caught:
        load_session(saved)
    assert str(saved / SESSION) in str(caught.value)
