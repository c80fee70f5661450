"""Does the work of the report's sections, on all cores."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from hri_planner.rnn.encounters import Encounter
from hri_planner.rnn.training.config import TrainingConfig
from hri_prediction.results.progress import ProgressLine
from hri_sim.benchmark.workers import do_all
from hri_sim.policies.datasets import DataSet, simulated_set
from hri_sim.policy_report.policies import Policy, seed_policies

Item = TypeVar("Item")
Result = TypeVar("Result")


@dataclass(frozen=True)
class Laboratory:
    """What sections are measured with.

    Attributes:
        runs: Folder of trained policies.
        out: Folder of the report.
        workers: Processes.
        config: By which policies are trained.
        progress: Says how far it is.
        smoke: Whether everything is as small as it can be.
    """

    runs: Path
    out: Path
    workers: int
    config: TrainingConfig
    progress: ProgressLine
    smoke: bool

    def all(self, what: str, work: Callable[[Item], Result], items: Sequence[Item]) -> list[Result]:
        """Results in the order of the items."""
        self.progress.say(what)
        found: dict[int, Result] = {}
        numbered = list(enumerate(items))
        for done, (index, result) in enumerate(
            do_all(functools.partial(_numbered, work), numbered, workers=self.workers), 1
        ):
            found[index] = result
            self.progress.count(done, len(items))
        return [found[index] for index in range(len(items))]

    def policy(self, number: str) -> Policy:
        """A configuration of table 5.2 with the first seed; a smoke run has those of D2 alone."""
        shift = {"C7": "C13", "C8": "C14", "C9": "C15"} if self.smoke else {}
        wanted = shift.get(number, number)
        return next(
            policy for policy in seed_policies(self.config, self.smoke) if policy.job.name == wanted
        )

    def compared(self) -> list[Policy]:
        """One of each kind of cells, two layers of nine units, of D1."""
        return [self.policy(number) for number in ("C7", "C8", "C9")]


def _numbered(work: Callable[[Item], Result], item: tuple[int, Item]) -> tuple[int, Result]:
    return item[0], work(item[1])


@functools.lru_cache(maxsize=2)
def kept_set(name: str, seed: int) -> DataSet:
    """A simulated set; the last ones are kept, as drawing them takes seconds."""
    return simulated_set(name, seed)


def kept_test(name: str, seed: int, smoke: bool) -> tuple[Encounter, ...]:
    """Encounters to be tested in, few of them in a smoke run."""
    test = kept_set(name, seed).test
    return test[:: max(len(test) // 16, 1)] if smoke else test
