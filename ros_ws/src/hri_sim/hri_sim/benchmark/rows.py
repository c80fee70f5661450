"""A file of rows, one a finished unit of work: what is in it need not be done again."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from contextlib import closing
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar

from hri_sim.benchmark.workers import do_all

OutcomeT = TypeVar("OutcomeT")
ItemT = TypeVar("ItemT")


@dataclass(frozen=True)
class Unit:
    """Work that one process does at a time: a planner in the conditions of one task.

    Attributes:
        planner: Name.
        seed: Of noise.
        task: Number.
    """

    planner: str
    seed: int
    task: int


@dataclass(frozen=True)
class Done(Generic[OutcomeT]):
    """A finished unit.

    Attributes:
        unit: Which.
        outcomes: What came of it, in order; of the benchmark one a condition.
        wall_s: How long they took in real time [s]; the only thing that differs between runs.
    """

    unit: Unit
    outcomes: tuple[OutcomeT, ...]
    wall_s: float


def append_line(path: Path, text: str) -> None:
    """Add a line of its own to a file, whatever is at its end: a line before may be cut off."""
    with path.open("ab+") as file:
        file.seek(max(file.seek(0, os.SEEK_END) - 1, 0))
        cut = file.read(1) not in (b"", b"\n")
        file.write((("\n" if cut else "") + text + "\n").encode())


class RowFile(Generic[OutcomeT]):
    """Rows as lines of JSON, in the order in which they were finished.

    Args:
        path: The file; it need not exist.
        marks: Hash of all that a planner's outcomes depend on, by planner. Rows of another mark are
            of other code or settings, and left alone.
        kind: Flat dataclass of the outcomes.
    """

    def __init__(self, path: Path, marks: dict[str, str], kind: type[OutcomeT]) -> None:
        self._path = path
        self._marks = marks
        self._kind = kind

    def read(self) -> dict[Unit, Done[OutcomeT]]:
        """The usable rows; a last line that was cut off is not."""
        found: dict[Unit, Done[OutcomeT]] = {}
        if not self._path.exists():
            return found
        for line in self._path.read_text().splitlines():
            try:
                row = json.loads(line)
                unit = Unit(row["planner"], row["seed"], row["task"])
                if row["mark"] != self._marks.get(unit.planner):
                    continue
                outcomes = tuple(self._kind(**values) for values in row["outcomes"])
                found[unit] = Done(unit, outcomes, row["wall_s"])
            except (ValueError, KeyError, TypeError):
                continue
        return found

    def add(self, done: Done[OutcomeT]) -> None:
        """Append a row."""
        row = {
            **asdict(done.unit),
            "mark": self._marks[done.unit.planner],
            "wall_s": round(done.wall_s, 3),
            "outcomes": [_values(outcome) for outcome in done.outcomes],
        }
        append_line(self._path, json.dumps(row, allow_nan=False))


def _values(outcome: Any) -> dict[str, Any]:
    return asdict(outcome)


def do_waiting(
    file: RowFile[OutcomeT],
    items: dict[Unit, ItemT],
    work: Callable[[ItemT], Done[OutcomeT]],
    *,
    workers: int,
    scheduler: str | None,
    progress: Callable[[int, int], None] | None,
) -> dict[Unit, Done[OutcomeT]]:
    """Do what the file does not hold yet, and keep it there.

    Args:
        file: Of rows.
        items: What to call the work with, by unit.
        work: A function of a module, or a partial of one; does one unit.
        workers: Processes on this machine.
        scheduler: Address of a Dask scheduler instead.
        progress: Called with the numbers of units done and of all.

    Returns:
        All units, in the order of the items.

    Raises:
        ConfigError: when the scheduler cannot be used.
    """
    before = file.read()
    done = {unit: before[unit] for unit in items if unit in before}
    waiting = [item for unit, item in items.items() if unit not in done]
    if progress is not None:
        progress(len(done), len(items))
    if waiting:
        with closing(do_all(work, waiting, workers=workers, scheduler=scheduler)) as results:
            for result in results:
                file.add(result)
                done[result.unit] = result
                if progress is not None:
                    progress(len(done), len(items))
    return {unit: done[unit] for unit in items}
