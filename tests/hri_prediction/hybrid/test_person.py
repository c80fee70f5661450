"""The loop of one person: guess, learn, ask why, and keep what was found."""

from dataclasses import replace

import numpy as np
import pytest
from reaching import reach_of

from hri_prediction.errors import ConfigError, DataError, HriError
from hri_prediction.hybrid.config import HybridConfig
from hri_prediction.hybrid.merging import merged
from hri_prediction.hybrid.person import HybridPerson, Rest, SeenReach
from hri_prediction.hybrid.prior_path import optimal_path
from hri_prediction.hybrid.store import PERSON_FILE, PeopleStore, check_person
from hri_prediction.hybrid.task import TaskKey
from hri_prediction.prediction.config import PredictorConfig
from hri_prediction.prediction.library import TaskLibrary

ASIDE = np.array([0.0, 0.03, 0.02])
NEAR = TaskKey("right", "rest", "near")


def wrist_end(library: TaskLibrary, name: str) -> np.ndarray:
    (task,) = (task for task in library.tasks if task.name == name)
    return task.promp.trajectory_mean([1.0])[0, 3:]


def test_there_is_a_guess_before_anything_was_seen(person, rest, targets):
    library = person.at_rest(rest)
    assert [task.name for task in library.tasks] == ["near_from_rest", "side_from_rest"]
    for task in library.tasks:
        path = person.tasks[TaskKey("right", "rest", task.name.split("_")[0])].path
        np.testing.assert_allclose(task.promp.trajectory_mean(path.phases), path.values, atol=0.004)
        assert task.demonstrations == 0
    # At a target, that one is no reach.
    there = Rest(rest.body, rest.points + (targets["near"] - rest.points[3]))
    assert all("near_from" not in task.name for task in person.at_rest(there).tasks)


def test_reaches_mend_the_guess_and_the_change_settles(person, rest, rng):
    first = wrist_end(person.at_rest(rest), "near_from_rest")
    truth = first + ASIDE
    for _ in range(12):
        assert person.reached(reach_of(person, rest, NEAR, rng, aside=ASIDE)) == NEAR
    library = person.at_rest(rest)
    assert np.linalg.norm(wrist_end(library, "near_from_rest") - truth) < 0.006
    task = person.tasks[NEAR]
    assert task.seen == 12
    assert task.divergences[0] > 0.1 > task.divergences[9]
    assert task.divergences[9] < 0.05
    (model,) = (m for m in library.tasks if m.name == "near_from_rest")
    assert model.duration_mean_s == pytest.approx(0.8, abs=0.03)
    # Other tasks of a person who is fast are expected to be fast too.
    (other,) = (m for m in library.tasks if m.name == "side_from_rest")
    assert other.duration_mean_s < 0.9


def test_deviations_go_along_when_the_person_sits_elsewhere(person, rest, rng):
    person.at_rest(rest)
    for _ in range(6):
        person.reached(reach_of(person, rest, NEAR, rng, aside=ASIDE))
    shift = np.array([0.04, 0.03, 0.0])
    moved = Rest(rest.body, rest.points + shift)
    library = person.at_rest(moved)
    path = person.tasks[NEAR].path
    # The target is where it was in the world: nearer to the shoulder now.
    plain = path.values[-1, 3:]
    assert np.linalg.norm(wrist_end(library, "near_from_rest") - plain - ASIDE) < 0.012


def test_why_is_asked_when_things_have_settled(targets, people, rest, rng):
    person = HybridPerson(targets, people, config=HybridConfig(settled=0.2, settled_reaches=3))
    person.at_rest(rest)
    assert person.to_explain() == []
    for _ in range(8):
        person.reached(reach_of(person, rest, NEAR, rng, aside=0.3 * ASIDE, duration_s=1.0))
    assert person.to_explain() == [NEAR]
    before = person.weights.guess(person.tasks[NEAR].path.q_start, person.tasks[NEAR].path.q_end)
    found = person.explain(NEAR)
    assert found.after_m <= found.before_m + 1e-6
    assert found.alpha.sum() == pytest.approx(1.0)
    assert len(person.weights.own) == 1
    after = person.weights.guess(person.tasks[NEAR].path.q_start, person.tasks[NEAR].path.q_end)
    assert (after.logs_sd <= before.logs_sd).all()
    assert person.to_explain() == []  # not again before twice as much was seen


