"""Laws of weights of simulated people, fitted to their noisy reaches, beside the true ones."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hri_prediction.motor_control.arm_model import ArmModel
from hri_prediction.motor_control.batch import Job, explain_all
from hri_prediction.motor_control.costs import CHAPTER_2, indices_of
from hri_prediction.motor_control.law import explained, fit_law, mean_postures
from hri_prediction.motor_control.observed import ObservedReach
from hri_prediction.motor_control.ocp import ReachSolver
from hri_prediction.motor_control.scaling import scaling_of
from hri_prediction.motor_control.seen import mean_of
from hri_prediction.motor_control.span import Span
from hri_prediction.motor_control.whole import WholeReach
from hri_sim.motor_control.people import Recorded, see_each, see_whole

Array = NDArray[np.float64]
Tick = Callable[[int, int], None]

WHOLE, KNOWN, MEANS, CUT = "whole", "known", "means", "cut"


@dataclass(frozen=True, eq=False)
class Lawful:
    """Reaches of one person, as laws may be fitted to them; of each reach its repetitions.

    Attributes:
        arm: As it was measured.
        recorded: What was recorded of each reach.
        whole: From rest to rest, as they are found in recordings.
        known: The same, were it known when each began and ended.
        cut: Cut at 5 % of their peak speed.
    """

    arm: ArmModel
    recorded: tuple[Recorded, ...]
    whole: tuple[tuple[WholeReach, ...], ...]
    known: tuple[tuple[ObservedReach, ...], ...]
    cut: tuple[tuple[ObservedReach, ...], ...]

    @classmethod
    def seen(cls, recorded: Sequence[Recorded], arm: ArmModel) -> Lawful:
        """See what was recorded of a person."""
        known, cut = (
            tuple(tuple(see_each(each, arm, whole=whole)) for each in recorded)
            for whole in (True, False)
        )
        whole = tuple(tuple(see_whole(each, arm)) for each in recorded)
        return cls(arm, tuple(recorded), whole, known, cut)

    def reaches(self, kind: str) -> tuple[list[list[ObservedReach]], list[Span]]:
        """Of each reach what a law is fitted to; and about when each sets out and ends, if free."""
        if kind == WHOLE:
            spans = [each.span for own in self.whole for each in own]
            return [[each.seen for each in own] for own in self.whole], spans
        if kind == MEANS:
            return [[mean_of(list(own), self.arm)] for own in self.known], []
        return [list(own) for own in (self.known if kind == KNOWN else self.cut)], []


@dataclass(frozen=True, eq=False)
class Compared:
    """True weights and those by a law (n, 4), of each path; and how far these are from optima [cm]."""

    truth: Array
    found: Array
    rms_cm: float

    @property
    def r2(self) -> float:
        """Share of the variance of the true ones that is explained."""
        return explained(self.truth, self.found)


def laws_case(people: Sequence[Lawful], tick: Tick, say: Callable[[str], None]) -> dict[str, Any]:
    """Fit a law to the reaches of each person; how much of the true weights the laws explain.

    ``r2_truth`` is that of the person of whom least is explained: pooled over people (``r2_pooled``), how
    much people differ would count as explained.
    """
    found = {}
    for kind in (WHOLE, KNOWN, CUT, MEANS):
        compared = []
        for number, person in enumerate(people):
            say(f"fitting laws, reaches {kind}, person {number + 1} of {len(people)}")
            compared.append(compare(person, kind, tick))
        found[kind] = _pooled(compared)
    single = []
    for number, person in enumerate(people):
        say(f"explaining whole reaches one by one, person {number + 1} of {len(people)}")
        single.append(single_whole(person, tick))
    others = {kind: found[kind] for kind in (KNOWN, CUT, MEANS)}
    return {**found[WHOLE], **others, "r2_single_whole": min(single)}


def _pooled(compared: Sequence[Compared]) -> dict[str, Any]:
    truth, found = (
        np.concatenate([getattr(each, name) for each in compared]) for name in ("truth", "found")
    )
    each = [one.r2 for one in compared]
    return {
        "n": len(truth),
        "people": len(compared),
        "r2_truth": min(each),
        "r2_of_each": each,
        "r2_pooled": explained(truth, found),
        "rms_cm": float(np.mean([one.rms_cm for one in compared])),
    }


def compare(person: Lawful, kind: str, tick: Tick) -> Compared:
    """Fit a law to reaches of one person.

    Args:
        person: Whose.
        kind: What a law is fitted to.
        tick: Told how far it is.
    """
    seen, spans = person.reaches(kind)
    solver = ReachSolver(person.arm)
    every = [each for own in seen for each in own]
    which = [number for number, own in enumerate(seen) for _ in own]
    truth = [
        _true_weights(person.recorded[number], each, solver)
        for number, each in zip(which, every, strict=True)
    ]
    fitted = fit_law(lambda _: solver, every, alike=which, spans=spans, progress=tick)
    found = [fitted.law.alpha(*ends) for ends in mean_postures(every, which)]
    return Compared(np.array(truth), np.array(found), 100.0 * fitted.rms_m)


def single_whole(person: Lawful, tick: Tick) -> float:
    """Share of the variance of the true weights that is explained where each whole reach is, by itself.

    When it began and ended is taken from its speed, as `fit_ioc.py --whole` does; one of which no optimum
    is found counts as one that says nothing.

    Args:
        person: Whose reaches.
        tick: Told how far it is.
    """
    solver = ReachSolver(person.arm)
    seen = [(n, each.between) for n, own in enumerate(person.whole) for each in own]
    jobs = [Job(index, each, person.arm) for index, (_, each) in enumerate(seen)]
    outcomes = explain_all(jobs, workers=1, progress=tick)
    nothing = (1.0 / len(CHAPTER_2),) * len(CHAPTER_2)
    truth = [_true_weights(person.recorded[n], each, solver) for n, each in seen]
    return explained(truth, [each.alpha or nothing for each in outcomes])


def _true_weights(recorded: Recorded, seen: ObservedReach, solver: ReachSolver) -> Array:
    """True weights of a repetition: with the factors of the whole, or with those of what was cut out."""
    if not (seen.problem.v_start.any() or seen.problem.v_end.any()):
        return recorded.alpha
    factors = scaling_of(solver, seen.problem).factors
    return recorded.alpha_with(factors[indices_of(CHAPTER_2)])
