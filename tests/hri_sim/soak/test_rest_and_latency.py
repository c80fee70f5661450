"""Times to rest, and latencies, from messages as they come."""

from __future__ import annotations

import pytest

from hri_sim.soak.latency import KEPT, LatencyMatch
from hri_sim.soak.rest import RestWatch

MS = 1_000_000


def test_rest_is_from_when_on_the_robot_stays_still() -> None:
    watch = RestWatch(1000 * MS, moving=True)
    for at in range(1000, 1400, 4):
        passing = 1060 <= at < 1080  # through zero speed, but not at rest
        still = passing or at >= 1152
        watch.hear(at * MS, 0.0 if still else 0.5)
        if at < 1190:
            assert watch.rest_ms is None
            assert not watch.over(at * MS)
    assert watch.rest_ms == pytest.approx(152.0)
    assert watch.over(1400 * MS)


def test_rest_that_does_not_come_and_rest_that_was_there() -> None:
    watch = RestWatch(0, moving=True)
    for at in range(4, 3000, 4):
        watch.hear(at * MS, 0.5 if at < 2100 else 0.0)
    assert watch.rest_ms is None
    assert watch.over(2001 * MS)
    assert RestWatch(0, moving=False).rest_ms == 0.0


def test_latencies_are_found_in_whatever_order_messages_come() -> None:
    match = LatencyMatch(8.0)
    match.trajectory(100 * MS, 90 * MS)
    match.planned(100 * MS, 40 * MS)
    match.planned(136 * MS, 80 * MS)
    match.planned(136 * MS, 80 * MS)  # said again
    match.trajectory(136 * MS, 126 * MS)
    match.trajectory(0, 200 * MS)  # a stop
    match.planned(172 * MS, 0)  # of nobody
    assert match.take() == [pytest.approx(42.0), pytest.approx(38.0)]
    assert match.take() == []


def test_what_finds_no_partner_is_not_kept_for_ever() -> None:
    match = LatencyMatch(0.0)
    for number in range(1, 10 * KEPT):
        match.trajectory(number, number)
    assert len(match._heard) == KEPT
