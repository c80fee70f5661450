"""Reaches of a soak: all ways between the places, each chosen where the hand is."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from hri_sim.scenario.schema import Scenario
from hri_sim.soak.ways import HOME, TOUR, Walk, soak_scenario


@pytest.fixture(scope="module")
def scenario() -> Scenario:
    return soak_scenario(0)


def test_every_way_is_there_once(scenario: Scenario) -> None:
    ways = list(itertools.pairwise(TOUR))
    assert len(set(ways)) == len(ways) == 6
    assert len(scenario.reaches) == len(TOUR)
    assert all(reach.start == 0.0 for reach in scenario.reaches)
    # What the predictor learns of each begins where the hand is then.
    for index in range(1, len(TOUR)):
        before = scenario.reaches[index - 1].person_target
        assert before is not None
        assert scenario.person_from(index) == scenario.targets[before]
    assert scenario.person_from(0) == scenario.persons[0].home


def test_a_walk_goes_on_from_where_the_hand_is(scenario: Scenario) -> None:
    walk = Walk(scenario, np.random.default_rng(0))
    assert walk.place == HOME
    at, seen = scenario.persons[0].home, set()
    for _ in range(200):
        reach = walk.next()
        index = scenario.reaches.index(reach)
        assert reach.person_target is not None
        starts = {
            scenario.person_from(other)
            for other, one in enumerate(scenario.reaches)
            if one.person_target == reach.person_target
        }
        assert at in starts
        at = scenario.targets[reach.person_target]
        seen.add((index, walk.place))
        assert walk.other(reach).robot_target != reach.robot_target
    assert {place for _, place in seen} == {0, 1, 2}
    walk.home()
    assert walk.next() == scenario.reaches[0]


def test_a_hand_that_is_taken_back_is_where_it_was_before(scenario: Scenario) -> None:
    walk = Walk(scenario, np.random.default_rng(0))
    walk.next()
    walk.back()
    assert walk.place == HOME
    walk.next()
    before = walk.place
    walk.next()
    walk.back()
    assert walk.place == before
    walk.next()
    walk.home()  # its node was started again meanwhile
    walk.back()
    assert walk.place == HOME


def test_the_seed_decides(scenario: Scenario) -> None:
    def names(seed: int) -> list[str]:
        walk = Walk(scenario, np.random.default_rng(seed))
        return [walk.next().robot_target for _ in range(30)]

    assert names(1) == names(1) != names(2)
