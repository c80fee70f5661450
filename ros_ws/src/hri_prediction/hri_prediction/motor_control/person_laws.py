"""One law of weights for each person: fitted to all of the reaches of one of their arms at once."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hri_prediction.errors import DataError, HriError
from hri_prediction.motor_control.batch import Outcome, correlated
from hri_prediction.motor_control.collected import CollectedReach
from hri_prediction.motor_control.costs import JOINT_JERK
from hri_prediction.motor_control.law import FEATURES, FittedLaw, fit_law, mean_postures
from hri_prediction.motor_control.observed import ObservedReach
from hri_prediction.motor_control.ocp import ReachSolver
from hri_prediction.motor_control.results_table import markdown
from hri_prediction.motor_control.seen import are_repetitions

Array = NDArray[np.float64]

LEAST_REACHES = len(FEATURES) + 1
"""A law has so many parameters for each ratio of weights, and wants one more reach."""


@dataclass(frozen=True, eq=False)
class PersonLaw:
    """A law of one arm of a person.

    Attributes:
        person: Whose, and which arm.
        reaches: It was fitted to so many.
        fitted: The law.
        postures: In which each task begins and ends on the average, (3,) and (3,) [rad]; reaches that are
            no repetitions of each other are there by their number.
    """

    person: str
    reaches: int
    fitted: FittedLaw
    postures: Mapping[str | int, tuple[Array, Array]]


def fit_person_laws(
    reaches: Sequence[CollectedReach],
    outcomes: Sequence[Outcome],
    names: tuple[str, ...],
    scaling: str,
    progress: Callable[[int, int], None] = lambda done, of: None,
) -> tuple[list[PersonLaw], list[str]]:
    """Fit a law to the reaches of each arm that could be explained.

    Args:
        reaches: Of all people.
        outcomes: What explains each, in the same order.
        names: Costs, joint jerk among them.
        scaling: How costs are brought to one range.
        progress: Called with steps done and their number, arm by arm.

    Returns:
        The laws, and a line for each arm that has none. Reaches of one task that begin and end in nearly
        the same place are repetitions, which share their weights.

    Raises:
        ConfigError: without joint jerk, or with one cost alone.
    """
    groups: dict[str, list[CollectedReach]] = defaultdict(list)
    for reach, outcome in zip(reaches, outcomes, strict=True):
        if not outcome.error:
            groups[reach.person].append(reach)
    found, left_out = [], []
    for person, own in sorted(groups.items()):
        try:
            found.append(person_law(person, own, names, scaling, progress))
        except (HriError, np.linalg.LinAlgError) as error:
            left_out.append(f"{person}: {error}")
    return found, left_out


def person_law(
    person: str,
    own: Sequence[CollectedReach],
    names: tuple[str, ...],
    scaling: str,
    progress: Callable[[int, int], None] = lambda done, of: None,
) -> PersonLaw:
    """Fit a law to the reaches of one arm.

    When reaches begin and end is found along with it where all are known to go from rest to rest.

    Args:
        person: Whose, and which arm.
        own: At least one; all have the same model of the arm.
        names: Costs, joint jerk among them.
        scaling: How costs are brought to one range.
        progress: Called with steps done and their number.

    Raises:
        ConfigError: without joint jerk, or with one cost alone.
        DataError: too few different reaches.
        NotConverged: the lower level was not solved.
    """
    alike = _alike(own)
    if len(set(alike)) < LEAST_REACHES:
        raise DataError(f"{len(set(alike))} different reaches, a law needs {LEAST_REACHES}")
    solver = ReachSolver(own[0].arm)
    wholes = [each.whole for each in own if each.whole is not None]
    free = len(wholes) == len(own)
    seen = [each.seen for each in wholes] if free else [each.observed for each in own]
    fitted = fit_law(
        lambda _: solver,
        seen,
        names,
        spans=[each.span for each in wholes] if free else (),
        scaling=scaling,
        correlated=float(np.median([correlated(each) for each in seen])),
        alike=alike,
        progress=progress,
    )
    return PersonLaw(
        person, len(own), fitted, dict(zip(alike, mean_postures(seen, alike), strict=True))
    )


def _alike(own: Sequence[CollectedReach]) -> list[str | int]:
    """What reach each one is: its task, where all of a task begin and end in nearly the same place."""
    groups: dict[str, list[ObservedReach]] = defaultdict(list)
    for each in own:
        groups[each.task].append(each.observed)
    repeated = {task for task, seen in groups.items() if are_repetitions(seen)}
    return [each.task if each.task in repeated else n for n, each in enumerate(own)]


def to_mapping(one: PersonLaw) -> dict[str, Any]:
    """For the file of results: theta, and weights of each task as logarithms of ratios to joint jerk's.

    Both with standard deviations, a row a cost but joint jerk; those of theta are null where reaches say
    nothing of it.
    """
    law = one.fitted.law
    reference = law.names.index(JOINT_JERK)
    tasks = []
    for task, ends in one.postures.items():
        weights = np.log(law.alpha(*ends))
        tasks.append(
            {
                "task": task if isinstance(task, str) else None,
                "q_start_deg": np.degrees(ends[0]).tolist(),
                "q_end_deg": np.degrees(ends[1]).tolist(),
                "logs": np.delete(weights - weights[reference], reference).tolist(),
                "log_sd": one.fitted.log_sd(*ends).tolist(),
            }
        )
    return {
        "person": one.person,
        "reaches": one.reaches,
        "features": list(FEATURES),
        "theta": one.fitted.law.theta.tolist(),
        "theta_sd": [
            [value if math.isfinite(value) else None for value in row]
            for row in one.fitted.theta_sd.tolist()
        ],
        "rms_cm": 100.0 * one.fitted.rms_m,
        "steps": one.fitted.steps,
        "tasks": tasks,
    }


def law_lines(laws: Sequence[PersonLaw], left_out: Sequence[str], *, whole: bool) -> list[str]:
    """The part of the report on laws.

    Args:
        laws: Of each arm.
        left_out: A line for each arm that has none.
        whole: Whether they are of reaches from rest to rest.
    """
    text = ["## Laws of weights\n"]
    if laws and not whole:
        text += [
            "**These reaches were cut at 5 % of their peak speed: their paths are explained, but of the "
            "true weights such a law says nothing (docs/motor_control.md). Use --whole where people rest "
            "before and after each reach.**\n"
        ]
    if laws:
        rows = [(one.person, str(one.reaches), f"{100.0 * one.fitted.rms_m:.2f}") for one in laws]
        text += [
            "log of a weight by that of joint jerk = θ · [1, q_start, q_end], one θ for all reaches of an "
            "arm (in results.json, with standard deviations); repetitions of a task share their weights. "
            "Distance: root mean square of all samples to the optima of the law, at the same time.\n",
            markdown(("arm", "reaches", "distance [cm]"), rows),
        ]
    text += [f"- no law of {line}" for line in left_out]
    return [*text, ""]
