"""A file of rows, one a finished unit of work: what is in it need not be done again."""

from __future__ import annotations

import json
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
        """Append a row, on a line of its own whatever is at the end of the file."""
        row = {
            **asdict(done.unit),
            "mark": self._marks[done.unit.planner],
            "wall_s": round(done.wall_s, 3),
            "outcomes": [asdict(outcome) for outcome in done.outcomes],
        }
        cut = self._path.exists() and self._path.read_bytes()[-1:] not in (b"", b"\n")
        with self._path.open("a") as file:
            file.write(("\n" if cut else "") + json.dumps(row, allow_nan=False) + "\n")
