"""What a recorder says is wrong, and gaps in publishers' numbers."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hri_sim.recording.condition import BEHIND_S, named, troubles
from hri_sim.recording.recorder_core import RecorderState
from hri_sim.recording.sequence import SequenceGaps

WELL = RecorderState(
    received=1000,
    written=900,
    dropped=0,
    lost=0,
    queued=100,
    queued_bytes=6400,
    received_bytes=64_000,
    file_bytes=50_000,
    error="",
    most_queued=120,
    queue_share=0.2,
    behind_s=0.1,
)


def kinds(state: RecorderState, **found: dict) -> list[tuple[str, bool]]:
    counts = {"dropped": {}, "transport": {}, "unknown": {}, **found}
    return [(trouble.kind, trouble.serious) for trouble in troubles(state, **counts)]


def test_a_recorder_that_keeps_up_has_no_troubles() -> None:
    assert kinds(WELL) == []
    assert kinds(replace(WELL, behind_s=BEHIND_S, queue_share=0.49)) == []


def test_each_trouble_by_itself_and_the_worst_first() -> None:
    assert kinds(replace(WELL, error="disk full")) == [("disk", True)]
    assert kinds(replace(WELL, behind_s=1.5)) == [("behind", False)]
    assert kinds(replace(WELL, queue_share=0.5)) == [("behind", False)]
    assert kinds(WELL, dropped={"/a": 3}) == [("queue", True)]
    assert kinds(WELL, transport={"/a": 3}) == [("transport", False)]
    assert kinds(WELL, unknown={"/x": "a/msg/B"}) == [("types", False)]
    # One that does not write is behind, too: that need not be said.
    everything = replace(WELL, error="disk full", behind_s=9.0, queue_share=1.0)
    assert kinds(everything, dropped={"/a": 1}, transport={"/a": 1}) == [
        ("disk", True),
        ("queue", True),
        ("transport", False),
    ]


def test_troubles_name_what_they_cost() -> None:
    (trouble,) = troubles(WELL, {"/b": 5, "/a": 7}, {}, {})
    assert trouble.text == "12 messages dropped: the queue was full (/a 7, /b 5)"
    (trouble,) = troubles(replace(WELL, behind_s=2.34), {}, {}, {})
    assert trouble.text == (
        "behind: the disk has taken nothing for 2.3 s; 100 messages wait, the queue is 20 % full"
    )
    (trouble,) = troubles(replace(WELL, error="No space left on device"), {}, {}, {})
    assert "not writing: No space left on device; 100 messages wait" in trouble.text
    (trouble,) = troubles(WELL, {}, {}, {"/x": "a/msg/B", "/y": "a/msg/B"})
    assert trouble.text == "2 topics of unknown types are not recorded: /x, /y"


def test_many_topics_are_summed_up() -> None:
    counts = {f"/t{number}": number for number in range(1, 8)}
    assert named(counts) == "/t7 7, /t6 6, /t5 5, 10 on 4 more topics"
    assert named({}) == ""


# ------------------------------------------------------------------ numbers
@given(missing=st.sets(st.integers(2, 49)))
def test_the_gaps_of_one_publisher_are_counted(missing: set[int]) -> None:
    gaps = SequenceGaps()
    for number in range(1, 51):
        if number not in missing:
            gaps.take(number)
        gaps.settle(1)
    assert gaps.lost == len(missing)
    assert not gaps.suspects


def test_what_was_sent_before_the_first_is_not_missing() -> None:
    gaps = SequenceGaps()
    gaps.take(100)
    gaps.take(101)
    assert not gaps.suspects
    gaps.take(1)  # a publisher that was started again
    gaps.take(2)
    assert not gaps.suspects


@pytest.mark.parametrize("before", [1, 2])
def test_numbers_of_two_publishers_say_nothing(before: int) -> None:
    """Also when the graph knows of the second only just now, or of the first no longer."""
    gaps = SequenceGaps(before)
    for number in (50, 1, 51, 2):
        gaps.take(number)
    assert gaps.suspects
    gaps.settle(3 - before)
    assert (gaps.lost, gaps.suspects) == (0, False)


def test_without_numbers_nothing_is_known() -> None:
    gaps = SequenceGaps()
    for number in (0, 5, 0, 6):
        gaps.take(number)
    assert not gaps.suspects
