"""Where two people sit, and between which places they reach.

A setup is a table between two people: opposite each other, at a corner, or side by side. Each has a
home in front of the body and targets further on; those of both lie in the same region, so that many
pairs of reaches cross.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

ARRANGEMENTS = {"opposite": math.pi, "corner": 0.5 * math.pi, "beside": 0.0}
"""Where the partner sits, seen from the middle of the table: angle from the learner's seat [rad]."""

TARGETS = 4
"""Of each person, besides the home."""

_SEAT_M = 0.55
_SPREAD_RAD = 0.35
_HOME_M = (0.28, 0.36)
_REGION_M = (0.24, 0.20, 0.13)
_LEAST_WAY_M = 0.22


@dataclass(frozen=True, eq=False)
class DyadSetup:
    """Places of two people.

    Attributes:
        name: What reports call it.
        arrangement: One of :data:`ARRANGEMENTS`.
        yaw: How far learner and partner are turned from looking along -x (2,) [rad].
        shoulders: Right shoulders of learner and partner (2, 3) [m], the middle of the table top at
            the origin, z up.
        places: Homes (first) and targets of both (2, 1 + TARGETS, 3) [m], or as many as there are.
        bow: How far the middle of a path is aside of the straight line (2, 3) [m], as round an obstacle.
    """

    name: str
    arrangement: str
    yaw: FloatArray
    shoulders: FloatArray
    places: FloatArray
    bow: FloatArray = field(default_factory=lambda: np.zeros((2, 3)))


def draw_setup(name: str, arrangement: str, rng: np.random.Generator) -> DyadSetup:
    """A setup of an arrangement; where exactly people and targets are is drawn."""
    angles = np.array((0.0, ARRANGEMENTS[arrangement])) + rng.uniform(-_SPREAD_RAD, _SPREAD_RAD, 2)
    if arrangement == "beside":
        angles += (-0.5, 0.5)  # nobody sits on another's lap
    outward = np.stack((-np.sin(angles), -np.cos(angles), np.zeros(2)), axis=1)
    right = np.stack((np.cos(angles), -np.sin(angles), np.zeros(2)), axis=1)
    height = np.array((0.0, 0.0, 1.0))
    shoulders = _SEAT_M * outward + 0.18 * right + rng.uniform(0.32, 0.42, (2, 1)) * height
    places = np.empty((2, 1 + TARGETS, 3))
    for person in range(2):
        home = rng.uniform(*_HOME_M) * outward[person] + rng.uniform(-0.08, 0.18) * right[person]
        places[person, 0] = home + rng.uniform(0.03, 0.08) * height
        for target in range(1, 1 + TARGETS):
            places[person, target] = _draw_target(places[person, :target], rng)
    # From looking along -x (a yaw of 0) to looking at the middle of the table.
    yaw = np.arctan2(outward[:, 1], outward[:, 0])
    return DyadSetup(name, arrangement, yaw, shoulders, places)


def _draw_target(others: FloatArray, rng: np.random.Generator) -> FloatArray:
    """A place in the shared region, some way off from the home."""
    while True:
        x, y = rng.uniform(-1.0, 1.0, 2) * _REGION_M[:2]
        place = np.array((x, y, rng.uniform(0.04, 0.04 + _REGION_M[2])))
        way = np.linalg.norm(others - place, axis=1)
        if way[0] >= _LEAST_WAY_M and way.min() >= 0.08:
            return place


def draw_setups(count: int, rng: np.random.Generator) -> tuple[DyadSetup, ...]:
    """Setups, the arrangements by turns."""
    names = list(ARRANGEMENTS)
    return tuple(
        draw_setup(
            f"{names[index % len(names)]}_{index // len(names)}", names[index % len(names)], rng
        )
        for index in range(count)
    )
