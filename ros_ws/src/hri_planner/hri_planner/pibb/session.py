"""The trials of an experiment: which comes next, and what is learnt from each.

A session changes only when a trial is over and its costs are known: :attr:`Session.state` before and
after are all there is, and can be saved. A trial that is broken off leaves nothing; the same one is next
again.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hri_planner.dmp.policy import DmpPolicy
from hri_planner.pibb.costs import DEVIATION_M2, TERM_NAMES, Terms, indistinctness, total
from hri_planner.pibb.experiment import Experiment
from hri_planner.pibb.exploration import exploration
from hri_planner.pibb.update import improved
from hri_prediction.errors import DataError, PlanningError

FloatArray = NDArray[np.float64]

HABITUATION, LEARNING, OVER = "habituation", "learning", "over"


@dataclass(frozen=True)
class Trial:
    """One reach that a person is to read.

    Attributes:
        number: From 0; the habituation counts.
        update: Update that it belongs to, from 0; -1 in the habituation.
        goal: Where the robot goes.
        sample: Which roll-out of the update, 0: the mean.
    """

    number: int
    update: int
    goal: str
    sample: int


@dataclass(frozen=True)
class Result:
    """What a trial cost.

    Attributes:
        trial: The trial.
        guess: Goal that the person showed.
        terms: Of the costs.
        cost: Weighted sum; 0 in the habituation, which says what terms are compared with.
        clearance: Smallest distance of robot and person, or obstacle [m].
    """

    trial: Trial
    guess: str
    terms: Terms
    cost: float
    clearance: float


@dataclass(frozen=True, eq=False)
class State:
    """All that a session knows.

    Attributes:
        policy: The mean; when the session is over, that of the last updates.
        update: Present update, from 0.
        changes: Of its samples, by goal (k, 3, n) [m]; the first are zero.
        order: Its trials still to come, or the habituation's: goal and sample.
        costs: Of its trials so far, by goal and sample.
        units: What terms are compared with, by goal; empty in the habituation.
        results: Of all trials.
        rng: State of the generator.
        late: Sum of the policies' weights after updates that are averaged, by goal (3, n) [m]; empty before
            the first of them, and when the session is over.
    """

    policy: DmpPolicy
    update: int
    changes: dict[str, FloatArray]
    order: tuple[tuple[str, int], ...]
    costs: dict[str, dict[int, float]]
    units: dict[str, Terms]
    results: tuple[Result, ...]
    rng: dict[str, Any]
    late: dict[str, FloatArray] = field(default_factory=dict)


class Session:
    """Trials of one person.

    Args:
        experiment: What is done.
        state: From where it goes on.

    Attributes:
        experiment: What is done.
        state: What is known; never changed, only replaced.
    """

    def __init__(self, experiment: Experiment, state: State) -> None:
        self.experiment = experiment
        self.state = state

    @classmethod
    def begin(cls, experiment: Experiment, policy: DmpPolicy, rng: np.random.Generator) -> Session:
        """A session with a policy to begin with; the generator is a PCG64, as numpy's default is.

        Raises:
            PlanningError: when the policy has other goals than the experiment.
            DataError: when the generator is another.
        """
        if rng.bit_generator.state.get("bit_generator") != "PCG64":
            raise DataError(
                f"generator {type(rng.bit_generator).__name__}",
                expected="PCG64, which can be saved",
            )
        if set(policy.names) != set(experiment.goals):
            raise PlanningError(
                f"policy with goals {', '.join(policy.names)}",
                expected=", ".join(experiment.goals),
                hint="begin with a policy of an experiment that has the same goals",
            )
        names = list(experiment.goals)
        habituation = experiment.improvement.habituation
        order = tuple(
            (names[index], 0) for _ in range(habituation) for index in rng.permutation(len(names))
        )
        rng_state = dict(rng.bit_generator.state)
        return cls(experiment, State(policy, -1, {}, order, {}, {}, (), rng_state))

    @property
    def stage(self) -> str:
        """``"habituation"``, ``"learning"`` or ``"over"``."""
        if self.state.update < 0:
            return HABITUATION
        return LEARNING if self.state.update < self.experiment.improvement.updates else OVER

    @property
    def trials(self) -> int:
        """How many there are in all."""
        plan = self.experiment.improvement
        return len(self.experiment.goals) * (plan.habituation + plan.updates * plan.rollouts)

    @property
    def sd(self) -> float:
        """Standard deviation of the exploration now [m]."""
        plan = self.experiment.improvement
        return plan.exploration * plan.decay ** max(self.state.update, 0)

    def next_trial(self) -> Trial | None:
        """The trial to come; none when the session is over."""
        if not self.state.order:
            return None
        goal, sample = self.state.order[0]
        return Trial(len(self.state.results), self.state.update, goal, sample)

    def policy_of(self, trial: Trial) -> DmpPolicy:
        """The policy with a trial's sample."""
        mean = self.state.policy
        if not trial.sample:
            return mean
        own = mean.weights[trial.goal] + self.state.changes[trial.goal][trial.sample]
        return replace(mean, weights={**mean.weights, trial.goal: own})

    def indistinctness(self, trial: Trial) -> float:
        """J_delta of a trial's way beside the mean ways to the other goals [1/m]."""
        mean, own = self.state.policy, self.policy_of(trial).path(trial.goal)
        others = np.array([mean.path(name) for name in mean.names if name != trial.goal])
        period = float(np.diff(mean.response().times[:2])[0])
        return indistinctness(own, others, period)

    def finish(self, trial: Trial, guess: str, terms: Terms, clearance: float) -> Result:
        """Take what a trial cost; with the last of an update, the policy improves.

        Raises:
            PlanningError: when it is another trial than the next, or the guess is no goal.
            DataError: when a cost is not finite. Nothing has changed then.
        """
        if trial != self.next_trial():
            raise PlanningError(f"costs of {trial}", expected=f"those of {self.next_trial()}")
        if guess not in self.experiment.goals:
            raise PlanningError(
                f"the guess {guess!r} is no goal", expected=", ".join(self.experiment.goals)
            )
        terms.check()
        if np.isnan(clearance):
            raise DataError("the clearance of the trial is not a number", expected="metres")
        state = self.state
        if state.update < 0:
            result = Result(trial, guess, terms, 0.0, clearance)
            state = replace(state, order=state.order[1:], results=(*state.results, result))
            if not state.order:
                state = replace(state, units=self._units(state.results))
                state = self._anew(state, 0)
        else:
            cost = total(terms, state.units[trial.goal], self.experiment.weights)
            result = Result(trial, guess, terms, cost, clearance)
            costs = {name: dict(own) for name, own in state.costs.items()}
            costs.setdefault(trial.goal, {})[trial.sample] = cost
            state = replace(
                state, order=state.order[1:], costs=costs, results=(*state.results, result)
            )
            if not state.order:
                state = self._updated(state)
        self.state = state
        return result

    def update_now(self) -> None:
        """Improve with the trials that there are; the rest of the update is left out.

        Raises:
            PlanningError: when no goal has two trials in this update.
        """
        if not any(len(own) > 1 for own in self.state.costs.values()):
            raise PlanningError(
                "no goal has two trials in this update", expected="something to compare"
            )
        self.state = self._updated(self.state)

    def _units(self, results: tuple[Result, ...]) -> dict[str, Terms]:
        """Means of the habituation: times over all goals, what a way has of its own by goal."""
        units = {}
        for goal in self.experiment.goals:
            own = [r.terms for r in results if r.trial.goal == goal]
            mean = {name: float(np.mean([getattr(t, name) for t in own])) for name in TERM_NAMES}
            for name in ("prediction_time", "human_duration"):
                mean[name] = float(np.mean([getattr(r.terms, name) for r in results]))
            mean |= {"task": 1.0, "deviation": DEVIATION_M2}
            units[goal] = Terms(**{name: value or 1.0 for name, value in mean.items()})
        return units

    def _updated(self, state: State) -> State:
        policy, plan = state.policy, self.experiment.improvement
        weights = dict(policy.weights)
        for goal, own in state.costs.items():
            if len(own) > 1:
                samples = sorted(own)
                weights[goal] = improved(
                    weights[goal],
                    state.changes[goal][samples],
                    [own[sample] for sample in samples],
                    plan.greed,
                )
        update, late = state.update + 1, state.late
        if update > plan.first_averaged:
            late = {goal: own + late.get(goal, 0.0) for goal, own in weights.items()}
        if update == plan.updates:
            count = update - plan.first_averaged
            weights, late = {goal: own / count for goal, own in late.items()}, {}
        state = replace(state, policy=replace(policy, weights=weights), late=late)
        return self._anew(state, update)

    def _anew(self, state: State, update: int) -> State:
        """An update begins: new samples, in a new order; none after the last."""
        plan, goals = self.experiment.improvement, list(self.experiment.goals)
        if update >= plan.updates:
            return replace(state, update=update, changes={}, order=(), costs={})
        rng = generator_of(state.rng)
        changes = {}
        for goal in goals:
            count = state.policy.weights[goal].shape[1]
            sd = plan.exploration * plan.decay**update
            changes[goal] = exploration(rng, plan.rollouts, count, sd)
            changes[goal][0] = 0.0
        pairs = [(goal, sample) for goal in goals for sample in range(plan.rollouts)]
        order = tuple(pairs[index] for index in rng.permutation(len(pairs)))
        return replace(
            state, update=update, changes=changes, order=order, costs={},
            rng=dict(rng.bit_generator.state),
        )  # fmt: skip


def generator_of(state: dict[str, Any]) -> np.random.Generator:
    """A generator that goes on from a state."""
    rng = np.random.default_rng(0)
    rng.bit_generator.state = state
    return rng


def row_of(result: Result) -> dict[str, Any]:
    """One line of a table of trials."""
    return {
        **asdict(result.trial),
        "guess": result.guess,
        "cost": result.cost,
        "clearance": result.clearance,
        **asdict(result.terms),
    }


def result_of(row: dict[str, Any]) -> Result:
    """Of such a line.

    Raises:
        KeyError, TypeError: when something is missing.
    """
    trial = Trial(int(row["number"]), int(row["update"]), str(row["goal"]), int(row["sample"]))
    terms = Terms(**{name: float(row[name]) for name in TERM_NAMES})
    return Result(trial, str(row["guess"]), terms, float(row["cost"]), float(row["clearance"]))
