"""A session on disk, saved after each trial: a break costs no more than the trial that was under way.

All that a session goes on from is in one file, ``session.npz``. ``trials.csv`` and ``policy.npz`` are for
people and other programs, and nothing is read back from them. All three are written beside their places
and brought to the disk, and only then put there, ``session.npz`` last: whenever a process is killed, each
file is as before or as after, and a session that is over has left its policy. A folder is that of one
process.
"""

from __future__ import annotations

import csv
import json
import math
import os
import reprlib
from collections.abc import Mapping
from dataclasses import asdict, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hri_planner.dmp.model_file import save_dmp
from hri_planner.dmp.policy import DmpPolicy
from hri_planner.pibb.costs import TERM_NAMES, Terms
from hri_planner.pibb.experiment import Experiment
from hri_planner.pibb.experiment_file import experiment_of, to_mapping
from hri_planner.pibb.session import Result, Session, State, Trial, generator_of, result_of, row_of
from hri_prediction.errors import DataError, HriError, cut
from hri_prediction.files.whole import write_whole
from hri_prediction.promp.storage import read_npz, write_npz

FloatArray = NDArray[np.float64]

FORMAT = "hri-trials-1"
SESSION, TRIALS, POLICY = "session.npz", "trials.csv", "policy.npz"
COLUMNS = tuple(row_of(Result(Trial(0, 0, "", 0), "", Terms(*[0.0] * len(TERM_NAMES)), 0.0, 0.0)))
"""Of ``trials.csv``."""

# What values of a wrong kind make of the header's reading.
_UNUSABLE = (HriError, ArithmeticError, AttributeError, LookupError, TypeError, ValueError)


def save_session(
    folder: Path,
    session: Session,
    *,
    person: str,
    seed: int,
    commit: str = "",
    begun: str = "",
) -> None:
    """Save a session, its trials and its mean policy.

    Args:
        folder: Where to; made if it is not there.
        session: What to save.
        person: Whose trials these are.
        seed: What all random numbers began with.
        commit: Of the code at work, if known; the policy's file names it.
        begun: Mark of the policy that it began with, see :func:`hri_planner.pibb.beginning.mark_of`.

    Raises:
        DataError: when the session's generator is not a PCG64.
        HriError: when files cannot be written; those that were there are as they were.
    """
    experiment, state = session.experiment, session.state
    policy, names = state.policy, list(state.policy.names)
    rows = [_plain(row_of(result)) for result in state.results]
    header = {
        "format": FORMAT,
        "person": person,
        "seed": int(seed),
        "commit": commit,
        "experiment": to_mapping(experiment),
        "begun": begun,
        "goals": names,
        "duration": float(policy.duration),
        "update": int(state.update),
        "changed": list(state.changes),
        "order": [[goal, int(sample)] for goal, sample in state.order],
        "costs": {
            goal: [[int(sample), float(cost)] for sample, cost in own.items()]
            for goal, own in state.costs.items()
        },
        "units": {goal: _plain(asdict(terms)) for goal, terms in state.units.items()},
        "results": rows,
        "rng": _checked_rng(state.rng),
    }
    # One array each: they keep their order in memory, on which the last bits of products depend.
    arrays = {"start": policy.start, "posture": policy.posture}
    arrays |= {f"goal_{index}": policy.goals[name] for index, name in enumerate(names)}
    arrays |= {f"weights_{index}": policy.weights[name] for index, name in enumerate(names)}
    arrays |= {f"changes_{index}": own for index, own in enumerate(state.changes.values())}
    arrays |= {f"late_{index}": state.late[name] for index, name in enumerate(names) if state.late}
    arrays = {name: np.asarray(values, dtype=float) for name, values in arrays.items()}
    best = learnt_policy(session)
    learnt = learnt_in(session, person=person, seed=seed, commit=commit)
    folder = Path(folder)
    write_whole(
        {
            folder / TRIALS: lambda path: _write_rows(path, rows),
            folder / POLICY: lambda path: save_dmp(path, best, learnt),
            folder / SESSION: lambda path: write_npz(path, arrays, header),
        }
    )


def load_session(folder: Path) -> tuple[Session, dict[str, Any]]:
    """A session that goes on as if it had never been broken off, and the header of its file.

    The header says ``person``, ``seed`` and ``commit``, among others.

    Raises:
        DataError: when there is none, or the file is damaged, of another format, or holds what cannot be
            used.
    """
    path = Path(folder) / SESSION
    if not os.path.exists(path):
        raise DataError(f"no session in {folder}", expected=f"a folder with {SESSION}")
    arrays, header = read_npz(path, FORMAT)
    try:
        session = _session_of(arrays, header)
    except _UNUSABLE as error:
        text = cut(" ".join(str(error).split()), 1000)
        said = text if isinstance(error, HriError) else f"{type(error).__name__}: {text}"
        raise DataError(f"{path} holds what cannot be used: {said}") from error
    return session, header


def learnt_policy(session: Session) -> DmpPolicy:
    """What has been learnt so far: the mean of the policies that are averaged, or the present one."""
    state, plan = session.state, session.experiment.improvement
    if not state.late:
        return state.policy
    count = state.update - plan.first_averaged
    return replace(state.policy, weights={goal: own / count for goal, own in state.late.items()})


