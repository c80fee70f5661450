"""What is made of messages that were heard live."""

from __future__ import annotations

import math
from dataclasses import replace

from hri_sim.ontology.live import Heard, figures_of, live_lines, live_summary, settled

MS = 1_000_000


def told(
    at_ms: int,
    number: int,
    *,
    first: str = "a",
    end_ms: int = 0,
    newest_ms: int = 1195,
    until_ms: int = 1000,
    group: int = 3,
) -> Heard:
    """Of a movement that began after 0.1 s; of one that is over where an end is given."""
    return Heard(
        at_ms * MS,
        end_ms > 0,
        first,
        number,
        group,
        100 * MS,
        end_ms * MS,
        newest_ms * MS,
        (end_ms or until_ms) * MS,
        meant=3,
    )


def test_times_count_from_the_end_of_the_movement() -> None:
    heard = [
        told(990, 3, newest_ms=985),  # before the end
        told(1005, 3, newest_ms=998),  # after it, but of samples before it
        told(1010, 7, first="b"),  # somebody else's
        told(1030, 2),
        told(1070, 3),
        told(1200, 3, end_ms=1000),
    ]
    found = figures_of(heard)
    assert found.movements == 1
    assert found.case_ms == (30.0,)
    assert found.known_ms == (70.0,)
    assert found.complete_ms == (200.0,)
    assert found.computed_ms == (5.0,)
    assert found.same == 0.0
    assert (found.right, found.class_right) == (1.0, 1.0)
    assert found.lacking_ms == (0.0,)
    text = "\n".join(live_lines(live_summary(found)))
    assert "1 movements" in text
    assert "not all of both arms" not in text
    assert "| 30.0 | 30.0 | 30.0 |" in text
    assert "of 100.0 % of them, met" in text


def test_a_case_that_is_taken_back_is_not_known() -> None:
    heard = [told(1030, 3), told(1040, 2), told(1080, 3), told(1200, 3, end_ms=1000)]
    assert figures_of(heard).known_ms == (80.0,)


def test_what_was_hidden_at_the_end_is_said() -> None:
    """A case is told by what was seen; that it knows nothing of the end is said beside it."""
    whole = [told(1030, 2), told(1200, 3, end_ms=1000)]
    other = [
        replace(each, onset_ns=1500 * MS)
        for each in (
            told(2020, 4, newest_ms=2005, until_ms=1926),
            told(2060, 5, newest_ms=2045, until_ms=2040),
            told(2200, 5, newest_ms=2195, end_ms=2000),
        )
    ]
    found = figures_of([*whole, *other])
    assert found.case_ms == (30.0, 20.0)
    assert found.lacking_ms == (0.0, 74.0)
    text = "\n".join(live_lines(live_summary(found)))
    assert "At the end of 1 of them not all of both arms was seen" in text
    assert "the last 74 ms at most" in text


def test_what_was_never_told_before_counts_from_the_end_message() -> None:
    found = figures_of([told(1200, 3, end_ms=1000)])
    assert found.case_ms == found.known_ms == (200.0,)
    assert found.same == 0.0
    assert "of 0.0 % of them, **missed**" in "\n".join(live_lines(live_summary(found)))


def test_a_monitor_that_is_always_wrong_is_not_right() -> None:
    """However soon it says what it says in the end."""
    found = figures_of([told(1010, 2, newest_ms=1005), told(1200, 2, end_ms=1000, group=2)])
    assert found.same == 1.0
    assert (found.right, found.class_right) == (0.0, 0.0)
    assert "in for 0 % of them" in "\n".join(live_lines(live_summary(found)))


def test_the_class_is_the_one_that_was_told() -> None:
    """It gathers the probabilities of its cases: the likeliest case need not be one of them."""
    found = figures_of([told(1200, 2, end_ms=1000, group=3), told(1300, 3, end_ms=1000, group=6)])
    assert (found.right, found.class_right) == (0.5, 0.5)
    other = figures_of([told(1200, 2, end_ms=1000, group=3)])
    assert (other.right, other.class_right) == (0.0, 1.0)


def test_movements_that_were_refused_are_counted() -> None:
    refused = replace(told(1300, 0, end_ms=1250, group=0), complete=False, onset_ns=1200 * MS)
    found = figures_of([told(1200, 3, end_ms=1000), refused])
    assert (found.movements, found.refused) == (1, 1)
    assert "refused, with a reason: 1." in "\n".join(live_lines(live_summary(found)))
    none = live_summary(figures_of([refused]))
    assert none == {"movements": 0, "refused": 1}
    assert "Of no movement a case was told; 1 were refused" in "\n".join(live_lines(none))


def test_nothing_heard() -> None:
    found = figures_of([])
    assert found.movements == 0
    assert math.isnan(found.same)
    assert "Of no movement a case was told." in "\n".join(live_lines(live_summary(found)))


def test_movements_that_began_before_the_first_was_over_do_not_count() -> None:
    """Of the other one's, which was under way then, what was told before is not forgotten alone."""
    early = told(900, 3, first="b"), told(1000, 3, end_ms=800), told(1050, 3, first="b", end_ms=950)
    assert settled(early) == []
    later = [
        replace(each, onset_ns=1100 * MS) for each in (told(1200, 4), told(1300, 4, end_ms=1150))
    ]
    assert settled([*early, *later]) == later
    assert settled([]) == settled([told(900, 3)]) == []
