"""What the sections of the report are measured with: what came of the experiments."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from hri_prediction.results.progress import ProgressLine
from hri_sim.readability.learning import Learnt
from hri_sim.readability_report.cases import CASES, TEACHER, TEACHER_SEED, Case
from hri_sim.readability_report.run_folder import RunFolder
from hri_sim.readability_report.trials import Trials, trials_of


@dataclass(frozen=True, eq=False)
class Person:
    """What came of one person's experiment.

    Attributes:
        learnt: All of it.
        trials: The trials as columns.
    """

    learnt: Learnt
    trials: Trials

    @property
    def change(self) -> float:
        """Of the time that reading the policy takes, as a share of what it took before."""
        return self.learnt.after.prediction_time / self.learnt.before.prediction_time - 1.0


@dataclass(frozen=True)
class Laboratory:
    """What sections are measured with.

    Attributes:
        out: Folder of the report.
        smoke: Whether everything is as small as it can be.
        progress: Says what is done.
        people: Results by name of the experiment, in the order of the report, and by seed.
        origins: Where they come from, each once.
    """

    out: Path
    smoke: bool
    progress: ProgressLine
    people: dict[str, dict[int, Person]] = field(default_factory=dict)
    origins: list[dict[str, Any]] = field(default_factory=list)

    def take(self, folder: RunFolder, cases: Sequence[Case], seeds: Sequence[int]) -> None:
        """Read what is done: of these seeds, of these experiments and of others so far as it is there."""
        for case in CASES:
            there = seeds if case in cases else [s for s in folder.seeds(case) if s in seeds]
            self._read(folder, case, there)
        taught = {seed for case in CASES if case.taught for seed in self.of(case)}
        self._read(folder, TEACHER, [seed + TEACHER_SEED for seed in sorted(taught)])

    def _read(self, folder: RunFolder, case: Case, seeds: Sequence[int]) -> None:
        found = {seed: result for seed in seeds if (result := folder.read(case, seed)) is not None}
        if not found:
            return
        experiment = case.experiment(folder.smoke)
        self.people[case.name] = {
            seed: Person(learnt, trials_of(learnt, experiment))
            for seed, (learnt, _) in found.items()
        }
        for _, origin in found.values():
            if origin not in self.origins:
                self.origins.append(origin)

    def of(self, case: Case) -> dict[int, Person]:
        """Who took part in an experiment, by seed; nobody if it was not done."""
        return self.people.get(case.name, {})

    def both(self, first: Case, second: Case) -> list[tuple[Person, Person]]:
        """The same people in two experiments."""
        one, other = self.of(first), self.of(second)
        return [(one[seed], other[seed]) for seed in one if seed in other]

    def representative(self, case: Case) -> Person:
        """Whose policy improved as much as that of the median person.

        Raises:
            ValueError: when nobody took part.
        """
        people = list(self.of(case).values())
        order = np.argsort([person.change for person in people], kind="stable")
        if not len(order):
            raise ValueError(f"nobody took part in {case.name}")
        return people[int(order[(len(order) - 1) // 2])]