def learnt_in(session: Session, *, person: str, seed: int, commit: str = "") -> dict[str, Any]:
    """How what a session has learnt came about, for the header of its file.

    ``costs`` are the means over all trials of each update that is over, explored ones included; the first
    and the last of them have names of their own, and are none before the first update. ``averaged`` says
    of how many updates the policy is the mean.
    """
    state, plan = session.state, session.experiment.improvement
    by_update: dict[int, list[float]] = {}
    for result in state.results:
        if 0 <= result.trial.update < state.update:
            by_update.setdefault(result.trial.update, []).append(float(result.cost))
    costs = [float(np.mean(by_update[update])) for update in sorted(by_update)]
    return {
        "experiment": session.experiment.name,
        "person": person,
        "seed": int(seed),
        "updates": int(max(state.update, 0)),
        "averaged": int(max(state.update - plan.first_averaged, min(state.update, 1), 0)),
        "trials": len(state.results),
        "costs": costs,
        "cost_first": costs[0] if costs else None,
        "cost_last": costs[-1] if costs else None,
        "saved": datetime.now(UTC).isoformat(timespec="seconds"),
        "commit": commit,
    }


def _write_rows(path: Path, rows: list[dict[str, Any]]) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        table = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        table.writeheader()
        table.writerows(rows)


def _plain(values: Mapping[str, Any]) -> dict[str, Any]:
    """With numbers that JSON holds."""
    return {name: v if isinstance(v, str | int) else float(v) for name, v in values.items()}


def _checked_rng(rng: dict[str, Any]) -> dict[str, Any]:
    """A state that a generator takes, and JSON holds."""
    try:
        taken = dict(generator_of(rng).bit_generator.state)
        json.dumps(taken)
    except (ArithmeticError, LookupError, TypeError, ValueError) as error:
        raise DataError(f"state of the generator: {error}", expected="that of a PCG64") from error
    if taken != rng:
        raise DataError(f"state of the generator {reprlib.repr(rng)}", expected="that of a PCG64")
    return taken


def _session_of(arrays: Mapping[str, Any], header: Mapping[str, Any]) -> Session:
    """Raises any of ``_UNUSABLE`` when something does not fit."""
    experiment = experiment_of(_of(header, "experiment", dict))
    if not isinstance(header.get("person"), str) or type(header.get("seed")) is not int:
        raise DataError("no person or no seed", expected="who and which")
    names = _of(header, "goals", list)
    policy = DmpPolicy(
        _array(arrays, "start"),
        _array(arrays, "posture"),
        {name: _array(arrays, f"goal_{index}") for index, name in enumerate(names)},
        {name: _array(arrays, f"weights_{index}") for index, name in enumerate(names)},
        _of(header, "duration", float),
    )
    changed = _of(header, "changed", list)
    state = State(
        policy=policy,
        update=_of(header, "update", int),
        changes={name: _array(arrays, f"changes_{index}") for index, name in enumerate(changed)},
        order=tuple((str(goal), int(sample)) for goal, sample in _of(header, "order", list)),
        costs={
            goal: {int(sample): float(cost) for sample, cost in own}
            for goal, own in _of(header, "costs", dict).items()
        },
        units={
            goal: Terms(**{name: float(own[name]) for name in TERM_NAMES})
            for goal, own in _of(header, "units", dict).items()
        },
        results=tuple(result_of(row) for row in _of(header, "results", list)),
        rng=_checked_rng(_of(header, "rng", dict)),
        late={name: _array(arrays, f"late_{index}") for index, name in enumerate(names)}
        if "late_0" in arrays
        else {},
    )
    _check(experiment, state)
    return Session(experiment, state)


def _check(experiment: Experiment, state: State) -> None:
    """Whether the parts fit together, so that no trial runs into what is not there."""
    goals, plan = set(experiment.goals), experiment.improvement
    count = plan.rollouts
    learning = 0 <= state.update < plan.updates
    weights = state.policy.weights
    fitting = {
        "goals": set(weights) == goals,
        "update": -1 <= state.update <= plan.updates,
        "order": bool(state.order) == (state.update < plan.updates)
        and all(goal in goals for goal, _ in state.order)
        and all(0 <= sample < (count if learning else 1) for _, sample in state.order),
        "changed": set(state.changes) == (set(weights) if learning else set())
        and all(
            own.shape == (count, *weights[goal].shape) and bool(np.isfinite(own).all())
            for goal, own in state.changes.items()
        ),
        "costs": set(state.costs) <= goals
        and (learning or not state.costs)
        and all(
            0 <= sample < count and math.isfinite(cost)
            for own in state.costs.values()
            for sample, cost in own.items()
        ),
        "late": set(state.late)
        == (goals if plan.first_averaged < state.update < plan.updates else set())
        and all(
            own.shape == weights[goal].shape and bool(np.isfinite(own).all())
            for goal, own in state.late.items()
        ),
        "units": set(state.units) == (set() if state.update < 0 else goals)
        and all(0.0 < v < np.inf for own in state.units.values() for v in asdict(own).values()),
        "results": [result.trial.number for result in state.results]
        == list(range(len(state.results)))
        and all({one.trial.goal, one.guess} <= goals for one in state.results),
    }
    wrong = ", ".join(name for name, fits in fitting.items() if not fits)
    if wrong:
        raise DataError(f"of experiment {experiment.name!r}, {wrong}", expected="what fits it")
    for result in state.results:
        result.terms.check()


def _of(header: Mapping[str, Any], name: str, kind: type[Any]) -> Any:
    value = header.get(name)
    if type(value) is not kind:
        raise DataError(f"{name} = {reprlib.repr(value)}", expected=f"a {kind.__name__}")
    return value


def _array(arrays: Mapping[str, Any], name: str) -> FloatArray:
    values: FloatArray | None = arrays.get(name)
    if values is None or values.dtype != np.float64:
        raise DataError(f"no array {name} of numbers", expected="a whole file")
    return values
