"""How well cases are told apart: splits of segments, and what came of them (thesis, 4.7)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hri_prediction.errors import DataError
from hri_prediction.ontology.classifier import COST, train
from hri_prediction.ontology.table import SegmentTable
from hri_prediction.ontology.verdict import grouped

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

SLOPE = 2.0
"""Of the logistic function, where only the likeliest class counts: it hardly depends on it."""
FULL, REDUCED, GROUPED = "full", "reduced", "grouped"
KINDS = (FULL, REDUCED)
"""A machine of cases, and one of the classes of the reduced ontology, as in the thesis. Grouped: these
classes by the sums of the probabilities of cases, which is what the interaction monitor says."""


def labels_of(table: SegmentTable, kind: str) -> IntArray:
    """Numbers of the classes: of cases (:data:`FULL`) or of groups."""
    return table.case if kind == FULL else table.group


@dataclass(frozen=True, eq=False)
class Confusion:
    """What was taken for what.

    Attributes:
        classes: Numbers of the classes (c,).
        counts: Of the segments of each class (rows) that were taken for each (columns) (c, c).
    """

    classes: IntArray
    counts: FloatArray

    @property
    def normalised(self) -> FloatArray:
        """Shares of each row (c, c); NaN where a class had no segments."""
        with np.errstate(invalid="ignore"):
            found: FloatArray = self.counts / self.counts.sum(axis=1, keepdims=True)
        return found

    @property
    def rates(self) -> FloatArray:
        """How often each class is recognised (c,)."""
        return np.diag(self.normalised).copy()

    @property
    def overall(self) -> float:
        """How often a segment is recognised."""
        return float(np.trace(self.counts) / self.counts.sum())

    def __add__(self, other: Confusion) -> Confusion:
        """Both together."""
        return Confusion(self.classes, self.counts + other.counts)


def confusion(truth: IntArray, found: IntArray, classes: IntArray) -> Confusion:
    """Count what was taken for what."""
    counts = np.zeros((len(classes), len(classes)))
    np.add.at(counts, (np.searchsorted(classes, truth), np.searchsorted(classes, found)), 1.0)
    return Confusion(classes, counts)


def judged(
    table: SegmentTable,
    learnt: BoolArray,
    tested: BoolArray,
    kind: str,
    rng: np.random.Generator,
    cost: float = COST,
) -> IntArray:
    """What a machine takes some segments for that has learnt others.

    Args:
        table: All segments.
        learnt: Which it learns (n,).
        tested: Which it is asked of (n,).
        kind: :data:`FULL`, :data:`REDUCED` or :data:`GROUPED`.
        rng: For the training.
        cost: Of the machine.
    """
    if kind == GROUPED:  # whose probabilities count: as what ships is trained
        machine = train(
            table.features[learnt],
            table.case[learnt],
            cost=cost,
            groups=table.session[learnt],
            rng=rng,
        )
        numbers, given = grouped(machine.classes, machine.probabilities(table.features[tested]))
        return numbers[given.argmax(axis=1)]
    labels = labels_of(table, kind)
    model = train(table.features[learnt], labels[learnt], cost=cost, slope=SLOPE, rng=rng)
    return model.classify(table.features[tested])


def half_of(labels: IntArray, rng: np.random.Generator) -> BoolArray:
    """A random half of all segments, alike of each class (n,)."""
    chosen = np.zeros(len(labels), dtype=bool)
    for number in np.unique(labels):
        rows = rng.permutation(np.flatnonzero(labels == number))
        chosen[rows[: (len(rows) + int(rng.integers(2))) // 2]] = True
    return chosen


def random_half(table: SegmentTable, kind: str, seed: int, cost: float = COST) -> Confusion:
    """Learn a random half, be asked of the other: segments of one recording are in both."""
    rng = np.random.default_rng(seed)
    labels = labels_of(table, kind)
    learnt = half_of(labels, rng)
    found = judged(table, learnt, ~learnt, kind, rng, cost)
    return confusion(labels[~learnt], found, np.unique(labels))


def leave_subject_out(
    table: SegmentTable, subject: str, kind: str, seed: int, cost: float = COST
) -> Confusion:
    """Learn everybody else, be asked of what one did that somebody else did too.

    Raises:
        DataError: when nobody else did any of it.
    """
    rng = np.random.default_rng(seed)
    labels, own = labels_of(table, kind), table.subject == subject
    tested = own & ~np.isin(labels, of_one_alone(table, subject, kind))
    if not tested.any():
        raise DataError(f"nobody else did what {subject} did", expected="a case that two did")
    found = judged(table, ~own, tested, kind, rng, cost)
    return confusion(labels[tested], found, np.unique(labels))


def of_one_alone(table: SegmentTable, subject: str, kind: str) -> IntArray:
    """Numbers of the classes that one person did and nobody else (c,): no machine of others knows them."""
    labels, own = labels_of(table, kind), table.subject == subject
    return np.setdiff1d(labels[own], labels[~own])


def leave_sessions_out(table: SegmentTable, kind: str, seed: int, cost: float = COST) -> Confusion:
    """Learn half of the recordings of each case, be asked of the others: people are in both.

    Raises:
        DataError: when there is one recording of each case.
    """
    rng = np.random.default_rng(seed)
    labels = labels_of(table, kind)
    learnt = np.zeros(len(table), dtype=bool)
    for case in np.unique(table.case):
        sessions = rng.permutation(np.unique(table.session[table.case == case]))
        learnt |= np.isin(table.session, sessions[: max(len(sessions) // 2, 1)])
    if learnt.all():
        raise DataError("one recording of each case", expected="two or more of some")
    found = judged(table, learnt, ~learnt, kind, rng, cost)
    return confusion(labels[~learnt], found, np.unique(labels))


def positions_apart(
    table: SegmentTable, numbers: Sequence[int], seed: int, cost: float = COST
) -> dict[str, Confusion]:
    """Learn a random half of some cases in all positions, be asked of the other, position by position."""
    chosen = table.where(np.isin(table.case, numbers))
    rng = np.random.default_rng(seed)
    learnt = half_of(chosen.case, rng)
    found = judged(chosen, learnt, ~learnt, FULL, rng, cost)
    truth, position = chosen.case[~learnt], chosen.position[~learnt]
    return {
        str(name): confusion(
            truth[position == name], found[position == name], np.unique(chosen.case)
        )
        for name in np.unique(position)
    }


def position_out(
    table: SegmentTable, numbers: Sequence[int], position: str, seed: int, cost: float = COST
) -> Confusion:
    """Learn some cases in all positions but one, be asked of that one."""
    chosen = table.where(np.isin(table.case, numbers))
    tested = chosen.position == position
    found = judged(chosen, ~tested, tested, FULL, np.random.default_rng(seed), cost)
    return confusion(chosen.case[tested], found, np.unique(chosen.case))


OWN_HALVES = 20
"""Random halves of a person's own segments."""


