"""The loop beside a predictor: what it sees, in a process of its own, and when that ends."""

import os
import signal
import socket
import time
from dataclasses import replace

import numpy as np
import pytest
from reaching import reach_of

from hri_prediction.errors import DataError, HriError
from hri_prediction.hybrid import background
from hri_prediction.hybrid.background import Background, _still_asked
from hri_prediction.hybrid.config import HybridConfig
from hri_prediction.hybrid.loop import (
    Expected,
    Explained,
    Inline,
    Learnt,
    Left,
    Loop,
    Reached,
    Rested,
    Setup,
    Trouble,
)
from hri_prediction.hybrid.person import HybridPerson, Rest
from hri_prediction.hybrid.store import PeopleStore
from hri_prediction.hybrid.task import TaskKey
from hri_prediction.hybrid.weight_file import save_process
from hri_prediction.prediction.config import PredictorConfig

KEY = TaskKey("right", "rest", "near")


@pytest.fixture
def setup(targets, people, tmp_path):
    save_process(tmp_path / "weights.json", people, "a test")
    config = HybridConfig(settled=0.5, settled_reaches=2)
    return Setup(
        targets,
        PredictorConfig(),
        config,
        tmp_path / "weights.json",
        tmp_path / "people",
        frozenset({"anna"}),
    )


def reaches(targets, people, rest, count):
    person, rng = HybridPerson(targets, people), np.random.default_rng(1)
    person.at_rest(rest)
    return [
        reach_of(person, rest, KEY, rng, aside=np.array([0.0, 0.01, 0.0])) for _ in range(count)
    ]


def wait_for(loop, kind, seconds=60.0):
    end = time.monotonic() + seconds
    found = []
    while time.monotonic() < end:
        found += loop.answers()
        if any(isinstance(answer, kind) for answer in found):
            return found
        time.sleep(0.01)
    raise AssertionError(f"no {kind.__name__} among {found}")


def test_a_process_guesses_learns_explains_and_ends(setup, targets, people, rest):
    loop = Background(setup)
    try:
        loop.ask(Rested("anna", rest))
        (expected,) = wait_for(loop, Expected)
        assert (expected.person, expected.side) == ("anna", "right")
        assert len(expected.library.tasks) == 2
        for reach in reaches(targets, people, rest, 4):
            loop.ask(Reached("anna", reach))
        found = wait_for(loop, Explained)
        assert [answer.seen for answer in found if isinstance(answer, Learnt)] == [1, 2, 3, 4]
        assert PeopleStore(setup.store).people()[0].reaches == {"right near_from_rest": 4}
    finally:
        loop.close()
    assert not loop.alive


def test_at_once_it_says_the_same(setup, targets, people, rest):
    loop = Inline(setup)
    loop.ask(Rested("anna", rest))
    assert isinstance(loop.answers()[0], Expected)
    for reach in reaches(targets, people, rest, 4):
        loop.ask(Reached("anna", reach))
    kinds = [type(answer) for answer in loop.answers()]
    assert kinds.count(Learnt) == 4
    assert Explained in kinds
    assert loop.answers() == []


def test_it_ends_with_whoever_started_it(setup):
    loop = Background(setup)
    with socket.socket(fileno=os.dup(loop._connection.fileno())) as pipe:
        pipe.shutdown(socket.SHUT_RDWR)  # as when the predictor is killed
    assert loop._process.wait(60.0) == 0


def test_a_process_that_does_not_begin_is_said(setup, monkeypatch):
    monkeypatch.setattr(background, "_MODULE", "hri_prediction.errors")
    with pytest.raises(HriError, match="did not begin"):
        Background(setup)


def test_trouble_is_told_and_does_not_end_it(setup, rest, targets):
    loop = Inline(setup)
    far = Rest(rest.body, rest.points + 5.0)
    loop.ask(Rested("anna", far))
    (answer,) = loop.answers()
    assert isinstance(answer, Trouble)
    assert "no target can be reached" in answer.text


def test_overtaken_questions_are_dropped(rest, targets, people):
    (reach,) = reaches(targets, people, rest, 1)
    old, new = Rested("anna", rest), Rested("anna", rest)
    other, learnt = Rested("berta", rest), Reached("anna", reach)
    assert _still_asked([old, learnt, other, new, None]) == [learnt, other, new, None]


def test_a_wrong_file_of_weights_is_named_at_once(setup, tmp_path):
    with pytest.raises(DataError, match="nowhere"):
        Background(replace(setup, weights=tmp_path / "nowhere.json"))


@pytest.mark.parametrize("content", [b"", b'{"format": "hri-per', b"[]", b"\xff\xfe"])
def test_a_damaged_person_is_told_and_does_not_end_it(setup, rest, content):
    (setup.store / "anna").mkdir(parents=True)
    (setup.store / "anna" / "person.json").write_bytes(content)
    loop = Inline(setup)
    loop.ask(Rested("anna", rest))
    (answer,) = loop.answers()
    assert isinstance(answer, Trouble)
    assert "person.json" in answer.text
    loop.ask(Rested("berta", rest))
    assert isinstance(loop.answers()[0], Expected)


