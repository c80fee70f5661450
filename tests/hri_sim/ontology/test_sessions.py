"""Simulated dyads in each case: who does what, and recordings of it."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
import typer

from hri_prediction.errors import ConfigError
from hri_prediction.ontology.cases import group_of
from hri_prediction.ontology.cutting import segments_of
from hri_sim.dyads.hands import STEP_S
from hri_sim.ontology import evaluation_command, training_command
from hri_sim.ontology.layouts import POSITIONS
from hri_sim.ontology.sessions import (
    EXPERIMENTER,
    SECOND_POSITIONS,
    SHOWN_SEED,
    DyadStudy,
    record_session,
    sessions_of,
    setup_of,
    table_of_session,
)
from hri_sim.ontology.sweep import edges_kept
from hri_sim.tools import simulate_dyads

SHORT = DyadStudy(encounters=3)


def test_both_experiments() -> None:
    sessions = sessions_of(DyadStudy(), 0)
    assert len(sessions) == 10 * 9 + 8 * 17
    cells = Counter((s.case, s.position) for s in sessions)
    assert all(cells[case, position] == 10 for case in (1, 2, 3) for position in POSITIONS)
    for case in range(4, 21):
        assert [cells[case, p] for p in POSITIONS] == [4, 4, 0]
    first = {s.subject for s in sessions if s.case <= 3}
    second = {s.subject for s in sessions if s.case > 3}
    assert (len(first), len(second), len(first & second), len(first | second)) == (10, 8, 6, 12)
    assert EXPERIMENTER not in first | second


@pytest.mark.parametrize("people", range(2, 14))
def test_nobody_does_a_case_twice_in_one_place(people: int) -> None:
    sessions = sessions_of(DyadStudy(people=people), 0)
    done = [(s.case, s.position, s.subject) for s in sessions]
    assert len(set(done)) == len(done)
    assert {s.case for s in sessions} == set(range(1, 21))
    second = Counter(s.subject for s in sessions if s.case > 3)
    assert set(second.values()) == {17}  # each case once
    assert {s.subject for s in sessions} == {f"s{n + 1}" for n in range(people)}


def test_where_people_sit_does_not_tell_the_class() -> None:
    """Within each person and class of the reduced ontology both places are as frequent, or nearly so."""
    found = Counter(
        (s.subject, group_of(s.case), s.position) for s in sessions_of(DyadStudy(), 0) if s.case > 3
    )
    for subject, group, _ in list(found):
        one, other = (found[subject, group, place] for place in SECOND_POSITIONS)
        assert abs(one - other) <= 1


def test_people_who_are_shown_are_neither_learnt_nor_reported() -> None:
    shown, *others = (
        next(p.default for p in typer.main.get_command(command.app).params if p.name == "seed")
        for command in (simulate_dyads, training_command, evaluation_command)
    )
    assert shown == SHOWN_SEED
    assert shown not in others


def test_recordings_are_of_two_people_who_reach() -> None:
    session = next(s for s in sessions_of(SHORT, 3) if s.case == 13)
    one, other = record_session(session, SHORT)
    assert (one.subject, other.subject, one.task) == (session.subject, EXPERIMENTER, "case_13")
    np.testing.assert_array_equal(one.time_s, other.time_s)
    segments = [s for s in segments_of((one, other)) if s.features is not None]
    assert sorted(s.agent for s in segments) == [0, 0, 0, 1, 1, 1]
    again, _ = record_session(session, SHORT)
    np.testing.assert_array_equal(one.keypoints, again.keypoints)


@pytest.mark.parametrize("case", [13, 16, 19, 20])
def test_nobody_comes_to_where_the_other_still_is(case: int) -> None:
    session = next(s for s in sessions_of(SHORT, 0) if s.case == case)
    hands = np.array([track.keypoints[:, 3] for track in record_session(session, SHORT)])
    ways = np.linalg.norm(hands[:, 10:] - hands[:, :-10], axis=-1)
    still = ways.min(axis=0) < 0.1 * 10 * STEP_S
    apart = np.linalg.norm(hands[0] - hands[1], axis=-1)[5:-5]
    # Two hands in one place would be in the same centimetre or two.
    assert apart[still].min() > 0.05
    if (
        case != 20
    ):  # where both come from where the other goes: they pass each other nearer than that
        assert apart.min() > 0.03


def test_jitter_moves_shared_spaces_together() -> None:
    session = next(s for s in sessions_of(SHORT, 0) if s.case == 19)
    still, _ = setup_of(session, replace(SHORT, layout_jitter=0.0, person_jitter=0.0))
    moved, _ = setup_of(session, SHORT)
    assert np.linalg.norm(moved.places - still.places, axis=-1).max() > 0.01
    for setup in (still, moved):
        np.testing.assert_allclose(setup.places[0, 0], setup.places[1, 1])
        np.testing.assert_allclose(setup.places[0, 1], setup.places[1, 0])


def test_without_jitter_all_sessions_have_the_edges_of_their_case() -> None:
    sessions = sessions_of(SHORT, 0)
    still = replace(SHORT, layout_jitter=0.0, person_jitter=0.0)
    assert edges_kept(sessions, still) == (1.0, 0.0, dict.fromkeys(range(1, 21), 1.0))
    kept, other, by_case = edges_kept(sessions, SHORT)
    assert 0.0 < kept < 1.0
    assert kept + other <= 1.0
    assert min(by_case.values()) < kept < max(by_case.values())
    wild_kept, *_ = edges_kept(sessions, replace(SHORT, layout_jitter=0.15))
    assert wild_kept < kept


def test_people_are_themselves_in_every_session() -> None:
    sessions = [s for s in sessions_of(SHORT, 0) if s.subject == "s1" and s.position == "frontal"][
        :3
    ]
    setups = [setup_of(session, SHORT) for session in sessions]
    assert len({factors for _, (factors, _) in setups}) == 1
    seats = {tuple(np.round(setup.shoulders[0], 12)) for setup, _ in setups}
    assert len(seats) == 1


def test_segments_carry_what_they_are_of() -> None:
    session = sessions_of(SHORT, 0)[4]
    table = table_of_session(session, SHORT)
    assert len(table) == 6
    assert set(table.case.tolist()) == {session.case}
    assert set(table.session.tolist()) == {4}
    assert table.subjects == [session.subject]


def test_settings_out_of_range_are_refused() -> None:
    with pytest.raises(ConfigError, match="layout_jitter"):
        DyadStudy(layout_jitter=-0.1)
