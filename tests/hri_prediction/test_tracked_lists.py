"""Who is tracked, of all that sources say: whose list was changed, and who is dead."""

from __future__ import annotations

import time
from dataclasses import dataclass, field

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hri_prediction.tracked_lists import MOST, TrackedLists

MS = 1_000_000
AGAIN_MS = 40
ALL_LOST = "nothing says any longer who is tracked"


def lost(*ids: str) -> str:
    return f"a source no longer says who is tracked (it listed {', '.join(ids) or 'nobody'})"


@dataclass
class Cell:
    """Sources that say their lists every 40 ms, and who listens; the time in [ms]."""

    lists: TrackedLists = field(default_factory=TrackedLists)
    now: int = 1000
    said: dict[str, tuple[int, tuple[str, ...], int]] = field(default_factory=dict)

    def say(self, source: str, *ids: str, stamp: int | None = None) -> None:
        """From now on a source says this."""
        self.said[source] = (self.now if stamp is None else stamp, ids, self.now)

    def kill(self, source: str) -> tuple[int, tuple[str, ...], int]:
        return self.said.pop(source)

    def run(self, ms: int) -> set[str]:
        """Let time pass; all the troubles of it."""
        found = set()
        for _ in range(ms // 4):
            for name, (stamp, ids, next_ms) in self.said.items():
                if self.now >= next_ms:
                    self.lists.heard(stamp * MS, ids, self.now * MS)
                    self.said[name] = (stamp, ids, self.now + AGAIN_MS)
            found.add(self.lists.trouble(self.now * MS))
            self.now += 4
        return found

    @property
    def ids(self) -> set[str]:
        return set(self.lists.ids or ())


def two() -> Cell:
    cell = Cell()
    cell.say("a", "ann")
    cell.run(200)
    cell.say("b", "bob")
    assert cell.run(500) == {""}
    return cell


def test_nobody_has_said_anything() -> None:
    lists = TrackedLists()
    assert lists.ids is None
    assert lists.trouble(0) == "nothing says who is tracked"
    lists.heard(0, [], 0)
    assert lists.ids == ()
    assert lists.trouble(0) == ""


def test_all_who_are_listed_are_tracked() -> None:
    cell = two()
    assert cell.lists.ids == ("ann", "bob")
    cell.run(10_000)
    assert cell.lists.ids == ("ann", "bob")
    assert not cell.lists.pending


@pytest.mark.parametrize("dies", ["a", "b"])
def test_one_of_two_sources_dies(dies: str) -> None:
    cell = two()
    _, ids, _ = cell.kill(dies)
    assert cell.run(120 - AGAIN_MS) == {""}
    cell.run(AGAIN_MS + 8)
    assert cell.run(20_000) == {lost(*ids)}
    assert cell.ids == {"ann", "bob"}


def test_who_is_on_a_list_that_is_said_is_known_apart() -> None:
    lists = TrackedLists()
    lists.heard(1, ["a", "b"], 0)
    lists.heard(2, ["c"], 0)
    lists.heard(1, ["a", "b"], 1)
    assert lists.said == {"a", "b", "c"}
    for ms in range(40, 400, 40):
        lists.heard(2, ["c"], ms * 1_000_000)
    assert lists.ids == ("a", "b", "c")
    assert lists.said == {"c"}


def test_a_source_of_nobody_that_dies_is_missed_too() -> None:
    cell = two()
    cell.say("b")
    cell.run(500)
    cell.kill("b")
    cell.run(128)
    assert cell.run(400) == {lost()}


def test_the_only_source_dies() -> None:
    cell = Cell()
    cell.say("a", "ann")
    cell.run(200)
    cell.kill("a")
    cell.run(128)
    assert cell.run(5000) == {ALL_LOST}
    assert cell.ids == {"ann"}


@pytest.mark.parametrize("others", [True, False])
@pytest.mark.parametrize("stamped", [True, False])
def test_a_list_that_changes_takes_the_old_one_away(stamped: bool, others: bool) -> None:
    cell = two()
    if not others:
        cell = Cell()
        cell.say("a", "ann")
        cell.run(500)
    elif not stamped:
        cell.say("b", "bob", stamp=0)
        cell.run(500)
    cell.say("a", "eve", stamp=None if stamped else 0)
    assert cell.run(64 + AGAIN_MS) == {""}
    assert cell.ids == ({"eve", "bob"} if others else {"eve"})
    assert cell.run(5000) == {""}


def test_a_list_may_change_as_often_as_it_likes() -> None:
    cell = two()
    for number in range(200):
        cell.say("a", f"p{number % 7}")
        assert cell.run(4 * (1 + number % 30)) == {""}
    assert cell.run(200) == {""}
    assert cell.ids == {f"p{199 % 7}", "bob"}


@pytest.mark.parametrize("after", [0, 60, 250, 5000])
@pytest.mark.parametrize("which", ["a", "b"])
def test_a_source_that_was_started_again_makes_all_well(which: str, after: int) -> None:
    cell = two()
    _, ids, _ = cell.kill(which)
    cell.run(after)
    cell.say(which, *ids)
    cell.run(4)
    assert cell.run(3000) == {""}
    assert cell.ids == {"ann", "bob"}


def test_one_that_hung_is_heard_beside_the_one_that_took_its_place() -> None:
    cell = two()
    hung = cell.kill("a")
    assert lost("ann") in cell.run(500)
    cell.say("again", "ann", "eve")
    cell.run(4)
    assert cell.run(500) == {""}
    cell.said["a"] = hung
    assert cell.run(1000) == {""}
    assert cell.ids == {"ann", "eve", "bob"}
    cell.kill("a")
    cell.run(128)
    assert cell.run(500) == {lost("ann")}


def test_both_die_and_come_back_one_by_one() -> None:
    cell = two()
    cell.kill("a")
    cell.kill("b")
    cell.run(128)
    assert cell.run(500) == {ALL_LOST}
    cell.say("a", "ann")
    cell.run(4)
    assert cell.run(500) == {lost("bob")}
    cell.say("b", "bob")
    cell.run(4)
    assert cell.run(500) == {""}


def test_without_stamps_two_sources_are_two() -> None:
    cell = Cell()
    cell.say("a", "ann", stamp=0)
    cell.say("b", "bob", stamp=0)
    assert cell.run(2000) == {""}
    cell.kill("a")
    cell.run(128)
    assert cell.run(500) == {lost("ann")}


def test_a_source_that_stamps_each_list_anew_does_not_hide_the_death_of_another() -> None:
    cell = two()
    for _ in range(50):
        cell.say("a", "ann")
        assert cell.run(20) == {""}
    cell.kill("b")
    for _ in range(10):
        cell.say("a", "ann")
        cell.run(20)
    cell.say("a", "ann")
    assert cell.run(20) == {lost("bob")}


@pytest.mark.parametrize("by", [-3_600_000, -50, 50, 3_600_000])
def test_a_clock_that_steps(by: int) -> None:
    cell = two()
    cell.now += by
    for name, (stamp, ids, _) in list(cell.said.items()):
        cell.said[name] = (stamp, ids, cell.now)
    cell.run(4)
    assert cell.run(1000) == {""}
    cell.kill("b")
    cell.now -= 1000
    cell.said["a"] = (*cell.said["a"][:2], cell.now)
    cell.run(128)
    assert cell.run(500) == {lost("bob")}


def test_who_was_held_up_misses_nobody() -> None:
    cell = two()
    cell.now += 700
    assert cell.run(500) == {""}
    assert cell.ids == {"ann", "bob"}


def test_lists_that_are_said_once_are_enough_where_nobody_asks_for_their_age() -> None:
    lists = TrackedLists()
    for number, ids in enumerate((["ann"], ["bob"], [], ["eve", "eve"])):
        lists.heard(0, ids, 1000 * number * MS)
        assert lists.ids == tuple(dict.fromkeys(ids))


def test_a_flood_of_lists_costs_little_and_is_spoken_of() -> None:
    lists = TrackedLists()
    begin = time.perf_counter()
    for number in range(20_000):
        lists.heard(number, [f"p{number}"], 1000 * MS + number * MS // 20)
    assert time.perf_counter() - begin < 20.0
    now_ns = 2000 * MS
    assert lists.trouble(now_ns) == f"more than {MOST} lists at a time say who is tracked"
    assert len(lists.ids or ()) <= MOST
    for ms in range(2000, 3000, 20):
        lists.heard(7, ["ann"], ms * MS)
    assert len(lists.ids or ()) <= MOST


IDS = st.lists(st.sampled_from(["ann", "bob", "eve"]), unique=True)
SAID = st.lists(st.tuples(st.sampled_from("abc"), IDS, st.integers(1, 60)), min_size=1, max_size=25)


def listed(cell: Cell) -> set[str]:
    return {body for _, ids, _ in cell.said.values() for body in ids}


@given(SAID)
def test_nobody_who_is_listed_is_left_out_and_nobody_else_stays(
    steps: list[tuple[str, list[str], int]],
) -> None:
    cell = Cell()
    for source, ids, wait in steps:
        cell.say(source, *ids)
        for _ in range(wait):
            assert cell.run(4) == {""}
            assert cell.ids >= listed(cell)
    assert cell.run(260) == {""}
    assert cell.ids == listed(cell)
    assert not cell.lists.pending


@given(SAID, st.sets(st.sampled_from("abc"), min_size=1))
def test_every_death_is_noticed_until_all_are_there_again(
    steps: list[tuple[str, list[str], int]], dead: set[str]
) -> None:
    cell = Cell()
    for source, ids, wait in steps:
        cell.say(source, *ids)
        cell.run(4 * wait)
    cell.run(260)
    before = cell.ids
    killed = {source: cell.kill(source)[1] for source in sorted(dead & set(cell.said))}
    cell.run(128)
    for source, ids in killed.items():
        assert "" not in cell.run(200)
        assert cell.ids == before
        cell.say(source, *ids)
        cell.run(4)
    assert cell.run(260) == {""}
    assert cell.ids == before
