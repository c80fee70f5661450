"""When something that is said again and again is due."""

from __future__ import annotations

import itertools

from hypothesis import given
from hypothesis import strategies as st

from hri_prediction.beat import Beat

MS = 1_000_000


def test_steps_that_the_period_is_no_multiple_of() -> None:
    beat = Beat(20 * MS)
    due = [ms for ms in range(0, 400, 8) if beat.due(ms * MS)]
    assert len(due) == 20  # every 24, 16, 24, … ms
    assert {after - before for before, after in itertools.pairwise(due)} == {16, 24}


@given(
    period=st.integers(1, 100),
    steps=st.lists(st.one_of(st.integers(0, 40), st.integers(-500, 500)), max_size=60),
)
def test_it_is_never_late_by_a_period_more_than_one_asks_late(
    period: int, steps: list[int]
) -> None:
    beat, now, last = Beat(period), 1000, None
    for step in steps:
        now += step
        if beat.due(now):
            last = now
        else:
            assert last is not None
            # Asked again within a period of what was said, or of when that was due.
            assert now - last < 2 * period


def test_after_a_stall_it_does_not_make_up_for_what_was_missed() -> None:
    beat = Beat(20)
    assert beat.due(1000)
    assert beat.due(1500)
    assert not any(beat.due(now) for now in range(1501, 1520))
    assert beat.due(1520)


def test_a_clock_that_went_back_makes_it_due() -> None:
    beat = Beat(20)
    assert beat.due(1000)
    assert beat.due(500)
    assert not beat.due(510)