@pytest.mark.parametrize("whole_s", [0.5, 0.8, 1.2, 1.73])
def test_a_whole_reach_takes_as_long_as_it_does(targets, people, rest, rng, whole_s):
    """However long was expected before: what explains a path depends on it."""
    person = HybridPerson(targets, people, config=HybridConfig(settled=0.2, settled_reaches=3))
    person.at_rest(rest)
    task = person.tasks[NEAR]
    onset = person.rules.predictor.onset_speed
    true = optimal_path(rest.body, task.geometry, whole_s, task.alpha, person.weights.names, onset)
    for _ in range(8):
        person.reached(
            SeenReach(
                rest.body,
                true.phases,
                true.values + rng.normal(0.0, 0.001, 6),
                rest.points[0],
                rest.points[3],
                person.targets["near"] + 0.01,
                true.share * whole_s,
            )
        )
    found = person.explain(NEAR)
    # What was usual before counts for a little among eight reaches.
    assert found.duration_s == pytest.approx(whole_s, rel=0.02)
    expected = person.rules.model(person.tasks[NEAR], *person.usual_duration(NEAR))
    assert found.duration_s == pytest.approx(expected.duration_mean_s / true.share, rel=0.006)


def test_what_is_no_reach_of_a_target_is_said(person, rest, rng):
    person.at_rest(rest)
    reach = reach_of(person, rest, NEAR, rng, aside=ASIDE)
    with pytest.raises(DataError, match="nearest target"):
        person.reached(replace(reach, end_tip=reach.end_tip + 0.5))
    with pytest.raises(DataError, match="ended there"):
        person.reached(replace(reach, start_tip=reach.end_tip))
    with pytest.raises(DataError, match="without elbow and wrist"):
        person.reached(replace(reach, values=np.full_like(reach.values, np.nan)))


def test_targets_that_cannot_be_reached_are_named(targets, people, rest):
    far = {**targets, "moon": np.array([-3.0, 0.0, 0.0])}
    person = HybridPerson(far, people)
    assert len(person.at_rest(rest).tasks) == 2
    assert "no nearer than" in person.remarks["moon"]
    with pytest.raises(DataError, match="no target can be reached"):
        HybridPerson({"moon": far["moon"]}, people).at_rest(rest)
    with pytest.raises(DataError, match="no targets"):
        HybridPerson({}, people)


def test_a_person_survives_a_restart(person, rest, rng, targets, people, tmp_path):
    person.at_rest(rest)
    for _ in range(6):
        person.reached(reach_of(person, rest, NEAR, rng, aside=ASIDE))
    found = person.explain(NEAR)
    store = PeopleStore(tmp_path / "people")
    store.save("anna", person.tasks.values(), person.weights.own)
    tasks, own = store.load("anna")
    again = HybridPerson(targets, people, tasks=tasks, own=own)
    np.testing.assert_allclose(again.weights.own.logs, found.data.logs, rtol=1e-4)
    for name in ("near_from_rest", "side_from_rest"):
        np.testing.assert_allclose(
            wrist_end(again.at_rest(rest), name), wrist_end(person.at_rest(rest), name), atol=0.003
        )
    assert again.tasks[NEAR].divergences == person.tasks[NEAR].divergences
    # Of a file whose weights have other scale factors reaches are known, and weights learnt anew.
    path = tmp_path / "people" / "anna" / PERSON_FILE
    path.write_text(path.read_text().replace("hri-person-2", "hri-person-1"))
    tasks, own = store.load("anna")
    assert own is None
    assert {task.key for task in tasks} == set(person.tasks)


def test_what_was_learnt_with_other_settings_is_refused(
    person, rest, rng, targets, people, tmp_path
):
    """Numbers that fit in number would mean something else."""
    person.at_rest(rest)
    person.reached(reach_of(person, rest, NEAR, rng, aside=ASIDE))
    store = PeopleStore(tmp_path)
    store.save("anna", [person.tasks[NEAR]], person.weights.own)
    tasks, own = store.load("anna")
    assert tasks[0].settings == person.rules.settings
    HybridPerson(targets, people, tasks=tasks, own=own)
    other = replace(PredictorConfig(), onset_speed=0.05)
    with pytest.raises(DataError, match=r"was learnt with onset_speed 0\.\d+ instead of 0\.05"):
        HybridPerson(targets, people, other, tasks=tasks, own=own)
    turned = replace(tasks[0].settings, costs=tasks[0].settings.costs[::-1])
    with pytest.raises(DataError, match="learnt with costs"):
        HybridPerson(targets, people, tasks=[replace(tasks[0], settings=turned)])
    # Files of before do not say: those that fit in number are taken.
    HybridPerson(targets, people, other, tasks=[replace(tasks[0], settings=None)])