def test_strangers_are_learnt_and_not_kept(setup, rest, targets, people):
    loop = Inline(setup)
    (reach,) = reaches(targets, people, rest, 1)
    loop.ask(Reached("body7", reach))
    assert isinstance(loop.answers()[0], Learnt)
    assert PeopleStore(setup.store).names() == []


def test_who_is_deleted_meanwhile_is_forgotten(setup, rest, targets, people):
    loop = Inline(setup)
    first, second = reaches(targets, people, rest, 2)
    loop.ask(Reached("anna", first))
    loop.answers()
    PeopleStore(setup.store).delete("anna")
    loop.ask(Reached("anna", second))
    kinds = [type(answer) for answer in loop.answers()]
    assert kinds == [Trouble, Learnt]
    assert PeopleStore(setup.store).people()[0].reaches == {"right near_from_rest": 1}


def test_who_takes_the_name_of_somebody_is_somebody_else(setup, rest, targets, people):
    """Folders are moved while nobody asks: what was learnt of one is not written to the other."""
    loop = Inline(setup)
    first, second, third = reaches(targets, people, rest, 3)
    loop.ask(Reached("anna", first))
    loop.ask(Reached("anna", second))
    loop.answers()
    store = PeopleStore(setup.store)
    other = Inline(replace(setup, people=frozenset({"berta"})))
    other.ask(Reached("berta", first))
    other.close()
    store.move("anna", "gone")
    store.move("berta", "anna")
    loop.ask(Reached("anna", third))
    told = [answer for answer in loop.answers() if not isinstance(answer, Explained)]
    assert [type(answer) for answer in told] == [Trouble, Learnt]
    assert "another one" in told[0].text
    assert told[1].seen == 2
    seen = {known.name: known.reaches for known in store.people()}
    assert seen == {
        "anna": {"right near_from_rest": 2},
        "gone": {"right near_from_rest": 2},
    }


def test_who_is_deleted_before_an_explanation_does_not_come_back(
    setup, rest, targets, people, monkeypatch
):
    loop, store = Loop(setup), PeopleStore(setup.store)
    for reach in reaches(targets, people, rest, 4):
        loop.answer(Reached("anna", reach))
    explain = HybridPerson.explain

    def deleted_meanwhile(person, key):
        found = explain(person, key)
        store.delete("anna")
        return found

    monkeypatch.setattr(HybridPerson, "explain", deleted_meanwhile)
    (told,) = loop.explain_next()
    assert isinstance(told, Trouble)
    assert store.names() == []
    assert not (setup.store / "anna").exists()
    assert loop.explain_next() == []


def test_what_a_full_disk_did_not_take_is_written_when_it_has_room(
    setup, rest, targets, people, monkeypatch
):
    other = TaskKey("right", "rest", "side")
    person, rng = HybridPerson(targets, people), np.random.default_rng(1)
    person.at_rest(rest)
    near, side = (reach_of(person, rest, key, rng, aside=np.zeros(3)) for key in (KEY, other))
    save, full = PeopleStore.save, [True]

    def saved(store, name, tasks, own):
        if full[0]:
            raise HriError("No space left on device")
        save(store, name, tasks, own)

    monkeypatch.setattr(PeopleStore, "save", saved)
    loop = Loop(setup)
    learnt, trouble = loop.answer(Reached("anna", near))
    assert isinstance(learnt, Learnt)
    assert "No space" in trouble.text
    full[0] = False
    (learnt,) = loop.answer(Reached("anna", side))
    both = {"right near_from_rest": 1, "right side_from_rest": 1}
    assert PeopleStore(setup.store).people()[0].reaches == both
    # Likewise when it ends.
    full[0] = True
    loop.answer(Reached("anna", near))
    full[0] = False
    loop.close()
    assert PeopleStore(setup.store).people()[0].reaches["right near_from_rest"] == 2


def test_a_process_keeps_what_it_can_when_it_ends(setup, rest, targets, people):
    loop = Background(setup)
    near, again = reaches(targets, people, rest, 2)
    loop.ask(Reached("anna", near))
    wait_for(loop, Learnt)
    # As when a disk is full: nothing can be written where a file of that name is a folder.
    file = next((setup.store / "anna").glob("*.npz"))
    kept = file.read_bytes()
    file.unlink()
    (file / "something").mkdir(parents=True)
    loop.ask(Reached("anna", again))
    wait_for(loop, Trouble)
    (file / "something").rmdir()
    file.rmdir()
    file.write_bytes(kept)
    loop.close()
    assert PeopleStore(setup.store).people()[0].reaches == {"right near_from_rest": 2}


