"""Recordings of two people as training data."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from recorded_dyad import RecordedDyad, record_dyad

from hri_planner.rnn.encounters import Encounter
from hri_prediction.errors import DataError
from hri_prediction.tracks.files import save_tracks
from hri_prediction.tracks.track import ArmTrack
from hri_sim.policies.recordings import (
    Recorded,
    load_encounters,
    recorded_set,
    recording_hash,
)

ENCOUNTERS = 4


@pytest.fixture(scope="module")
def dyad() -> RecordedDyad:
    return record_dyad(0, ENCOUNTERS)


@pytest.fixture
def file(dyad: RecordedDyad, tmp_path: Path) -> Path:
    save_tracks(tmp_path / "dyad.npz", dyad.tracks())
    return tmp_path / "dyad.npz"


def changed(file: Path, tracks: list[ArmTrack]) -> Path:
    save_tracks(file, tracks)
    return file


def test_each_reach_of_either_is_an_encounter(dyad: RecordedDyad, file: Path) -> None:
    found = load_encounters(file)
    assert len(found) == 2 * ENCOUNTERS
    assert [one.group for one in found[::2]] == [one.group for one in found[1::2]]
    assert len({one.group for one in found}) == ENCOUNTERS
    meant = dyad.goals.reshape(-1, 3)
    errors = []
    for one in found:
        encounter = one.encounter
        assert (encounter.pair, encounter.setup, encounter.backward) == (
            "ann and bob",
            "table",
            False,
        )
        from_goals = np.linalg.norm(meant - encounter.goal, axis=1)
        errors.append(from_goals.min())
        row, person = divmod(int(from_goals.argmin()), 2)
        truly = dyad.rests[row + 1, person]
        assert np.linalg.norm(encounter.goal - truly) < 0.005
        assert np.linalg.norm(encounter.hand[0] - dyad.rests[row, person]) < 0.005
        other = dyad.rests[row : row + 2, 1 - person]
        assert np.linalg.norm(encounter.partner[0] - other, axis=1).min() < 0.3
        assert np.linalg.norm(encounter.hand[1] - encounter.hand[0]) < 0.002
        np.testing.assert_array_equal(encounter.goal, encounter.hand[-1])
    assert np.median(errors) < 0.004
    assert max(errors) < 0.010


def test_one_person_can_be_chosen(file: Path) -> None:
    both, ann, bob = (load_encounters(file, name) for name in ("", "ann", "bob"))
    assert len(ann) == len(bob) == ENCOUNTERS
    hands = {one.encounter.hand.tobytes() for one in (*ann, *bob)}
    assert hands == {one.encounter.hand.tobytes() for one in both}
    with pytest.raises(DataError, match="nobody is called 'eve'; expected one of ann, bob"):
        load_encounters(file, "eve")


def test_the_learners_own_turn_of_the_body_stays(dyad: RecordedDyad, file: Path) -> None:
    """Hands of an encounter are those of the recording at the same time."""
    one = load_encounters(file, "ann")[1].encounter
    (track, other) = dyad.tracks()
    row = int(np.nanargmin(np.linalg.norm(track.keypoints[:, 3] - one.hand[10], axis=1)))
    assert np.linalg.norm(other.keypoints[row, 3] - one.partner[10]) < 0.02


def test_files_of_a_folder_belong_together(dyad: RecordedDyad, file: Path, tmp_path: Path) -> None:
    folder = tmp_path / "session"
    folder.mkdir()
    for track in dyad.tracks():
        save_tracks(folder / f"{track.subject}.csv", [track])
    found, whole = load_encounters(folder), load_encounters(file)
    assert len(found) == len(whole)
    # A .csv keeps micrometres.
    np.testing.assert_allclose(found[0].encounter.hand, whole[0].encounter.hand, atol=1e-4)
    (tmp_path / "empty").mkdir()
    with pytest.raises(DataError, match="neither a bag nor track files"):
        load_encounters(tmp_path / "empty")


def test_gaps_are_filled_when_short_and_else_left_out(dyad: RecordedDyad, file: Path) -> None:
    whole = load_encounters(file, "ann")
    own, other = dyad.tracks()
    middle = int(
        np.nanargmin(np.linalg.norm(own.keypoints[:, 3] - whole[0].encounter.hand[12], axis=1))
    )
    short, long = own.keypoints.copy(), own.keypoints.copy()
    short[middle : middle + 15] = np.nan
    long[middle : middle + 60] = np.nan
    for points, expected in ((short, ENCOUNTERS), (long, ENCOUNTERS - 1)):
        tracks = [dataclasses.replace(own, keypoints=points), other]
        assert len(load_encounters(changed(file, tracks), "ann")) == expected
    # The partner's is held where it was seen last.
    hidden = other.keypoints.copy()
    hidden[middle:] = np.nan
    found = load_encounters(
        changed(file, [own, dataclasses.replace(other, keypoints=hidden)]), "ann"
    )
    np.testing.assert_allclose(np.ptp(found[0].encounter.partner[-5:], axis=0), 0.0, atol=1e-3)


def test_what_cannot_be_used_is_said(dyad: RecordedDyad, file: Path, tmp_path: Path) -> None:
    own, other = dyad.tracks()
    with pytest.raises(DataError, match=r"each trial holds one person only, ann;.*two subjects"):
        load_encounters(changed(file, [own]))
    with pytest.raises(DataError, match=r"trial 0 of table holds one person only: ann, ann"):
        load_encounters(changed(file, [own, own]))
    third = dataclasses.replace(other, subject="eve")
    with pytest.raises(DataError, match="3 people: ann, bob, eve"):
        load_encounters(changed(file, [own, other, third]))
    later = dataclasses.replace(other, time_s=other.time_s + 100.0)
    with pytest.raises(DataError, match=r"ann was recorded from .* s, bob from 100.*same clock"):
        load_encounters(changed(file, [own, later]))
    still = [
        dataclasses.replace(one, keypoints=np.broadcast_to(one.keypoints[:1], one.keypoints.shape))
        for one in (own, other)
    ]
    with pytest.raises(DataError, match="no reaches found"):
        load_encounters(changed(file, still))
    unseen = own.keypoints.copy()
    unseen[:, 3] = np.nan
    with pytest.raises(DataError, match="the hand tip of ann was never seen"):
        load_encounters(changed(file, [dataclasses.replace(own, keypoints=unseen), other]))
    with pytest.raises(DataError, match=r"cannot read .*nothing\.npz"):
        load_encounters(tmp_path / "nothing.npz")


def some(pair: str, group: int) -> Recorded:
    hand = np.linspace((0.0, 0.0, 0.0), (0.3, 0.01 * group, 0.0), 12)
    return Recorded(Encounter(hand, hand + 0.1, hand[-1], pair=pair), f"{pair}, {group}")


def test_whole_pairs_are_kept_for_the_test() -> None:
    found = [some(pair, group // 2) for pair in ("a", "b", "c") for group in range(20)]
    data = recorded_set(found, seed=1)
    (kept,) = {one.pair for one in data.test}
    assert len(data.test) == 20
    assert kept not in {one.pair for one in (*data.learnt, *data.validation)}
    assert len(data.learnt) == 4 * (40 - len(data.validation))
    other = recorded_set(found, seed=2)
    again = recorded_set(found, seed=1)
    assert [one.hand.tobytes() for one in again.learnt] == [
        one.hand.tobytes() for one in data.learnt
    ]
    assert {one.pair for one in other.test} != {kept}


def test_reaches_at_the_same_time_are_kept_together() -> None:
    found = [some("a", group // 2) for group in range(20)]
    data = recorded_set(found, seed=0)
    ends = [{tuple(one.goal) for one in part} for part in (data.validation, data.test)]
    assert len(data.test) == len(data.validation) == 2
    assert len(ends[0]) == len(ends[1]) == 1
    assert len({*ends[0], *ends[1]}) == 2
    with pytest.raises(DataError, match="2 reaches of 1 pairs; expected reaches at three"):
        recorded_set(found[1:3], seed=0)


def test_a_hash_is_of_the_content(file: Path, tmp_path: Path) -> None:
    other = tmp_path / "other.npz"
    other.write_bytes(file.read_bytes())
    assert recording_hash(other) == recording_hash(file)
    other.write_bytes(file.read_bytes()[:-1])
    assert recording_hash(other) != recording_hash(file)
    folder = tmp_path / "folder"
    folder.mkdir()
    (folder / "a.csv").write_text("1")
    before = recording_hash(folder)
    (folder / "b.csv").write_text("2")
    assert recording_hash(folder) != before
