"""The trials of one person as columns of numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray

from hri_planner.pibb.costs import TERM_NAMES, CostWeights, Terms, total
from hri_planner.pibb.experiment import Experiment
from hri_sim.readability.learning import Learnt

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

COST = "cost"


@dataclass(frozen=True, eq=False)
class Trials:
    """Those of the updates, in their order; the habituation is left out.

    Attributes:
        goals: Names.
        updates: How many there are.
        update: Which each is of (n,).
        goal: Index of where the robot went (n,).
        wrong: Whether the person took it for another one (n,).
        columns: Cost and its terms (n,), by name.
        terms: Of each cost.
        nearest: Smallest distance in all trials, the habituation's too [m].
        count: Of all trials, the habituation's too.
    """

    goals: tuple[str, ...]
    updates: int
    update: IntArray
    goal: IntArray
    wrong: BoolArray
    columns: Mapping[str, FloatArray]
    terms: tuple[Terms, ...]
    nearest: float
    count: int

    def by_update(self, values: FloatArray, goal: str | None = None) -> FloatArray:
        """Mean of a column in each update (updates,), of one goal or of all."""
        return np.array(
            [values[self.of(update, goal)].mean() for update in range(self.updates)], dtype=float
        )

    def of(self, update: int, goal: str | None = None) -> BoolArray:
        """Which trials are of an update, and of a goal (n,)."""
        chosen: BoolArray = self.update == update
        return chosen if goal is None else chosen & self.to(goal)

    def to(self, goal: str) -> BoolArray:
        """Which trials are of a goal (n,)."""
        chosen: BoolArray = self.goal == self.goals.index(goal)
        return chosen


def trials_of(learnt: Learnt, experiment: Experiment) -> Trials:
    """Those of a person in an experiment."""
    goals = tuple(experiment.goals)
    results = [result for result in learnt.results if result.trial.update >= 0]
    columns = {
        name: np.array([getattr(result.terms, name) for result in results]) for name in TERM_NAMES
    }
    columns[COST] = np.array([result.cost for result in results])
    return Trials(
        goals=goals,
        updates=experiment.improvement.updates,
        update=np.array([result.trial.update for result in results]),
        goal=np.array([goals.index(result.trial.goal) for result in results]),
        wrong=np.array([result.guess != result.trial.goal for result in results]),
        columns=columns,
        terms=tuple(result.terms for result in results),
        nearest=min(result.clearance for result in learnt.results),
        count=len(learnt.results),
    )


def costs_in(trials: Trials, units: Mapping[str, Terms], weights: CostWeights) -> FloatArray:
    """Costs (n,) in some units, as in those of another session: in the same alone two can be compared."""
    own = [units[trials.goals[goal]] for goal in trials.goal]
    return np.array(
        [total(terms, unit, weights) for terms, unit in zip(trials.terms, own, strict=True)]
    )


def shares(
    trials: Trials, units: Mapping[str, Terms], weights: CostWeights
) -> dict[str, FloatArray]:
    """What each term adds to the costs (n,); terms without weight are left out."""
    found = {}
    for name, weight in asdict(weights).items():
        if weight:
            alone = CostWeights(**{**dict.fromkeys(TERM_NAMES, 0.0), name: weight})
            found[name] = costs_in(trials, units, alone)
    return found
