"""Recorded people on trial; these here are simulated, and their reaches taken for recorded ones."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hri_prediction.errors import DataError
from hri_sim.hybrid import real
from hri_sim.hybrid.first_guesses import GUESSES, OPTIMAL
from hri_sim.hybrid.real import RealCourse, Repeated, run_real
from hri_sim.hybrid.subjects import VARIABILITY_M, draw_subjects

TARGETS = ("T1", "T3")


@pytest.fixture(scope="module")
def repeated() -> list[Repeated]:
    rng = np.random.default_rng(4)
    people = draw_subjects(2, "optimal", np.random.default_rng(3))

    def recorded(person, target):
        reach = person.reach(target, rng, VARIABILITY_M)
        # As of recordings: nobody ends twice at the same place.
        return replace(reach, end_tip=reach.end_tip + rng.normal(0.0, 0.01, 3))

    return [
        Repeated(f"{who} right", target, tuple(recorded(person, target) for _ in range(3)))
        for who, person in zip("AB", people, strict=True)
        for target in TARGETS
    ]


@pytest.fixture(scope="module")
def course(repeated: list[Repeated]) -> RealCourse:
    return run_real(repeated)


def with_another_end(repeated: list[Repeated], number: int) -> list[Repeated]:
    """One reach of the first target is said to have ended elsewhere; its path is the same."""
    first = repeated[0]
    moved = tuple(
        replace(reach, end_tip=reach.end_tip + 0.1) if k == number else reach
        for k, reach in enumerate(first.reaches)
    )
    found = replace(first, reaches=moved)
    assert not np.allclose(first.tip(), found.tip())  # it would tell
    return [found, *repeated[1:]]


def test_where_a_reach_ends_is_not_known_when_it_is_predicted(
    repeated: list[Repeated], course: RealCourse
) -> None:
    elsewhere = run_real(with_another_end(repeated, 0))
    # The first reach, as the first one and as the last: what is predicted of it is judged by its path.
    for before, after in zip(course.judged, elsewhere.judged, strict=True):
        if (before.person, before.target) == ("A right", "T1") and before.seen == 0:
            assert before.warped_m == after.warped_m
            assert before.end_m == after.end_m
            break
    else:
        pytest.fail("it was not judged")
    assert any(
        before.warped_m != after.warped_m
        for before, after in zip(course.judged, elsewhere.judged, strict=True)
    )  # the others are predicted with it


@pytest.mark.parametrize("seen", [0, 1])
def test_first_guesses_do_not_depend_on_that_end(repeated: list[Repeated], seen: int) -> None:
    order = [1, 2, 0]
    elsewhere = with_another_end(repeated, order[seen])
    found = [real._begin(every[0], 1, seen, every) for every in (repeated, elsewhere)]
    for guess in GUESSES:
        paths = []
        for turn in found:
            assert not isinstance(turn, str)
            paths.append(turn.states[guess].task.path.values)
        np.testing.assert_array_equal(*paths)


def test_each_reach_is_predicted_after_each_number_of_others(course: RealCourse) -> None:
    own = [each for each in course.judged if each.person == "A right" and each.target == "T1"]
    assert len(own) == 3 * 3 * len(GUESSES)
    before, after = (
        np.mean([each.warped_m for each in own if (each.guess, each.seen) == (OPTIMAL, seen)])
        for seen in (0, 2)
    )
    assert after < before
    assert set(course.whys) == {(f"{who} right", target) for who in "AB" for target in TARGETS}
    assert [len(row) for row in course.divergences] == [3] * 4


def test_one_reach_is_no_repetition(repeated: list[Repeated]) -> None:
    with pytest.raises(DataError, match="two or more"):
        Repeated("A right", "T1", repeated[0].reaches[:1])