def test_people_are_listed_moved_and_forgotten(person, rest, rng, tmp_path):
    person.at_rest(rest)
    person.reached(reach_of(person, rest, NEAR, rng, aside=ASIDE))
    store = PeopleStore(tmp_path)
    assert store.people() == []
    assert store.load("anna") == ([], None)
    store.save("anna", [person.tasks[NEAR]], person.weights.own)
    (known,) = store.people()
    assert (known.name, known.reaches, known.weights) == ("anna", {"right near_from_rest": 1}, 0)
    store.move("anna", "berta")
    assert store.names() == ["berta"]
    with pytest.raises(ConfigError, match="berta"):
        store.delete("anna")
    store.save("anna", [], person.weights.own)
    with pytest.raises(ConfigError, match="there already"):
        store.move("anna", "berta")
    store.delete("berta")
    assert store.names() == ["anna"]
    assert [path.name for path in tmp_path.iterdir()] == ["anna"]


@pytest.mark.parametrize("name", ["", "..", "a/b", "-a", "x" * 65, ".hidden"])
def test_names_that_are_no_folders_are_refused(name):
    with pytest.raises(ConfigError, match="letters, digits"):
        check_person(name)


def test_damaged_people_are_named_and_not_lost(person, rest, rng, tmp_path):
    person.at_rest(rest)
    person.reached(reach_of(person, rest, NEAR, rng, aside=ASIDE))
    store = PeopleStore(tmp_path)
    store.save("anna", [person.tasks[NEAR]], person.weights.own)
    file = tmp_path / "anna" / NEAR.file
    whole = file.read_bytes()
    file.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(DataError, match=NEAR.file):
        store.load("anna")
    (known,) = store.people()
    assert NEAR.file in known.problem
    file.write_bytes(whole)
    (tmp_path / "anna" / PERSON_FILE).write_text("[]")
    with pytest.raises(DataError, match="is no person"):
        store.load("anna")
    (tmp_path / "file").write_text("")
    with pytest.raises(ConfigError, match="is a file"):
        PeopleStore(tmp_path / "file").names()
    with pytest.raises(HriError, match="cannot write"):
        PeopleStore(tmp_path / "file").save("anna", [], person.weights.own)


def test_libraries_of_all_and_of_one_are_merged(person, rest, targets, people):
    own = person.at_rest(rest)
    assert merged(None, own) is own
    common = TaskLibrary((*own.tasks[:1],), 0.3, 0.25)
    both = merged(common, own)
    assert [task.name for task in both.tasks] == [task.name for task in own.tasks]
    assert both.upper_arm_m == own.upper_arm_m
    other = HybridPerson(targets, people, PredictorConfig(weights_per_dim=6)).at_rest(rest)
    with pytest.raises(DataError, match="weights_per_dim"):
        merged(other, own)


def test_what_a_broken_off_write_left_is_no_task(person, rest, rng, tmp_path):
    person.at_rest(rest)
    person.reached(reach_of(person, rest, NEAR, rng, aside=ASIDE))
    store = PeopleStore(tmp_path)
    store.save("anna", [person.tasks[NEAR]], person.weights.own)
    (tmp_path / "anna" / f".{NEAR.file}.part.npz").write_bytes(b"half of i")
    tasks, _ = store.load("anna")
    assert [task.key for task in tasks] == [NEAR]
    # Broken off before the last file was written, the person is there.
    (tmp_path / "anna" / PERSON_FILE).unlink()
    assert store.names() == ["anna"]
    tasks, own = store.load("anna")
    assert len(tasks) == 1
    assert own is None
    store.delete("anna")
    assert store.names() == []


def test_a_task_is_not_expected_of_itself(person, rest, rng):
    person.at_rest(rest)
    before = person.usual_duration()
    person.reached(reach_of(person, rest, NEAR, rng, aside=ASIDE, duration_s=0.5))
    assert person.usual_duration(NEAR) == before
    assert person.usual_duration()[0] < before[0]


@pytest.mark.parametrize("name", ["rest", "a_from_b"])
def test_targets_of_misleading_names_are_refused(name, people):
    with pytest.raises(DataError, match="_from_"):
        HybridPerson({name: np.zeros(3)}, people)
