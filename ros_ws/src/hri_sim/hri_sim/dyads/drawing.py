"""Who the two people of a dyad are, and what they do: drawn at random."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hri_sim.dyads.hands import LAWS, Reaches
from hri_sim.dyads.setups import DyadSetup

FloatArray = NDArray[np.float64]

SCATTER_M = 0.006
"""How far from a place hands rest, standard deviation on each axis."""

_ONSET_SPREAD_S = 0.6
_SECONDS_A_METRE = 0.9
_LEAST_DURATION_S = 0.65


@dataclass(frozen=True)
class PersonFactors:
    """In what people differ from each other.

    Attributes:
        pace: Factor on durations.
        gain: Of the push [m²/s²].
        patience: How much the other's nearness slows them down, 0 to 1.
        delay: Reaction time [s].
        lift: Height of paths as a share of their length.
        noise: Of accelerations, relative.
    """

    pace: float
    gain: float
    patience: float
    delay: float
    lift: float
    noise: float


def draw_person(rng: np.random.Generator) -> PersonFactors:
    """Somebody."""
    return PersonFactors(
        pace=float(np.exp(0.08 * rng.standard_normal())),
        gain=float(rng.uniform(0.15, 0.35)),
        patience=float(rng.uniform(0.2, 0.6)),
        delay=float(rng.uniform(0.12, 0.20)),
        lift=float(rng.uniform(0.10, 0.22)),
        noise=float(rng.uniform(0.02, 0.06)),
    )


def draw_reaches(setup: DyadSetup, count: int, rng: np.random.Generator) -> Reaches:
    """Pairs of reaches in a setup, the same two people throughout.

    Forward reaches go from a home to a target or from target to target, backward ones back home; each
    of both does either. The partner sets off up to 0.6 s before or after the learner.
    """
    people = (draw_person(rng), draw_person(rng))
    start, goal = np.empty((count, 2, 3)), np.empty((count, 2, 3))
    for row in range(count):
        for person in range(2):
            places = setup.places[person]
            begin, end = rng.choice(len(places), 2, replace=False)
            start[row, person], goal[row, person] = places[begin], places[end]
    scatter = SCATTER_M * rng.standard_normal((2, count, 2, 3))
    return reaches_between(people, start + scatter[0], goal + scatter[1], rng)


def reaches_between(
    people: Sequence[PersonFactors], start: FloatArray, goal: FloatArray, rng: np.random.Generator
) -> Reaches:
    """How two people make some pairs of reaches.

    Args:
        people: Learner and partner.
        start: Hands before (n, 2, 3) [m].
        goal: Where they go (n, 2, 3) [m].
        rng: Draws when they set off, and what differs from time to time.
    """
    count = len(start)
    length = np.linalg.norm(goal - start, axis=2)
    pace = np.array([person.pace for person in people]) * np.exp(
        0.05 * rng.standard_normal((count, 2))
    )
    onset = np.stack(
        (np.zeros(count), rng.uniform(-_ONSET_SPREAD_S, _ONSET_SPREAD_S, count)), axis=1
    )

    def of_each(name: str) -> FloatArray:
        return np.tile([getattr(person, name) for person in people], (count, 1))

    return Reaches(
        start=start,
        goal=goal,
        onset=onset - onset.min(axis=1, keepdims=True),
        duration=pace * (_LEAST_DURATION_S + _SECONDS_A_METRE * length),
        lift=of_each("lift") * np.exp(0.2 * rng.standard_normal((count, 2))),
        gain=of_each("gain"),
        patience=of_each("patience"),
        delay=of_each("delay"),
        noise=of_each("noise"),
        law=np.full((count, 2), LAWS.index("push")),
        bow=np.zeros((count, 2, 3)),
    )
