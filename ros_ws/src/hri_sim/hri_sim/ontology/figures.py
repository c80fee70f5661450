"""What splits come to: rates, matrices, and the figures that are reported."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from hri_prediction.ontology.evaluation import GROUPED, KINDS, Confusion, summed
from hri_sim.ontology.splits import (
    ALONE,
    INDIVIDUAL,
    LEFT_OUT,
    POSITION_OUT,
    POSITIONS,
    RANDOM,
    SESSIONS,
    SUBJECT,
    Split,
    read_confusion,
)

Told = Mapping[Split, Mapping[str, Any]]


def done(told: Told) -> Told:
    """What came of those splits that could be done."""
    return {split: content for split, content in told.items() if LEFT_OUT not in content}


def left_out(told: Told) -> list[str]:
    """Which kinds of splits could not be done, and why, a line each."""
    lines = [
        f"{split.kind}{', ' + split.who if split.who else ''}, {split.labels} ontology: "
        f"{content[LEFT_OUT]}"
        for split, content in told.items()
        if LEFT_OUT in content
    ]
    lines += [
        f"{split.kind}, {split.who}, {split.labels} ontology: nobody else did "
        f"{', '.join(map(str, content[ALONE]))}"
        for split, content in told.items()
        if content.get(ALONE)
    ]
    return list(dict.fromkeys(lines))


def matrices(told: Told) -> dict[str, dict[str, Confusion]]:
    """The confusion matrices of the full and the reduced ontology, by kind of split."""
    found: dict[str, dict[str, Confusion]] = {}
    for labels in (*KINDS, GROUPED):
        for kind in (RANDOM, SESSIONS, SUBJECT):
            parts = [
                read_confusion(content)
                for split, content in done(told).items()
                if split.kind == kind and split.labels == labels
            ]
            if parts:
                found.setdefault(labels, {})[kind] = summed(parts)
    return found


def overall_of(told: Told, labels: str, kind: str) -> list[float]:
    """How often segments are recognised, split by split."""
    return [
        read_confusion(content).overall
        for split, content in done(told).items()
        if split.kind == kind and split.labels == labels
    ]


def positions(told: Told) -> dict[str, Confusion]:
    """The confusion matrix of the first cases in each position."""
    found: dict[str, Confusion] = {}
    for split, content in done(told).items():
        if split.kind == POSITIONS:
            for name, part in content.items():
                one = read_confusion(part)
                found[name] = found[name] + one if name in found else one
    return found


def positions_out(told: Told) -> dict[str, Confusion]:
    """The confusion matrix of the first cases in each position, learnt in the others."""
    return {
        split.who: read_confusion(content)
        for split, content in sorted(done(told).items(), key=lambda item: item[0].who)
        if split.kind == POSITION_OUT
    }


def people(told: Told) -> list[Mapping[str, Any]]:
    """What is told of each person who did everything."""
    return [content for split, content in done(told).items() if split.kind == INDIVIDUAL]


def results(told: Told) -> dict[str, Any]:
    """The figures, as ``results.json`` has them; shares from 0 to 1."""
    found: dict[str, Any] = {}
    shown = matrices(told)
    for labels in KINDS:
        own = shown.get(labels, {})
        found[labels] = {
            "random": _rounded(own, RANDOM),
            "by_session": _rounded(own, SESSIONS),
            "by_subject": _rounded(own, SUBJECT),
            "classes": own[RANDOM].classes.tolist() if RANDOM in own else [],
            "rates_random": [_share(rate) for rate in own[RANDOM].rates] if RANDOM in own else [],
        }
    own = shown.get(GROUPED, {})
    found[GROUPED] = {"by_session": _rounded(own, SESSIONS), "by_subject": _rounded(own, SUBJECT)}
    apart = positions(told)
    numbers = next(iter(apart.values())).classes.tolist() if apart else []
    found["location_invariance"] = {
        f"case_{number}": {name: _share(one.rates[index]) for name, one in sorted(apart.items())}
        for index, number in enumerate(numbers)
    }
    found["position_left_out"] = {
        name: {f"case_{k}": _share(rate) for k, rate in zip(one.classes, one.rates, strict=True)}
        for name, one in positions_out(told).items()
    }
    found["left_out"] = left_out(told)
    everybody = people(told)
    found["subjects"] = [one["subject"] for one in everybody]
    found["intra"] = [_share(one["intra"]) for one in everybody]
    found["intra_range"] = [
        [_share(one["intra_least"]), _share(one["intra_most"])] for one in everybody
    ]
    for name in ("subject_vs_group", "group_vs_subject"):
        found[name] = [_share(one[name]) for one in everybody]
    return found


def _rounded(own: Mapping[str, Confusion], kind: str) -> float | None:
    return _share(own[kind].overall) if kind in own else None


def _share(value: float) -> float | None:
    return round(float(value), 4) if np.isfinite(value) else None
