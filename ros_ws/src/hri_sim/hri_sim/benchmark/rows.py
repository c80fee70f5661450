"""A file of rows, one a finished unit of work: what is in it need not be done again."""

from __future__ import annotations

import json
import os
from dataclasses import asdict, dataclass
from pathlib import Path

from hri_sim.benchmark.outcome import Outcome


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
class Done:
    """A finished unit.

    Attributes:
        unit: Which.
        outcomes: One a condition, in their order.
        wall_s: How long they took in real time [s]; the only thing that differs between runs.
    """

    unit: Unit
    outcomes: tuple[Outcome, ...]
    wall_s: float


def append_line(path: Path, text: str) -> None:
    """Add a line of its own to a file, whatever is at its end: a line before may be cut off."""
    with path.open("ab+") as file:
        file.seek(max(file.seek(0, os.SEEK_END) - 1, 0))
        cut = file.read(1) not in (b"", b"\n")
        file.write((("\n" if cut else "") + text + "\n").encode())


class RowFile:
    """Rows as lines of JSON, in the order in which they were finished.

    Args:
        path: The file; it need not exist.
        marks: Hash of all that a planner's outcomes depend on, by planner. Rows of another mark are
            of other code or settings, and left alone.
    """

    def __init__(self, path: Path, marks: dict[str, str]) -> None:
        self._path = path
        self._marks = marks

    def read(self) -> dict[Unit, Done]:
        """The usable rows; a last line that was cut off is not."""
        found: dict[Unit, Done] = {}
        if not self._path.exists():
            return found
        for line in self._path.read_text().splitlines():
            try:
                row = json.loads(line)
                unit = Unit(row["planner"], row["seed"], row["task"])
                if row["mark"] != self._marks.get(unit.planner):
                    continue
                outcomes = tuple(Outcome(**values) for values in row["outcomes"])
                found[unit] = Done(unit, outcomes, row["wall_s"])
            except (ValueError, KeyError, TypeError):
                continue
        return found

    def add(self, done: Done) -> None:
        """Append a row."""
        row = {
            **asdict(done.unit),
            "mark": self._marks[done.unit.planner],
            "wall_s": round(done.wall_s, 3),
            "outcomes": [asdict(outcome) for outcome in done.outcomes],
        }
        append_line(self._path, json.dumps(row, allow_nan=False))
