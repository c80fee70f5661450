"""What chapter 3 of the thesis found out about the mean reaches of 108 tasks, and about single people."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np
from scipy import stats

from hri_prediction.motor_control.analyses.discomfort import THREE, fit_discomfort
from hri_prediction.motor_control.analyses.table import ReachTable
from hri_prediction.motor_control.analyses.variance import independent
from hri_sim.motor_control.averaged import levels
from hri_sim.motor_control.chapter_2 import COMPOSITE, spread

TOP, BOTTOM = ("T1", "T4", "T7"), ("T3", "T6", "T9")


def errors(table: ReachTable) -> dict[str, Any]:
    """Distances of optima to the mean reaches (figure 3.5), with paired tests of the mix."""
    result: dict[str, Any] = {"n": len(table)}
    elsewhere = table.where(table.target != "T1")
    for name, rows, single, mixed in (
        ("hand_cm", table, table.single_cm, table.hand_cm),
        ("joint_deg", table, table.single_joint_deg, table.joint_deg),
        (
            "joint_deg_without_T1",
            elsewhere,
            elsewhere.single_joint_deg,
            elsewhere.joint_deg,
        ),
    ):
        alone = {cost: single[:, i] for i, cost in enumerate(rows.names)}
        result[name] = {cost: spread(values) for cost, values in alone.items()}
        result[name][COMPOSITE] = spread(mixed)
        result[f"{name}_p"] = {cost: _paired(mixed, values) for cost, values in alone.items()}
    return result


def _paired(mixed: np.ndarray, alone: np.ndarray) -> float | None:
    """Of a paired t-test; none with fewer than three pairs."""
    both = np.isfinite(mixed) & np.isfinite(alone)
    if both.sum() < 3:
        return None
    return float(stats.ttest_rel(mixed[both], alone[both]).pvalue)


def influences(table: ReachTable) -> dict[str, list[dict[str, Any]]]:
    """Analyses of variance of weights by starting angles and target (table 3.3)."""
    values = {name: table.alpha[:, i] for i, name in enumerate(table.names)}
    values["dynamic"] = table.dynamic
    factors = {k: v for k, v in levels(table).items() if len(set(v.tolist())) > 1}
    return {
        name: [asdict(effect) for effect in independent(share, factors)]
        for name, share in values.items()
        if np.ptp(share) > 0.0
    }


def heights(table: ReachTable) -> dict[str, Any]:
    """Dynamic share of reaches from P1 to low targets less that to high ones (figure 3.6)."""
    first = table.where(table.start == "P1")
    people = list(dict.fromkeys(first.person.tolist()))
    changes = {}
    for person in people:
        own = first.of([person])
        share = dict(zip(own.target.tolist(), own.dynamic.tolist(), strict=True))
        changes[person] = [
            share[bottom] - share[top]
            for top, bottom in zip(TOP, BOTTOM, strict=True)
            if top in share and bottom in share
        ]
    means = np.array([np.mean(each) for each in changes.values() if each])
    return {
        "changes": changes,
        "mean": float(means.mean()) if len(means) else None,
        "p": float(stats.ttest_1samp(means, 0.0).pvalue) if len(means) > 2 else None,
    }


def discomfort(table: ReachTable, rng: np.random.Generator) -> dict[str, Any]:
    """Discomfort of the three angles (eqs. 3.5 to 3.8)."""
    found = fit_discomfort(
        table.q_start, table.q_end, table.dynamic, THREE, rng, person=table.person, task=table.task
    )
    return {
        "beta": found.beta.tolist(),
        "r2": found.r2,
        "chance_r2": found.chance_r2,
        "p": found.p,
    }
