"""A policy of movement primitives: one way to each goal, from one start."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from hri_planner.dmp.basis import BASIS_COUNT
from hri_planner.dmp.frames import carried
from hri_planner.dmp.response import Response, response
from hri_prediction.errors import DataError, PlanningError

FloatArray = NDArray[np.float64]

HOME = "start"
"""Name of the goal that leads back to where all motions begin."""
AT_GOAL_M = 0.01
"""A place that is no farther from a goal than this is that goal [m]."""
AT_START_M = 0.002
"""A motion that begins no farther from the start than this takes the learnt way as it is [m]."""
PERIOD_S = 0.004
"""Times at which paths are given [s]."""
DURATIONS_S = (0.2, 30.0)
"""Durations that a motion may have [s]."""


@dataclass(frozen=True, eq=False)
class DmpPolicy:
    """Ways of the tool, base frame.

    Attributes:
        start: Where the tool begins (3,) [m].
        posture: Joint angles (7,) [rad] in which it does; free joints keep to them.
        goals: Where ways lead (3,) [m], by name.
        weights: Of the ways (3, k) [m], by name of the goal.
        duration: Of a motion [s].

    Raises:
        DataError: when shapes do not fit, a value is not finite, or a goal is where the motions begin.
    """

    start: FloatArray
    posture: FloatArray
    goals: Mapping[str, FloatArray]
    weights: Mapping[str, FloatArray]
    duration: float
    _back: dict[str, FloatArray] = field(init=False, default_factory=dict, repr=False)

    def __post_init__(self) -> None:
        """Check and freeze the values."""
        if not self.goals or HOME in self.goals:
            raise DataError(
                f"goals {list(self.goals)}", expected=f"at least one, none of them named {HOME!r}"
            )
        if set(self.goals) != set(self.weights):
            raise DataError(
                f"weights for {sorted(self.weights)}", expected=f"for {sorted(self.goals)}"
            )
        low, high = DURATIONS_S
        if not low <= self.duration <= high:
            raise DataError(f"duration {self.duration!r} s", expected=f"{low} to {high} s")
        _check("start", self.start, (3,))
        _check("posture", self.posture, (7,))
        for name, goal in self.goals.items():
            _check(f"goal {name}", goal, (3,))
            count = np.shape(self.weights[name])[-1] if np.ndim(self.weights[name]) else 0
            if count < 3 or count != np.shape(next(iter(self.weights.values())))[-1]:
                raise DataError(
                    f"weights of {name} have shape {np.shape(self.weights[name])}",
                    expected=f"(3, {BASIS_COUNT})",
                )
            _check(f"weights of {name}", self.weights[name], (3, count))
            if np.linalg.norm(goal - self.start) < AT_GOAL_M:
                raise DataError(f"goal {name} is the start", expected="places apart")

    @property
    def names(self) -> tuple[str, ...]:
        """Of the goals."""
        return tuple(self.goals)

    def response(self, duration: float | None = None) -> Response:
        """Of its motions, every 4 ms."""
        count = next(iter(self.weights.values())).shape[-1]
        return response(duration or self.duration, PERIOD_S, count)

    def path(self, name: str) -> FloatArray:
        """The way to a goal when nothing interferes (n, 3) [m], every 4 ms.

        Raises:
            PlanningError: when there is no such goal.
        """
        if name == HOME:
            raise PlanningError(
                f"{name!r} is where ways begin", expected="a goal: " + ", ".join(self.goals)
            )
        self._known(name)
        return self.response().rollouts(self.start, self.goals[name], self.weights[name])

    def name_of(self, goal: FloatArray) -> str:
        """Name of the goal at a place (3,) [m]; the start has one too.

        Raises:
            PlanningError: when no goal is there, saying where goals are.
        """
        places = {**self.goals, HOME: self.start}
        name = min(places, key=lambda other: float(np.linalg.norm(places[other] - goal)))
        if not np.linalg.norm(places[name] - goal) <= AT_GOAL_M:
            known = ", ".join(f"{n} ({_text(place)})" for n, place in places.items())
            raise PlanningError(
                f"the policy knows no way to ({_text(goal)}) m",
                expected=f"one of its goals: {known}",
                hint="send one of these, or adapt a policy to others",
            )
        return name

    def weights_from(self, tool: FloatArray, name: str) -> FloatArray:
        """Weights (3, k) [m] of a motion from where the tool is (3,) [m].

        From the start they are the learnt ones; from elsewhere those of a similar way; back to the start
        those of the way to the goal next to the tool, backwards.

        Raises:
            PlanningError: when there is no such goal.
        """
        self._known(name)
        if name == HOME:
            nearest = min(
                self.goals, key=lambda other: float(np.linalg.norm(self.goals[other] - tool))
            )
            if nearest not in self._back:
                way = self.path(nearest)
                self._back[nearest] = self.response().fit(way[::-1])
            before = (self.goals[nearest], self.start)
            return carried(self._back[nearest], before, (tool, self.start))
        if np.linalg.norm(tool - self.start) <= AT_START_M:
            return self.weights[name]
        goal = self.goals[name]
        return carried(self.weights[name], (self.start, goal), (tool, goal))

    def moved(
        self, start: FloatArray, posture: FloatArray, goals: Mapping[str, FloatArray] | None = None
    ) -> DmpPolicy:
        """The same policy elsewhere: each way turned and stretched with start and goal.

        Args:
            start: Where the tool begins (3,) [m].
            posture: In which posture (7,) [rad].
            goals: The same names elsewhere; none: where they are.

        Raises:
            PlanningError: when a goal is not known.
            DataError: as on making one.
        """
        there = dict(self.goals if goals is None else goals)
        for name in there:
            if name not in self.goals:
                raise PlanningError(
                    f"the policy has no goal {name!r}", expected=", ".join(self.goals)
                )
        weights = {
            name: carried(self.weights[name], (self.start, self.goals[name]), (start, goal))
            for name, goal in there.items()
        }
        return DmpPolicy(start, posture, there, weights, self.duration)

    def _known(self, name: str) -> None:
        if name not in self.goals and name != HOME:
            raise PlanningError(
                f"the policy has no goal {name!r}", expected=", ".join((*self.goals, HOME))
            )


def _text(place: FloatArray) -> str:
    return ", ".join(f"{value:.3f}" for value in place)


def _check(what: str, values: FloatArray, shape: tuple[int, ...]) -> None:
    found = np.shape(values)
    if found != shape or not np.isfinite(values).all():
        raise DataError(f"{what} has shape {found}", expected=f"finite numbers of shape {shape}")
