"""Random orders keep who somebody is, and what all have done."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from hri_prediction.errors import DataError
from hri_prediction.motor_control.analyses.discomfort import SIX, fit_discomfort
from hri_prediction.motor_control.analyses.orders import random_orders


@given(
    st.lists(st.tuples(st.integers(0, 2), st.integers(0, 5)), min_size=2, max_size=40),
    st.integers(0, 100),
)
def test_tasks_change_places_as_a_whole_and_in_all_people(
    cells: list[tuple[int, int]], seed: int
) -> None:
    person, task = np.array(cells).T
    done = [tuple(sorted(person[task == each])) for each in set(task.tolist())]
    assume(len(set(done)) < len(done))
    for order in random_orders(person, task, 5, np.random.default_rng(seed)):
        assert sorted(order) == list(range(len(cells)))
        np.testing.assert_array_equal(person[order], person)
        # All people's repetitions of a task come from one other task.
        taken: dict[int, int] = {}
        for what, of in zip(task.tolist(), task[order].tolist(), strict=True):
            assert taken.setdefault(what, of) == of


def test_every_order_is_as_likely() -> None:
    orders = random_orders(np.zeros(3), np.arange(3), 6000, np.random.default_rng(0))
    counts = np.unique(orders, axis=0, return_counts=True)[1]
    assert len(counts) == 6
    assert counts.min() > 850


def test_the_same_seed_gives_the_same_orders() -> None:
    person, task = np.repeat([0, 1], 6), np.tile(np.repeat([0, 1, 2], 2), 2)
    first, again = (random_orders(person, task, 9, np.random.default_rng(4)) for _ in range(2))
    np.testing.assert_array_equal(first, again)


@pytest.mark.parametrize(
    ("person", "task", "match"),
    [
        ([0, 0, 0], [0, 1], "one of each"),
        ([0, 0, 0], [0, 0, 0], "two or more"),  # one task
        ([0, 0, 0], [0, 1, 1], "equally often"),
        ([0, 1], [0, 1], "same people"),
        ([], [], "two or more"),
    ],
)
def test_what_cannot_change_places_is_refused(
    person: list[int], task: list[int], match: str
) -> None:
    with pytest.raises(DataError, match=match):
        random_orders(np.array(person), np.array(task), 1, np.random.default_rng(0))


def test_people_and_tasks_that_differ_are_not_taken_for_an_effect_of_posture() -> None:
    """Shares that are of persons and tasks alone: orders without blocks find what is not there."""
    rng = np.random.default_rng(1)
    blocked, free = [], []
    person, task = np.repeat(np.arange(6), 20), np.tile(np.arange(20), 6)
    for _ in range(300):
        # Postures and shares each have something of the person and of the task, drawn independently.
        own, done = rng.normal(size=(6, 6)), rng.normal(size=(20, 6))
        postures = 0.2 * own[person] + 0.8 * done[task] + 0.1 * rng.normal(size=(120, 6))
        share = 0.5 * rng.normal(size=6)[person] + rng.normal(size=20)[task]
        share = 0.5 + 0.05 * (share + 0.3 * rng.normal(size=120))
        ends = postures[:, :3], postures[:, 3:]
        found = (
            fit_discomfort(*ends, share, SIX, rng, person=person, task=task, permutations=99),
            fit_discomfort(*ends, share, SIX, rng, permutations=99),
        )
        blocked.append(found[0].p <= 0.05)
        free.append(found[1].p <= 0.05)
    assert np.mean(blocked) <= 0.1
    assert np.mean(free) >= 0.8