@dataclass(frozen=True)
class Individual:
    """How well one person's cases are told apart (table 4.4 of the thesis).

    Attributes:
        subject: Who.
        intra: By a half of the own segments, mean of several: parts of each recording are on both sides.
        intra_least, intra_most: The least and the most of these.
        subject_vs_group: Everybody else's by the own.
        group_vs_subject: The own by everybody else's.
    """

    subject: str
    intra: float
    intra_least: float
    intra_most: float
    subject_vs_group: float
    group_vs_subject: float


def individual(table: SegmentTable, subject: str, seed: int, cost: float = COST) -> Individual:
    """Judge one person, by the reduced ontology."""
    rng = np.random.default_rng(seed)
    labels, own = table.group, table.subject == subject
    mine = table.where(own)
    halves = []
    for _ in range(OWN_HALVES):
        learnt = half_of(mine.group, rng)
        found = judged(mine, learnt, ~learnt, REDUCED, rng, cost)
        halves.append(float((found == mine.group[~learnt]).mean()))
    out = judged(table, own, ~own, REDUCED, rng, cost) == labels[~own]
    back = judged(table, ~own, own, REDUCED, rng, cost) == labels[own]
    return Individual(
        subject,
        float(np.mean(halves)),
        min(halves),
        max(halves),
        float(out.mean()),
        float(back.mean()),
    )


def complete_subjects(table: SegmentTable) -> list[str]:
    """Those of whom there are segments of every class of the reduced ontology that there is."""
    groups = table.group
    wanted = set(groups.tolist())
    return [s for s in table.subjects if set(groups[table.subject == s].tolist()) == wanted]


def summed(parts: Sequence[Confusion]) -> Confusion:
    """Several together."""
    total = parts[0]
    for part in parts[1:]:
        total = total + part
    return total
