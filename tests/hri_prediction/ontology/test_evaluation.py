"""Splits of segments, and tables of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hri_prediction.errors import DataError
from hri_prediction.ontology.evaluation import (
    FULL,
    REDUCED,
    complete_subjects,
    confusion,
    half_of,
    individual,
    leave_sessions_out,
    leave_subject_out,
    of_one_alone,
    positions_apart,
    random_half,
    summed,
)
from hri_prediction.ontology.table import SegmentTable, joined, table_of


def made(cases: tuple[int, ...] = (1, 2, 3), subjects: tuple[str, ...] = ("a", "b"), each: int = 12,
         spread: float = 0.2) -> SegmentTable:  # fmt: skip
    """Segments that each case has a place of its own for."""
    rng = np.random.default_rng(0)
    middles = {case: np.random.default_rng(case).uniform(0.1, 1.0, 25) for case in cases}
    rows = []
    for case in cases:
        for subject in subjects:
            for number in range(each):
                position = ("frontal", "orthogonal")[number % 2]
                features = middles[case] + spread * rng.standard_normal(25)
                rows.append((features, case, subject, position, 10 * case + number % 4))
    return table_of(*map(list, zip(*rows, strict=True)))  # type: ignore[arg-type]


def test_confusions_count() -> None:
    found = confusion(np.array([1, 1, 3, 3, 3]), np.array([1, 3, 3, 3, 1]), np.array([1, 2, 3]))
    np.testing.assert_array_equal(found.counts, [[1, 0, 1], [0, 0, 0], [1, 0, 2]])
    assert found.overall == pytest.approx(3 / 5)
    np.testing.assert_allclose(found.rates, [0.5, np.nan, 2 / 3])
    np.testing.assert_array_equal(summed([found, found]).counts, 2 * found.counts)


def test_halves_are_halves_of_each_class() -> None:
    labels = np.repeat([1, 2, 3], [10, 20, 7])
    chosen = half_of(labels, np.random.default_rng(0))
    assert [int(chosen[labels == k].sum()) for k in (1, 2)] == [5, 10]
    assert int(chosen[labels == 3].sum()) in (3, 4)


def test_what_is_easy_is_recognised_and_chance_is_not() -> None:
    easy = random_half(made(), FULL, 0)
    assert easy.overall == 1.0
    assert easy.counts.sum() == 36
    random = made(spread=0.0)
    nothing = SegmentTable(
        np.random.default_rng(1).uniform(0.1, 1.0, random.features.shape),
        random.case,
        random.subject,
        random.position,
        random.session,
    )
    assert random_half(nothing, FULL, 0).overall < 0.6


def test_nobody_who_is_left_out_is_learnt_from() -> None:
    """Somebody whose labels are all another's is never recognised by what the others taught."""
    table = made(subjects=("a", "b", "c"))
    case = np.where(table.subject == "a", table.case % 3 + 1, table.case)
    wrong = SegmentTable(table.features, case, table.subject, table.position, table.session)
    assert leave_subject_out(wrong, "a", FULL, 0).overall == 0.0
    assert leave_subject_out(wrong, "a", FULL, 0).counts.sum() == 36
    assert leave_subject_out(table, "a", FULL, 0).overall == 1.0


def test_what_nobody_else_did_is_not_asked_of_their_machine() -> None:
    both, alone = made((1, 2)), made((3,), ("a",))
    table = joined([both, alone])
    np.testing.assert_array_equal(of_one_alone(table, "a", FULL), [3])
    np.testing.assert_array_equal(of_one_alone(table, "b", FULL), [])
    found = leave_subject_out(table, "a", FULL, 0)
    assert found.counts.sum() == 24
    assert np.isnan(found.rates[2])
    with pytest.raises(DataError, match="nobody else did what c did"):
        leave_subject_out(joined([both, made((3,), ("c",))]), "c", FULL, 0)


def test_recordings_are_left_out_whole() -> None:
    found = leave_sessions_out(made(), FULL, 0)
    # Two of four recordings of each of three cases, six segments each.
    assert found.counts.sum() == 36
    assert found.overall == 1.0


def test_positions_are_told_apart() -> None:
    apart = positions_apart(made((1, 2, 3, 7)), (1, 2, 3), 0)
    assert set(apart) == {"frontal", "orthogonal"}
    assert sum(one.counts.sum() for one in apart.values()) == 36
    assert all(one.classes.tolist() == [1, 2, 3] for one in apart.values())


def test_individuals() -> None:
    table = made((1, 2, 3), ("a", "b"))
    found = individual(table, "a", 0)
    assert (found.subject, found.intra, found.subject_vs_group, found.group_vs_subject) == (
        "a",
        1,
        1,
        1,
    )
    assert found.intra_least == found.intra_most == 1.0
    only = joined([table, made((1,), ("c",))])
    assert complete_subjects(only) == ["a", "b"]


def test_groups_are_what_the_reduced_ontology_says() -> None:
    table = made((7, 11, 10, 17))
    assert sorted(set(table.group.tolist())) == [4, 5]
    assert random_half(table, REDUCED, 0).classes.tolist() == [4, 5]


def test_on_disk(tmp_path: Path) -> None:
    table = made()
    table.save(tmp_path / "t.npz")
    again = SegmentTable.load(tmp_path / "t.npz")
    np.testing.assert_array_equal(again.features, table.features)
    assert again.subjects == ["a", "b"]
    assert again.position.tolist() == table.position.tolist()
    (tmp_path / "t.npz").write_bytes(b"PK")
    with pytest.raises(DataError, match="hri-interaction-segments-1"):
        SegmentTable.load(tmp_path / "t.npz")


def test_wrong_tables_are_refused() -> None:
    table = made()
    columns = (table.case, table.subject, table.position, table.session)
    with pytest.raises(DataError, match="finite"):
        SegmentTable(table.features * np.nan, *columns)
    with pytest.raises(DataError, match="case has shape"):
        SegmentTable(table.features, table.case[1:], *columns[1:])
    with pytest.raises(Exception, match="1 to 20"):
        SegmentTable(table.features, table.case * 0, *columns[1:])