def test_a_folder_that_cannot_be_looked_at_does_not_end_it(
    setup, rest, targets, people, monkeypatch
):
    loop = Inline(setup)
    for reach in reaches(targets, people, rest, 3):
        loop.ask(Reached("anna", reach))

    def fails(*_):
        raise OSError(5, "Input/output error")

    monkeypatch.setattr(PeopleStore, "identity", fails)
    (reach,) = reaches(targets, people, rest, 1)
    loop.ask(Reached("anna", reach))
    loop.ask(Reached("anna", reach))
    assert any(isinstance(each, Trouble) for each in loop.answers())
    loop.close()


def test_a_folder_that_cannot_be_looked_at_is_not_asked_after_without_end(
    setup, rest, targets, people, monkeypatch
):
    loop = Loop(replace(setup, people=frozenset({"anna", "berta"})))
    first, *others = reaches(targets, people, rest, 4)
    for name in ("anna", "berta"):
        for reach in others:
            loop.answer(Reached(name, reach))

    identity = PeopleStore.identity

    def fails(store, name):
        if name == "anna":
            raise OSError(5, "Input/output error")
        return identity(store, name)

    with monkeypatch.context() as patched:
        patched.setattr(PeopleStore, "identity", fails)
        (told,) = loop.explain_next()
        assert isinstance(told, Trouble)
        assert "Input/output error" in told.text
        # Others are explained meanwhile, and then there is nothing to do.
        (told,) = loop.explain_next()
        assert (type(told), told.person) == (Explained, "berta")
        assert loop.explain_next() == []
        assert isinstance(loop.answer(Reached("anna", first))[0], Trouble)
    # As soon as the folder is there again.
    assert isinstance(loop.answer(Reached("anna", first))[0], Learnt)
    (told,) = loop.explain_next()
    assert (type(told), told.person) == (Explained, "anna")


def test_nothing_is_known_any_more_of_who_has_left(setup, rest, targets, people):
    loop = Loop(setup)
    (reach,) = reaches(targets, people, rest, 1)
    for _ in range(2):
        (learnt,) = loop.answer(Reached("body7", reach))
        assert learnt.seen == 1
        assert loop.answer(Left("body7")) == []
    # But of who is kept.
    loop.answer(Reached("anna", reach))
    assert loop.answer(Left("anna")) == []
    assert loop.answer(Reached("anna", reach))[0].seen == 2


def test_asking_never_waits(setup, rest):
    loop = Background(setup)
    try:
        os.kill(loop._process.pid, signal.SIGSTOP)
        begin = time.monotonic()
        for _ in range(2000):
            loop.ask(Rested("anna", rest))
        assert time.monotonic() - begin < 1.0
        assert loop.lost > 0
        assert loop.answers() == []
    finally:
        os.kill(loop._process.pid, signal.SIGKILL)
        loop.close()
    assert not loop.alive


def test_a_process_that_hangs_is_noticed_and_one_with_nothing_to_do_is_not(
    setup, rest, monkeypatch
):
    monkeypatch.setattr(background, "_STALLED_S", 1.0)
    loop = Background(setup)
    try:
        time.sleep(1.2)
        assert not loop.stalled
        loop.ask(Rested("anna", rest))
        wait_for(loop, Expected)
        time.sleep(1.2)
        assert not loop.stalled
        os.kill(loop._process.pid, signal.SIGSTOP)
        loop.ask(Rested("anna", rest))
        assert not loop.stalled
        time.sleep(1.2)
        assert loop.stalled
        os.kill(loop._process.pid, signal.SIGCONT)
        wait_for(loop, Expected)
        assert not loop.stalled
    finally:
        os.kill(loop._process.pid, signal.SIGCONT)
        loop.close()


def test_two_do_not_learn_one_person(setup, rest, targets, people):
    first, second = Inline(setup), Inline(setup)
    one, other = reaches(targets, people, rest, 2)
    first.ask(Reached("anna", one))
    assert isinstance(first.answers()[0], Learnt)
    second.ask(Reached("anna", other))
    # It is learnt here, and that it is not kept is said beside it.
    learnt, trouble, *more = second.answers()
    assert isinstance(learnt, Learnt)
    assert isinstance(trouble, Trouble)
    assert "another predictor's" in trouble.text
    assert not any(isinstance(answer, Learnt) for answer in more), more
    assert PeopleStore(setup.store).people()[0].reaches == {"right near_from_rest": 1}
    # It still predicts, and takes over in a new process once the other has ended.
    second.ask(Rested("anna", rest))
    assert isinstance(second.answers()[0], Expected)
    first.close()
    third = Inline(setup)
    third.ask(Reached("anna", other))
    assert isinstance(third.answers()[0], Learnt)
    assert PeopleStore(setup.store).people()[0].reaches == {"right near_from_rest": 2}
