"""Simulated dyads in each case: who does what, and recordings of it."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from hri_prediction.errors import ConfigError
from hri_prediction.ontology.watch import segments_of
from hri_sim.ontology.layouts import POSITIONS
from hri_sim.ontology.sessions import (
    EXPERIMENTER,
    DyadStudy,
    record_session,
    sessions_of,
    setup_of,
    table_of_session,
)
from hri_sim.ontology.sweep import edges_kept

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
    one, other = record_session(session, SHORT)
    apart = np.linalg.norm(one.keypoints[:, 3] - other.keypoints[:, 3], axis=1)
    # Two hands in one place would be in the same centimetre or two.
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
    assert edges_kept(sessions, still) == (1.0, 0.0)
    kept, other = edges_kept(sessions, SHORT)
    assert 0.0 < kept < 1.0
    assert kept + other <= 1.0
    wild_kept, _ = edges_kept(sessions, replace(SHORT, layout_jitter=0.15))
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
