"""The segments that classifiers are trained and judged on: of simulated dyads, or of recordings."""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import TypeVar

from hri_prediction.compiled import processor
from hri_prediction.errors import DataError, HriError
from hri_prediction.ontology.recordings import (
    RecordedSession,
    Refused,
    read_sessions,
    table_of_recording,
)
from hri_prediction.ontology.table import SegmentTable, joined
from hri_prediction.results.dependencies import dependency_hash
from hri_sim.benchmark.workers import do_all, versions
from hri_sim.ontology.layout_file import layouts_hash
from hri_sim.ontology.sessions import DyadStudy, Session, sessions_of, table_of_session

SIMULATED = "simulated"
WORK = "hri_sim.ontology.sessions"
"""The module that simulated segments come from: what it depends on decides about them."""
Progress = Callable[[int, int], None]
Item = TypeVar("Item")
Result = TypeVar("Result")


def _simulated(study: DyadStudy, parts: Path, session: Session) -> tuple[int, SegmentTable]:
    file = parts / f"{session.number}.npz"
    try:
        return session.number, SegmentTable.load(file)
    except DataError:
        table = table_of_session(session, study)
    _save(table, file)
    return session.number, table


def _save(table: SegmentTable, file: Path) -> None:
    new = file.with_suffix(".new.npz")
    table.save(new)
    new.replace(file)


def _recorded(
    numbered: tuple[int, RecordedSession],
) -> tuple[int, tuple[SegmentTable, Refused]]:
    number, session = numbered
    return number, table_of_recording(session, number)


def _gathered(
    work: Callable[[Item], tuple[int, Result]],
    items: Sequence[Item],
    workers: int,
    progress: Progress,
) -> list[Result]:
    """What comes of items, in the order of their numbers."""
    found: dict[int, Result] = {}
    with closing(do_all(work, items, workers=workers)) as results:
        for number, result in results:
            found[number] = result
            progress(len(found), len(items))
    return [found[number] for number in sorted(found)]


def simulated_table(
    sessions: Sequence[Session], study: DyadStudy, keep: Path, workers: int, progress: Progress
) -> SegmentTable:
    """The segments of simulated sessions; once made they are kept, each as soon as it is.

    Args:
        sessions: Which.
        study: What they have in common.
        keep: Folder of what is made.
        workers: Processes.
        progress: Told how many sessions are done, of how many.
    """
    about = [json.dumps(asdict(study)), *(repr(session) for session in sessions)]
    parts = (about, layouts_hash(), dependency_hash(WORK), processor(), sorted(versions().items()))
    file = keep / f"segments_{hashlib.sha256(repr(parts).encode()).hexdigest()[:16]}.npz"
    try:
        return SegmentTable.load(file)
    except DataError:
        unfinished = file.with_suffix("")
        unfinished.mkdir(parents=True, exist_ok=True)
        table = joined(
            _gathered(partial(_simulated, study, unfinished), sessions, workers, progress)
        )
    _save(table, file)
    shutil.rmtree(unfinished, ignore_errors=True)
    return table


@dataclass(frozen=True, eq=False)
class Segments:
    """Segments to learn from or to be asked of.

    Attributes:
        table: They.
        refused: Of each recording of which movements were refused, how many and why, a line each.
    """

    table: SegmentTable
    refused: tuple[str, ...] = ()


def segments_of_data(
    data: str, study: DyadStudy, seed: int, keep: Path, workers: int, progress: Progress
) -> Segments:
    """The segments that ``--data`` names.

    Args:
        data: ``simulated``, a table of segments (.npz), or a list of sessions (.yaml, or its folder).
        study: Of simulated dyads.
        seed: Of simulated dyads.
        keep: Folder of what is made.
        workers: Processes.
        progress: Told how many sessions are done, of how many.

    Raises:
        DataError: when it is none of these, or holds no segments.
    """
    if data == SIMULATED:
        return Segments(simulated_table(sessions_of(study, seed), study, keep, workers, progress))
    path, refused = Path(data), []
    try:
        if path.suffix == ".npz":
            table = SegmentTable.load(path)
        else:
            items = list(enumerate(read_sessions(path)))
            parts = _gathered(_recorded, items, workers, progress)
            table = joined([part for part, _ in parts])
            refused = [
                one.line() if one.count else f"{one.bag.name}: no movement is found"
                for _, one in parts
                if one.count or not one.taken
            ]
    except HriError as error:
        raise DataError(
            f"--data {data}: {error.problem}",
            expected=error.expected
            or "simulated, a table of segments (.npz) or of sessions (.yaml)",
            hint=error.hint,
        ) from error
    if not len(table):
        raise DataError(
            f"--data {data} holds no movement of which both arms are seen",
            hint="; ".join(refused[:3]),
        )
    return Segments(table, tuple(refused))
