"""A line of the table of faults: what is done, what is wanted, what came of it each time."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

import numpy as np

from hri_prediction.errors import HriError

LOCKSTEP, PROCESSES, FILES = "lock-step", "processes", "files"
"""How a fault is measured: all nodes in one process and simulated time; as users run them; no graph."""


class Skipped(HriError):
    """A fault that cannot be brought about on this machine; the text says why."""


@dataclass(frozen=True)
class Figure:
    """Something that is measured each time.

    Attributes:
        key: Name in results.
        text: What it is.
        unit: Of its values; empty for counts.
        limit: Bar; none: for information.
        least: Whether the bar is the smallest value that will do, not the largest.
        digits: Decimals in tables.
    """

    key: str
    text: str
    unit: str = ""
    limit: float | None = None
    least: bool = False
    digits: int = 0

    def met(self, value: float | None) -> bool:
        """Whether a value will do; none: it did not happen."""
        if self.limit is None:
            return True
        if value is None:
            return False
        return value >= self.limit if self.least else value <= self.limit


@dataclass(frozen=True)
class Trial:
    """What came of one repetition.

    Attributes:
        seed: Of all that was drawn for it.
        figures: Values by the key of the figure; none: it did not happen.
        said: What was said of the fault.
        origin: Of what commit it is, and of what day.
    """

    seed: int
    figures: Mapping[str, float | None]
    said: str = ""
    origin: str = ""


class Stays(Protocol):
    """Something that takes long to begin and serves several faults."""

    def close(self) -> None:
        """End it."""


@dataclass(frozen=True)
class Place:
    """Where a fault is measured.

    Attributes:
        folder: For files; made by whoever measures.
        keep: Folder of what takes long to make and is used again.
        smoke: Whether a short form will do.
        workers: Processes for what needs no real time.
        stays: What stays open from one fault to the next, by what it is; closed by whoever measures.
    """

    folder: Path
    keep: Path
    smoke: bool = False
    workers: int = 1
    stays: dict[str, Stays] = field(default_factory=dict)


Measure = Callable[[Sequence[int], Place], Iterator[Trial]]
"""Repetitions of these seeds, each handed out as soon as it is done."""


@dataclass(frozen=True)
class Fault:
    """A fault.

    Attributes:
        name: Short; names the line on the command line.
        title: What happens.
        injected: How it is brought about.
        answer: What is wanted.
        kind: :data:`LOCKSTEP`, :data:`PROCESSES` or :data:`FILES`.
        figures: What is measured.
        measure: Brings it about.
        count: Repetitions of a full run.
        smoke: Of a smoke run.
    """

    name: str
    title: str
    injected: str
    answer: str
    kind: str
    figures: tuple[Figure, ...]
    measure: Measure = field(repr=False)
    count: int = 20
    smoke: int = 1


@dataclass(frozen=True)
class Result:
    """What came of all repetitions of a fault.

    Attributes:
        fault: Which.
        trials: What came of each.
        skipped: Why there are none; empty when there are.
    """

    fault: Fault
    trials: tuple[Trial, ...]
    skipped: str = ""

    def values(self, figure: Figure) -> list[float | None]:
        """Of all trials that have it."""
        return [trial.figures[figure.key] for trial in self.trials if figure.key in trial.figures]

    def missed(self, figure: Figure) -> int:
        """How often a figure missed its bar."""
        return sum(not figure.met(value) for value in self.values(figure))

    @property
    def met(self) -> bool:
        """Whether every figure of every trial there is will do; none need be where it was skipped."""
        return not any(map(self.missed, self.fault.figures))

    def misses(self) -> list[str]:
        """What missed its bar, in words."""
        return [
            f"seed {trial.seed}: {figure.text}: {trial.figures[figure.key]} {figure.unit}"
            f" (wanted {'≥' if figure.least else '≤'} {figure.limit}); said: {trial.said}"
            for figure in self.fault.figures
            for trial in self.trials
            if figure.key in trial.figures and not figure.met(trial.figures[figure.key])
        ]

    def failed_seeds(self) -> list[int]:
        """Of the trials in which something missed its bar."""
        figures = {figure.key: figure for figure in self.fault.figures}
        return [
            trial.seed
            for trial in self.trials
            if not all(
                figures[key].met(trial.figures[key])
                for key in figures.keys() & trial.figures.keys()
            )
        ]

    def worst(self, figure: Figure) -> float | None:
        """The value farthest from the good side; none: once it did not happen, or it was not measured."""
        values = self.values(figure)
        if not values or None in values:
            return None
        found = np.array(values, dtype=float)
        return float(found.min() if figure.least else found.max())

    def median(self, figure: Figure) -> float | None:
        """Of what happened; none when nothing did."""
        values = [value for value in self.values(figure) if value is not None]
        return float(np.median(values)) if values else None
