"""All splits of an evaluation, done by many, each kept as soon as it is done."""

from __future__ import annotations

import functools
import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np

from hri_prediction.compiled import processor
from hri_prediction.errors import DataError
from hri_prediction.files.whole import write_whole
from hri_prediction.ontology.classifier import COST
from hri_prediction.ontology.evaluation import (
    FULL,
    GROUPED,
    KINDS,
    Confusion,
    complete_subjects,
    individual,
    labels_of,
    leave_sessions_out,
    leave_subject_out,
    of_one_alone,
    position_out,
    positions_apart,
    random_half,
)
from hri_prediction.ontology.table import SegmentTable
from hri_prediction.results.dependencies import dependency_hash
from hri_prediction.results.workers import versions
from hri_sim.benchmark.workers import do_all
from hri_sim.ontology.sessions import FIRST_CASES
from hri_sim.readability_report.run_folder import write_json

RANDOM, SUBJECT, SESSIONS, POSITIONS, POSITION_OUT, INDIVIDUAL = (
    "random", "subject", "sessions", "positions", "position_out", "individual",
)  # fmt: skip
LEFT_OUT = "left_out"
ALONE = "of_one_alone"
"""Classes of a person that nobody else did, of which the others' machine is not asked."""
"""Key of the reason why a split cannot be done."""
PACKAGES = ("numpy", "scipy", "scikit-learn")
WORK = "hri_prediction.ontology.evaluation"
Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class Split:
    """One of the splits.

    Attributes:
        kind: What is split by: :data:`RANDOM` and so on.
        labels: Full or reduced ontology, or the reduced one grouped.
        who: Who is left out, or judged; else empty.
        seed: Of what is drawn.
        cost: Of the machine.
    """

    kind: str
    labels: str
    who: str
    seed: int
    cost: float = COST


def splits_of(table: SegmentTable, repetitions: int, seed: int, cost: float) -> list[Split]:
    """All splits that a table allows.

    Args:
        table: The segments.
        repetitions: Of random halves.
        seed: Of the first; the others follow.
        cost: Of the machine.
    """
    found = [
        Split(RANDOM, labels, "", seed + number, cost)
        for number in range(repetitions)
        for labels in KINDS
    ]
    few, asked = max(repetitions // 10, 1), (*KINDS, GROUPED)
    found += [Split(SESSIONS, labels, "", seed + n, cost) for n in range(few) for labels in asked]
    if len(table.subjects) > 1:
        found += [
            Split(SUBJECT, labels, who, seed, cost) for who in table.subjects for labels in asked
        ]
        found += [Split(INDIVIDUAL, KINDS[1], who, seed, cost) for who in complete_subjects(table)]
    if set(FIRST_CASES) <= set(table.case.tolist()):
        found += [Split(POSITIONS, FULL, "", seed + number, cost) for number in range(repetitions)]
        first = table.position[np.isin(table.case, FIRST_CASES)]
        names = sorted(set(first.tolist()))
        found += [Split(POSITION_OUT, FULL, name, seed, cost) for name in names if len(names) > 1]
    return found


def _confusion(found: Confusion) -> dict[str, Any]:
    return {"classes": found.classes.tolist(), "counts": found.counts.tolist()}


def read_confusion(content: Mapping[str, Any]) -> Confusion:
    """What :func:`do_split` told of a confusion."""
    return Confusion(np.array(content["classes"], dtype=np.int64), np.array(content["counts"]))


@functools.lru_cache(maxsize=2)
def _load(path: str) -> SegmentTable:
    return SegmentTable.load(path)


def do_split(path: str, split: Split) -> tuple[Split, dict[str, Any]]:
    """A split of the table in a file; called in a process of its own."""
    table = _load(path)
    try:
        return split, _done(table, split)
    except DataError as error:  # small recordings do not allow all splits
        return split, {LEFT_OUT: str(error)}


def _done(table: SegmentTable, split: Split) -> dict[str, Any]:
    seed, cost = split.seed, split.cost
    if split.kind == RANDOM:
        return _confusion(random_half(table, split.labels, seed, cost))
    if split.kind == SESSIONS:
        return _confusion(leave_sessions_out(table, split.labels, seed, cost))
    if split.kind == SUBJECT:
        own = of_one_alone(table, split.who, split.labels)
        found = leave_subject_out(table, split.who, split.labels, seed, cost)
        return {**_confusion(found), ALONE: own.tolist()}
    if split.kind == POSITIONS:
        apart = positions_apart(table, FIRST_CASES, seed, cost)
        return {name: _confusion(found) for name, found in apart.items()}
    if split.kind == POSITION_OUT:
        return _confusion(position_out(table, FIRST_CASES, split.who, seed, cost))
    return asdict(individual(table, split.who, seed, cost))


def do_splits(
    table: SegmentTable, splits: Sequence[Split], keep: Path, workers: int, progress: Progress
) -> dict[Split, dict[str, Any]]:
    """What came of all splits; those that are kept are not done again.

    Args:
        table: The segments.
        splits: Which.
        keep: Folder of what is done.
        workers: Processes.
        progress: Told how many are done, of how many.
    """
    content = [table.features.tobytes(), labels_of(table, FULL).tobytes(), "\0".join(table.subject)]
    content += [
        "\0".join(table.position),
        table.session.tobytes(),
        dependency_hash(WORK),
        processor(),
    ]
    packages = sorted(versions(PACKAGES).items())
    mark = hashlib.sha256(repr((content, packages)).encode()).hexdigest()[:16]
    folder = keep / f"splits_{mark}"
    folder.mkdir(parents=True, exist_ok=True)
    file = folder / "segments.npz"
    write_whole({file: table.save})  # whatever an earlier run left there
    found = {split: kept for split in splits if (kept := _read(_file(folder, split))) is not None}
    progress(len(found), len(splits))
    missing = [split for split in splits if split not in found]
    if missing:
        work = functools.partial(do_split, str(file))
        with closing(do_all(work, missing, workers=workers)) as results:
            for split, told in results:
                write_json(_file(folder, split), told)
                found[split] = told
                progress(len(found), len(splits))
    return {split: found[split] for split in splits}


def _file(folder: Path, split: Split) -> Path:
    # "a b" and "a_b" are two people, and "a/b" is no folder.
    who = f"_{quote(split.who, safe='')}" if split.who else ""
    return folder / f"{split.kind}_{split.labels}{who}_{split.seed}_{split.cost:g}.json"


def _read(path: Path) -> dict[str, Any] | None:
    try:
        content = json.loads(path.read_text())
    except (OSError, ValueError):
        return None
    return content if isinstance(content, dict) else None
