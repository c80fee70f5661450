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
from hri_prediction.hybrid.person import HybridPerson, Rest, SeenReach
from hri_prediction.hybrid.store import PeopleStore
from hri_prediction.hybrid.task import TaskKey
from hri_prediction.hybrid.watch import ArmWatch
from hri_prediction.hybrid.weight_file import save_process
from hri_prediction.prediction.config import PredictorConfig
from hri_prediction.prediction.predictor import ReachPredictor
from hri_prediction.tracks.track import ArmSample

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


def samples_of(rest, way, side="right"):
    """An arm that rests, goes along a way (P, 6) from the shoulder within 0.8 s, and rests."""
    shoulder = rest.points[0]
    phases = np.concatenate([np.zeros(100), np.linspace(0.0, 1.0, 200), np.ones(100)])
    rise = phases**3 * (10.0 - 15.0 * phases + 6.0 * phases**2)
    for number, share in enumerate(rise):
        points = np.zeros((4, 3))
        elbow_wrist = np.array(
            [np.interp(share, np.linspace(0.0, 1.0, len(way)), column) for column in way.T]
        ).reshape(2, 3)
        points[1:3] = elbow_wrist
        forearm = elbow_wrist[1] - elbow_wrist[0]
        points[3] = elbow_wrist[1] + 0.09 * forearm / np.linalg.norm(forearm)
        yield ArmSample(4_000_000 * (number + 1), points + shoulder, np.ones(4, dtype=bool), side)


def test_a_watch_sees_rest_and_reaches(targets, people, rest):
    person = HybridPerson(targets, people)
    person.at_rest(rest)
    way = person.tasks[KEY].path.values
    watch = ArmWatch("right", targets, PredictorConfig(), HybridConfig())
    predictor = ReachPredictor()
    found = []
    for sample in samples_of(rest, way):
        predictor.observe(sample)
        watch.observe(sample, predictor)
        found += watch.questions()
    kinds = [type(each) for each in found]
    assert kinds == [Rest, SeenReach, Rest]
    reach = found[1]
    assert watch.unusable == 0
    assert 0.5 < reach.duration_s < 0.8
    np.testing.assert_allclose(reach.values[0], way[0], atol=0.01)
    np.testing.assert_allclose(reach.values[-1], way[-1], atol=0.01)
    assert found[0].body.arm.upper_m == pytest.approx(rest.body.arm.upper_m, abs=0.002)
    # And the loop takes both.
    assert person.reached(reach) == KEY


@pytest.mark.parametrize(
    ("hidden", "usable"),
    [(range(200, 220), True), (range(200, 240), False), (range(240, 400), False)],
)
def test_a_reach_of_which_too_little_is_seen_is_not_learnt(targets, people, rest, hidden, usable):
    """An elbow behind something: 80 ms are made up for, not 160, nor the end of the reach."""
    person = HybridPerson(targets, people)
    person.at_rest(rest)
    watch = ArmWatch("right", targets, PredictorConfig(), HybridConfig())
    predictor, found = ReachPredictor(), []
    for number, sample in enumerate(samples_of(rest, person.tasks[KEY].path.values)):
        valid = np.array([True, number not in hidden, True, True])
        seen = replace(sample, valid=valid)
        predictor.observe(seen)
        watch.observe(seen, predictor)
        found += watch.questions()
    assert any(isinstance(each, SeenReach) for each in found) == usable
    assert watch.unusable == (not usable)


def test_late_and_repeated_samples_do_no_harm(targets, people, rest):
    person = HybridPerson(targets, people)
    person.at_rest(rest)
    way = person.tasks[KEY].path.values
    watch = ArmWatch("right", targets, PredictorConfig(), HybridConfig())
    predictor = ReachPredictor()
    found, before = [], None
    for number, sample in enumerate(samples_of(rest, way)):
        for each in (sample, before) if number % 40 == 39 else (sample,):
            predictor.observe(each)
            watch.observe(each, predictor)
            found += watch.questions()
        before = sample
    assert [type(each) for each in found] == [Rest, SeenReach, Rest]


def test_only_reaches_from_rest_are_learnt(targets, people, rest):
    """There and back again without a rest: the second part begins in mid-air."""
    person = HybridPerson(targets, people)
    person.at_rest(rest)
    way = person.tasks[KEY].path.values
    there = list(samples_of(rest, way))[:250]
    back = there[100:][::-1] + there[:100]
    watch = ArmWatch("right", targets, PredictorConfig(), HybridConfig())
    predictor = ReachPredictor()
    found = []
    for number, sample in enumerate([*there, *back]):
        stamped = ArmSample(4_000_000 * (number + 1), sample.keypoints, sample.valid, "right")
        predictor.observe(stamped)
        watch.observe(stamped, predictor)
        found += watch.questions()
    assert not any(isinstance(each, SeenReach) for each in found)


def test_a_predictor_takes_a_library_between_reaches_only(targets, people, rest):
    person = HybridPerson(targets, people)
    library = person.at_rest(rest)
    way = person.tasks[KEY].path.values
    predictor = ReachPredictor()
    taken = []
    for sample in samples_of(rest, way):
        predictor.observe(sample)
        taken.append(predictor.expect(library))
    assert taken[0]
    assert not all(taken)
    assert taken[-1]
    # Known from the start, the reach is recognised on the way.
    predictor = ReachPredictor()
    likeliest = ""
    for number, sample in enumerate(samples_of(rest, way)):
        predictor.observe(sample)
        if number == 0:
            predictor.expect(library)
        if number == 220:
            prediction = predictor.predict()
            likeliest = prediction.task_names[int(np.argmax(prediction.task_probabilities))]
    assert likeliest == "near_from_rest"
