"""Faults are drawn by a seed, from those that were asked for."""

from __future__ import annotations

import numpy as np
import pytest

from hri_prediction.errors import ConfigError
from hri_sim.soak.faults import GROUPS, KILL, PAUSE, PAUSE_S, WORDS, FaultPlan, chosen_kinds

NODES = ("person", "ptomp")


def plan(kinds: tuple[str, ...], seed: int = 0) -> FaultPlan:
    return FaultPlan(np.random.default_rng(seed), kinds, NODES, 10.0)


def test_groups_cover_all_kinds() -> None:
    assert chosen_kinds("all") == tuple(WORDS)
    assert chosen_kinds("none") == ()
    assert sorted(kind for group in GROUPS.values() for kind in group) == sorted(WORDS)
    assert chosen_kinds("goals,kills,goals") == (*GROUPS["goals"], KILL)
    with pytest.raises(ConfigError, match="--faults kills,meteors"):
        chosen_kinds("kills,meteors")


def test_the_same_seed_gives_the_same_faults() -> None:
    first, second, other = plan(chosen_kinds("all")), plan(chosen_kinds("all")), plan(("pause",), 1)
    drawn = [first.next() for _ in range(50)]
    assert drawn == [second.next() for _ in range(50)]
    assert drawn[0] != other.next()


def test_what_is_drawn() -> None:
    own = plan(chosen_kinds("all"))
    drawn = [fault for _ in range(2000) if (fault := own.next())]
    assert {fault.kind for fault in drawn} == set(WORDS)
    for group in GROUPS.values():  # evenly by groups
        assert sum(fault.kind in group for fault in drawn) == 500
    for fault in drawn:
        assert (fault.node in NODES) == (fault.kind in (KILL, PAUSE))
        if fault.kind == PAUSE:
            assert PAUSE_S[0] <= fault.seconds <= PAUSE_S[1]
        assert (fault.seconds == 0.0) == (fault.kind in (KILL, *GROUPS["goals"]))
    assert np.mean([fault.wait_s for fault in drawn]) == pytest.approx(10.0, rel=0.1)


def group_of(kind: str) -> str:
    return next(name for name, kinds in GROUPS.items() if kind in kinds)


def test_each_round_has_all_groups_and_the_first_begins_with_a_kill() -> None:
    rounds = set()
    for seed in range(20):
        own = plan(chosen_kinds("all"), seed)
        groups = [group_of(fault.kind) for _ in range(80) if (fault := own.next())]
        assert groups[0] == "kills"
        for begin in range(0, 80, 4):
            assert sorted(groups[begin : begin + 4]) == sorted(GROUPS)
        rounds.add(tuple(groups[4:8]))
    assert len(rounds) > 5
    without = plan(chosen_kinds("pauses,goals"))
    first = [group_of(fault.kind) for _ in range(2) if (fault := without.next())]
    assert sorted(first) == ["goals", "pauses"]


def test_nobody_is_killed_when_that_is_over() -> None:
    both = plan((KILL, PAUSE))
    assert {fault.kind for _ in range(50) if (fault := both.next(kills=False))} == {PAUSE}
    assert plan((KILL,)).next(kills=False) is None
    assert plan(()).next() is None
