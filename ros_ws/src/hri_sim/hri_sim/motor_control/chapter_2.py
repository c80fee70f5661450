"""What chapter 2 of the thesis found out about 1215 reaches, found out about ours: plain numbers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hri_prediction.motor_control.analyses.behaviour import among_people, correlation, posture_space
from hri_prediction.motor_control.analyses.discomfort import FORMS, SIX, Discomfort, fit_discomfort
from hri_prediction.motor_control.analyses.selection import model_of
from hri_prediction.motor_control.analyses.table import ReachTable
from hri_prediction.motor_control.analyses.variance import complete, repeated_measures
from hri_prediction.motor_control.arm_model import ArmModel
from hri_prediction.motor_control.batch import correlated
from hri_prediction.motor_control.costs import (
    CHAPTER_2,
    ENERGY,
    JOINT_JERK,
    KINEMATIC,
    TORQUE_CHANGE,
    shares,
)
from hri_prediction.motor_control.ioc import Explanation, explain
from hri_prediction.motor_control.observed import ObservedReach, of_angles
from hri_prediction.motor_control.ocp import NotConverged, ReachSolver
from hri_prediction.motor_control.problem import ReachProblem

Array = NDArray[np.float64]
Tick = Callable[[int, int], None]

COMPOSITE = "composite"
POOLED_SPAN, PERSON_SPAN = 0.01, 0.05
"""Spans of the thesis' smoothing of all reaches, and of those of one person."""
MODELS = ((JOINT_JERK, TORQUE_CHANGE), (JOINT_JERK, TORQUE_CHANGE, ENERGY), CHAPTER_2)
"""The models of 2, 3 and 4 costs that the thesis compared."""
_Z = 1.959964


def spread(values: Array) -> dict[str, float | None]:
    """Mean and standard deviation of what is finite."""
    good = values[np.isfinite(values)]
    if not len(good):
        return {"mean": None, "sd": None}
    return {"mean": float(good.mean()), "sd": float(good.std())}


def behaviour(table: ReachTable, rng: np.random.Generator) -> dict[str, Any]:
    """Durations, speeds and end points (tables 2.3 and 2.4, section 2.3.1); people are drawn by rng."""
    first = table.where(table.start == table.start[0])
    people = list(dict.fromkeys(table.person.tolist()))
    quantities = {
        "duration": table.duration_s,
        "mean speed": table.mean_speed,
        "peak speed": table.peak_speed,
    }
    ends = {
        **{f"{axis}": table.end_m[:, i] for i, axis in enumerate("xyz")},
        **{f"q{i + 1} at the end": table.q_end[:, i] for i in range(3)},
    }
    return {
        "from_first": {
            target: {
                "duration_s": spread(first.duration_s[first.target == target]),
                "distance_m": spread(first.length_m[first.target == target]),
                "mean_speed": spread(first.mean_speed[first.target == target]),
                "peak_speed": spread(first.peak_speed[first.target == target]),
            }
            for target in dict.fromkeys(first.target.tolist())
        },
        "correlations": {
            name: {
                "pooled": asdict(among_people(table.length_m, values, table.person, rng)),
                "people": {
                    person: correlation(
                        table.length_m[table.person == person], values[table.person == person]
                    )
                    for person in people
                },
            }
            for name, values in quantities.items()
        },
        "anova": {name: two_way(table, values) for name, values in quantities.items()},
        "ends": {
            target: {
                name: one_way(table, values, table.target == target)
                for name, values in ends.items()
            }
            for target in dict.fromkeys(table.target.tolist())
        },
    }


def two_way(table: ReachTable, values: Array) -> list[dict[str, Any]] | None:
    """Start and target, of people who have all; none where fewer than two have."""
    keep = complete(table.person, [table.start, table.target], values)
    if len(set(table.person[keep].tolist())) < 2:
        return None
    factors = {"start": table.start[keep], "target": table.target[keep]}
    return [asdict(e) for e in repeated_measures(values[keep], table.person[keep], factors)]


def one_way(table: ReachTable, values: Array, rows: NDArray[np.bool_]) -> dict[str, Any]:
    """Start alone, of the reaches to one target."""
    found = repeated_measures(values[rows], table.person[rows], {"start": table.start[rows]})
    return asdict(found[0])


def errors(table: ReachTable) -> dict[str, Any]:
    """Distances of optima to what was seen: each cost alone, and the mix (figure 2.7)."""
    result: dict[str, Any] = {}
    for name, single, mixed in (
        ("hand_cm", table.single_cm, table.hand_cm),
        ("joint_deg", table.single_joint_deg, table.joint_deg),
    ):
        alone = {cost: single[:, i] for i, cost in enumerate(table.names)}
        result[name] = {cost: spread(values) for cost, values in alone.items()}
        result[name][COMPOSITE] = spread(mixed)
        result[f"{name}_anova"] = {
            cost: _beside(table, mixed, values) for cost, values in alone.items()
        }
    best = np.nanmin(np.where(np.isfinite(table.single_cm), table.single_cm, np.inf), axis=1)
    result["not_worse"] = int((table.hand_cm <= best + 1e-9).sum())
    result["n"] = len(table)
    return result


def _beside(table: ReachTable, mixed: Array, alone: Array) -> dict[str, Any] | None:
    """Repeated measures of each person's mean with the mix and with one cost."""
    people = dict.fromkeys(table.person.tolist())
    rows: list[tuple[str, str, float]] = []
    for person in people:
        own = (table.person == person) & np.isfinite(mixed) & np.isfinite(alone)
        if own.any():
            rows += [
                (person, "mix", float(mixed[own].mean())),
                (person, "alone", float(alone[own].mean())),
            ]
    if len(rows) < 4:
        return None
    who, model, values = zip(*rows, strict=True)
    effects = repeated_measures(np.array(values), np.array(who), {"model": np.array(model)})
    return asdict(effects[0])


