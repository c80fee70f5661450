"""Policies of different people beside each other: how long, how far off the straight line, how distinct."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hri_planner.dmp.frames import way_frame
from hri_planner.dmp.policy import DmpPolicy
from hri_planner.pibb.costs import indistinctness
from hri_prediction.errors import DataError

FloatArray = NDArray[np.float64]

STRAIGHT_M = 0.001
"""A way that never leaves the straight line by more than this has no side [m]."""


@dataclass(frozen=True)
class Way:
    """A policy's way to a goal, beside the straight line.

    Attributes:
        person: Whose policy.
        goal: Where to.
        length: Of the way [m].
        straight: Of the straight line [m].
        sideways: Largest distance from the line [m].
        left: There, to the left as one looks along the line [m]; negative: to the right.
        up: There, upwards across the line [m]; negative: downwards. On vertical ways, along the base's x.
        side: ``"left"``, ``"right"``, ``"up"`` or ``"down"``, whichever is most of it; ``"none"`` of a
            straight way.
        indistinct: J_delta beside the policy's other ways [1/m]; none where there is no other.
    """

    person: str
    goal: str
    length: float
    straight: float
    sideways: float
    left: float
    up: float
    side: str
    indistinct: float | None


@dataclass(frozen=True)
class Pair:
    """Two policies' ways to a goal, at the same shares of their motions.

    Attributes:
        goal: Where to.
        first: Person.
        second: Another person.
        rms: Root mean square of their distance [m].
        largest: Of their distances [m].
        start_apart: Distance of where they begin [m].
        goal_apart: Distance of where they lead [m].
    """

    goal: str
    first: str
    second: str
    rms: float
    largest: float
    start_apart: float
    goal_apart: float


@dataclass(frozen=True, eq=False)
class Comparison:
    """Policies of an experiment beside each other.

    Attributes:
        experiment: Which.
        persons: Whose policies, in order.
        goals: Names of all goals that one of them knows.
        ways: Of each person to each goal that the policy knows.
        pairs: Of each two persons, for each goal that both policies know.
        policies: By person.
    """

    experiment: str
    persons: tuple[str, ...]
    goals: tuple[str, ...]
    ways: tuple[Way, ...]
    pairs: tuple[Pair, ...]
    policies: Mapping[str, DmpPolicy] = field(repr=False)

    def to_mapping(self) -> dict[str, Any]:
        """All but the policies, as JSON can hold it."""
        return {
            "experiment": self.experiment,
            "persons": list(self.persons),
            "goals": list(self.goals),
            "ways": [asdict(way) for way in self.ways],
            "pairs": [asdict(pair) for pair in self.pairs],
        }


def compared(experiment: str, policies: Mapping[str, DmpPolicy]) -> Comparison:
    """Policies beside each other.

    Args:
        experiment: That they were learnt in.
        policies: By person.
    """
    goals = tuple(dict.fromkeys(name for policy in policies.values() for name in policy.names))
    ways = [
        _way(person, policy, goal) for person, policy in policies.items() for goal in policy.names
    ]
    pairs = [
        _pair(goal, (first, policies[first]), (second, policies[second]))
        for goal in goals
        for first, second in combinations(policies, 2)
        if goal in policies[first].goals and goal in policies[second].goals
    ]
    return Comparison(experiment, tuple(policies), goals, tuple(ways), tuple(pairs), policies)


def _way(person: str, policy: DmpPolicy, goal: str) -> Way:
    path, place = policy.path(goal), policy.goals[goal]
    across = ((path - policy.start) @ way_frame(policy.start, place))[:, 1:]
    left, up = (float(value) for value in across[np.linalg.norm(across, axis=1).argmax()])
    sideways = math.hypot(left, up)
    side = "none"
    if sideways >= STRAIGHT_M:
        level = "left" if left > 0.0 else "right"
        side = level if abs(left) >= abs(up) else "up" if up > 0.0 else "down"
    others = [policy.path(name) for name in policy.names if name != goal]
    found = None
    if others:
        period = float(np.diff(policy.response().times[:2])[0])
        try:
            found = indistinctness(path, np.array(others), period)
        except DataError:  # the others are the same way: nothing tells them apart
            found = None
    return Way(
        person=person,
        goal=goal,
        length=float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum()),
        straight=float(np.linalg.norm(place - policy.start)),
        sideways=sideways,
        left=left,
        up=up,
        side=side,
        indistinct=found,
    )


def _pair(goal: str, first: tuple[str, DmpPolicy], second: tuple[str, DmpPolicy]) -> Pair:
    one, other = first[1], second[1]
    longer = one if one.duration >= other.duration else other
    shares = longer.response().times / longer.duration
    apart = np.linalg.norm(_at(one, goal, shares) - _at(other, goal, shares), axis=1)
    return Pair(
        goal=goal,
        first=first[0],
        second=second[0],
        rms=float(np.sqrt(np.mean(apart**2))),
        largest=float(apart.max()),
        start_apart=float(np.linalg.norm(one.start - other.start)),
        goal_apart=float(np.linalg.norm(one.goals[goal] - other.goals[goal])),
    )


def _at(policy: DmpPolicy, goal: str, shares: FloatArray) -> FloatArray:
    """Its way at shares (n,) of the motion (n, 3) [m]; no other values where they are its own times."""
    own = policy.response().times / policy.duration
    path = policy.path(goal)
    return np.column_stack([np.interp(shares, own, path[:, axis]) for axis in range(3)])
