"""One law of weights for each person: fitted to all of the reaches of one of their arms at once."""

from __future__ import annotations

import hashlib
import math
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import astuple, dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hri_prediction.errors import DataError, HriError
from hri_prediction.motor_control.batch import (
    PACKAGES,
    Outcome,
    compiled_models,
    correlated,
    made_with,
    prepare,
)
from hri_prediction.motor_control.collected import CollectedReach
from hri_prediction.motor_control.costs import JOINT_JERK
from hri_prediction.motor_control.law import FEATURES, FittedLaw, fit_law, mean_postures
from hri_prediction.motor_control.observed import ObservedReach
from hri_prediction.motor_control.ocp import ReachSolver
from hri_prediction.motor_control.results_table import markdown
from hri_prediction.motor_control.seen import are_repetitions
from hri_prediction.results.kept import keep, kept_file, read_kept
from hri_prediction.results.workers import do_all

Array = NDArray[np.float64]

WORK = "hri_prediction.motor_control.person_laws"
LEAST_REACHES = len(FEATURES) + 1
"""A law has so many parameters for each ratio of weights, and wants one more reach."""


@dataclass(frozen=True, eq=False)
class PersonLaw:
    """A law of one arm of a person.

    Attributes:
        person: Whose, and which arm.
        reaches: It was fitted to so many.
        fitted: The law.
        left_out: Names of reaches that it was not fitted to, as no optimum of them was found.
        postures: In which each task begins and ends on the average, (3,) and (3,) [rad]; reaches that are
            no repetitions of each other are there by their number.
    """

    person: str
    reaches: int
    fitted: FittedLaw
    postures: Mapping[str | int, tuple[Array, Array]]
    left_out: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class LawJob:
    """The reaches of one arm, to find its law.

    Attributes:
        person: Whose, and which arm.
        own: Its reaches.
        names: Costs.
        scaling: How costs are brought to one range.
    """

    person: str
    own: tuple[CollectedReach, ...]
    names: tuple[str, ...]
    scaling: str

    def key(self) -> str:
        """Stands for all that decides about the law but sources and versions."""
        digest = hashlib.sha256(repr((self.person, self.names, self.scaling)).encode())
        for each in self.own:
            whole = each.whole
            seen = each.observed if whole is None else whole.seen
            digest.update(repr((each.task, astuple(each.arm), whole and whole.span)).encode())
            digest.update(repr(seen.problem.duration).encode())
            for array in (seen.phases, seen.angles, seen.hand):
                digest.update(array.tobytes())
        return digest.hexdigest()


def law_or_error(job: LawJob) -> dict[str, Any]:
    """The law of an arm as plain values; ``error``: why there is none."""
    try:
        return to_mapping(person_law(job.person, job.own, job.names, job.scaling))
    except (HriError, np.linalg.LinAlgError) as error:
        return {"person": job.person, "error": str(error)}


def fit_person_laws(
    reaches: Sequence[CollectedReach],
    outcomes: Sequence[Outcome],
    names: tuple[str, ...],
    scaling: str,
    *,
    folder: Path,
    workers: int = 1,
    scheduler: str | None = None,
    progress: Callable[[int, int], None] = lambda done, of: None,
) -> tuple[list[dict[str, Any]], list[str]]:
    """Fit a law to the reaches of each arm that could be explained; arms are spread over workers.

    Args:
        reaches: Of all people.
        outcomes: What explains each, in the same order.
        names: Costs, joint jerk among them.
        scaling: How costs are brought to one range.
        folder: Laws that were found are kept there, and not found again.
        workers: Processes, when there is no scheduler.
        scheduler: Address of a Dask scheduler.
        progress: Called with arms done and their number.

    Returns:
        The laws as :func:`to_mapping` has them, and a line for each arm that has none. Reaches of one task
        that begin and end in nearly the same place are repetitions, which share their weights.

    Raises:
        ConfigError: what :func:`~hri_prediction.results.workers.do_all` refuses.
    """
    groups: dict[str, list[CollectedReach]] = defaultdict(list)
    for reach, outcome in zip(reaches, outcomes, strict=True):
        if not outcome.error:
            groups[reach.person].append(reach)
    jobs = {
        person: LawJob(person, tuple(own), names, scaling) for person, own in sorted(groups.items())
    }
    files = {
        person: kept_file(folder, WORK, PACKAGES, repr((job.key(), compiled_models())))
        for person, job in jobs.items()
    }
    found = {person: law for person, file in files.items() if (law := read_kept(file)) is not None}
    progress(len(found), len(jobs))
    results = do_all(
        law_or_error,
        [job for person, job in jobs.items() if person not in found],
        workers=workers,
        scheduler=scheduler,
        prepare=partial(prepare, tuple({each.arm.convention for each in reaches})),
        computed_with=made_with,
    )
    with closing(results):
        for law in results:
            found[law["person"]] = law
            if "error" not in law:
                keep(files[law["person"]], law)
            progress(len(found), len(jobs))
    laws = [found[person] for person in jobs]
    return (
        [law for law in laws if "error" not in law],
        [f"{law['person']}: {law['error']}" for law in laws if "error" in law],
    )


def person_law(
    person: str,
    own: Sequence[CollectedReach],
    names: tuple[str, ...],
    scaling: str,
) -> PersonLaw:
    """Fit a law to the reaches of one arm.

    When reaches begin and end is found along with it where all are known to go from rest to rest.

    Args:
        person: Whose, and which arm.
        own: At least one; all have the same model of the arm.
        names: Costs, joint jerk among them.
        scaling: How costs are brought to one range.

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
    )
    return PersonLaw(
        person,
        len(own) - len(fitted.left_out),
        fitted,
        dict(zip(alike, mean_postures(seen, alike), strict=True)),
        tuple(seen[number].name for number in fitted.left_out),
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
        "left_out": list(one.left_out),
        "features": list(FEATURES),
        "theta": one.fitted.law.theta.tolist(),
        "theta_sd": [
            [value if math.isfinite(value) else None for value in row]
            for row in one.fitted.theta_sd.tolist()
        ],
        "rms_cm": 100.0 * one.fitted.rms_m,
        "steps": one.fitted.steps,
        "converged": one.fitted.converged,
        "tasks": tasks,
    }


def law_lines(
    laws: Sequence[Mapping[str, Any]], left_out: Sequence[str], *, whole: bool
) -> list[str]:
    """The part of the report on laws.

    Args:
        laws: Of each arm, as :func:`to_mapping` has it.
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
        rows = [(one["person"], str(one["reaches"]), f"{one['rms_cm']:.2f}") for one in laws]
        text += [
            "log of a weight by that of joint jerk = θ · [1, q_start, q_end], one θ for all reaches of an "
            "arm (in results.json, with standard deviations); repetitions of a task share their weights. "
            "Distance: root mean square of all samples to the optima of the law, at the same time.\n",
            markdown(("arm", "reaches", "distance [cm]"), rows),
        ]
    text += [
        f"- the law of {one['person']} leaves out {name}: no optimum of it was found"
        for one in laws
        for name in one["left_out"]
    ]
    text += [
        f"- the law of {one['person']} was still getting better after {one['steps']} steps"
        for one in laws
        if not one["converged"]
    ]
    text += [f"- no law of {line}" for line in left_out]
    return [*text, ""]