def contributions(table: ReachTable) -> dict[str, Any]:
    """Mean weights, and what they depend on (section 2.3.2)."""
    groups = {name: table.alpha[:, i] for i, name in enumerate(table.names)}
    groups |= {"dynamic": table.dynamic, "kinematic": shares(table.alpha, table.names, KINEMATIC)}
    return {
        name: {**spread(values), "anova": two_way(table, values)}
        for name, values in groups.items()
        if name != "kinematic"
    } | {"kinematic": spread(groups["kinematic"])}


def recovery(table: ReachTable) -> dict[str, Any]:
    """How near weights are to the true ones, and whether their intervals say so."""
    apart = table.alpha - table.truth
    inside = np.abs(apart) <= _Z * table.sd
    free = table.alpha > 0.0
    truth = table.truth - table.truth.mean(axis=0)
    dynamic = shares(table.truth, table.names, ("torque_change", "energy"))
    return {
        "median_largest_error": float(np.median(np.abs(apart).max(axis=1))),
        "r2": 1.0 - float(np.square(apart).sum() / np.square(truth).sum()),
        "covered_95": float(inside[free].mean()),
        "share_at_zero": float((~free).mean()),
        "dynamic_correlation": correlation(table.dynamic, dynamic),
    }


def components(table: ReachTable) -> dict[str, Any]:
    """Principal components of the postures (figure 2.8)."""
    space = posture_space(table)
    return {
        "ratios": space.ratios.tolist(),
        "first_three": float(space.ratios[:3].sum()),
        "correlation_with_dynamic": [
            correlation(space.scores[:, i], table.dynamic) for i in range(3)
        ],
    }


def discomfort(table: ReachTable, rng: np.random.Generator, tick: Tick) -> dict[str, Any]:
    """How much of the share of dynamic costs discomfort explains (figure 2.9, eq. 3.8)."""
    people = list(dict.fromkeys(table.person.tolist()))
    count = len(FORMS) + len(people) + 1
    result: dict[str, Any] = {}
    for number, form in enumerate(FORMS):
        found = fit_discomfort(
            table.q_start,
            table.q_end,
            table.dynamic,
            form,
            rng,
            person=table.person,
            task=table.task,
            smoothing=POOLED_SPAN,
        )
        result[form] = _plain(found)
        tick(number + 1, count)
    known = np.isfinite(table.truth).all(axis=1)
    if known.all():
        truth = shares(table.truth, table.names, ("torque_change", "energy"))
        found = fit_discomfort(
            table.q_start, table.q_end, truth, SIX, rng, person=table.person, task=table.task
        )
        result["truth_r2"], result["truth_chance_r2"] = found.r2, found.chance_r2
    result["people"] = {}
    for number, person in enumerate(people):
        own = table.of([person])
        found = fit_discomfort(
            own.q_start, own.q_end, own.dynamic, SIX, rng, task=own.task, smoothing=PERSON_SPAN
        )
        result["people"][person] = _plain(found)
        tick(len(FORMS) + number + 2, count)
    return result


def _plain(found: Discomfort) -> dict[str, Any]:
    return {
        "beta": found.beta.tolist(),
        "slope": found.slope,
        "offset": found.offset,
        "r2": found.r2,
        "chance_r2": found.chance_r2,
        "p": found.p,
        "smoothed_r2": found.smoothed_r2 if np.isfinite(found.smoothed_r2) else None,
        "smoothed_chance_r2": (
            found.smoothed_chance_r2 if np.isfinite(found.smoothed_chance_r2) else None
        ),
    }


def models(
    table: ReachTable, arm: ArmModel, tick: Tick, choices: Sequence[Sequence[str]] = MODELS
) -> list[dict[str, Any]]:
    """Models of two, three and four costs for the reaches of one person (section 2.3.2).

    Args:
        table: Of that person.
        arm: The person's, as they were explained with.
        tick: Called with what is done, and how much there is.
        choices: Costs of each model.
    """
    solver = ReachSolver(arm)
    reaches = [
        of_angles(
            ReachProblem.moving(
                table.q_start[i],
                table.q_end[i],
                table.duration_s[i],
                table.v_start[i],
                table.v_end[i],
            ),
            table.angles[i],
            arm,
        )
        for i in range(len(table))
    ]
    by_model: list[list[Explanation | None]] = []
    for number, names in enumerate(choices):
        by_model.append([])
        for i, reach in enumerate(reaches):
            by_model[-1].append(_tried(solver, reach, tuple(names)))
            tick(number * len(reaches) + i + 1, len(choices) * len(reaches))
    # Models are compared by the reaches that all of them explain.
    common = [i for i in range(len(reaches)) if all(row[i] is not None for row in by_model)]
    seen = [reaches[i] for i in common]
    shared = [correlated(reach) for reach in seen]
    found = [
        model_of(seen, [each for i in common if (each := row[i]) is not None], shared)
        for row in by_model
    ]
    return [asdict(model) for model in found]


def _tried(solver: ReachSolver, reach: ObservedReach, names: tuple[str, ...]) -> Explanation | None:
    """What explains a reach; none where no optimum is found."""
    try:
        return explain(solver, reach, names)
    except NotConverged:
        return None
