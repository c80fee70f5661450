"""The path that a person is expected to take before any reach is seen (thesis section 3.3.4.1)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from hri_prediction.errors import DataError
from hri_prediction.geometry.minimum_jerk import minimum_jerk
from hri_prediction.hybrid.body import BodyArm
from hri_prediction.motor_control.arm_model import ArmModel, JointLimits
from hri_prediction.motor_control.ocp import Motion, NotConverged, ReachSolver
from hri_prediction.motor_control.problem import ReachProblem
from hri_prediction.motor_control.scaling import scaling_of

Array = NDArray[np.float64]

POINTS = 61
_FINE = 401
_ROUNDS, _SAME_SHARE = 8, 1e-3
"""So often a duration is reckoned anew by its share, or until that changes by less."""
FURTHEST_M = 0.25
"""So far off may elbow or wrist of the model be where an arm rests, in an axis."""
SHORTEST_M = 0.04
"""Targets nearer than this to the hand are no reach."""


@dataclass(frozen=True, eq=False)
class Geometry:
    """What a reach is between.

    Attributes:
        start: Elbow and wrist at its begin (6,) [m], from the shoulder along the axes of the world.
        tip: Where the tip of the hand ends (3,) [m], likewise.
    """

    start: Array
    tip: Array

    def __post_init__(self) -> None:
        for name, size in (("start", 6), ("tip", 3)):
            array = np.array(getattr(self, name), dtype=float)
            if array.shape != (size,) or not np.isfinite(array).all():
                raise DataError(
                    f"{name} of a reach: {array.tolist()}", expected=f"{size} finite numbers"
                )
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    def apart_m(self, other: Geometry) -> float:
        """The greatest distance of elbow, wrist and target from those of another [m]."""
        rows = np.concatenate([self.start, self.tip]).reshape(3, 3)
        others = np.concatenate([other.start, other.tip]).reshape(3, 3)
        return float(np.linalg.norm(rows - others, axis=1).max())


@dataclass(frozen=True, eq=False)
class PriorPath:
    """An expected path.

    Attributes:
        phases: From where the hand passes the onset speed to where it does so again (P,), 0 to 1.
        values: Elbow and wrist (P, 6) [m], from the shoulder along the axes of the world.
        share: Of the whole duration from rest to rest that lies between these.
        q_start: Posture at the begin (3,) [rad].
        q_end: At the end (3,) [rad].
        why_not: Why it is no optimum but a straight line; empty: it is one.
    """

    phases: Array
    values: Array
    share: float
    q_start: Array
    q_end: Array
    why_not: str = ""

    def __post_init__(self) -> None:
        count = len(self.phases)
        shapes = {"phases": (count,), "values": (count, 6), "q_start": (3,), "q_end": (3,)}
        for name, shape in shapes.items():
            array = np.array(getattr(self, name), dtype=float)
            if array.shape != shape or count < 2 or not np.isfinite(array).all():
                raise DataError(
                    f"{name} of an expected path has shape {array.shape}",
                    expected=f"finite numbers of shape {shape}, two points or more",
                )
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        if not 0.0 < self.share <= 1.0:
            raise DataError(f"a path that is {self.share} of itself", expected="0 to 1")


@lru_cache(maxsize=8)
def solver_of(arm: ArmModel, limits: JointLimits) -> ReachSolver:
    """The solver of an arm, made once."""
    return ReachSolver(arm, limits)


def optimal_path(
    body: BodyArm,
    geometry: Geometry,
    duration_s: float,
    alpha: Array,
    names: tuple[str, ...],
    onset_speed: float,
) -> PriorPath:
    """The optimum of weights, aligned to a person.

    The model has the person's lengths and faces as the person does. What it cannot do is added. As it does
    not roll the shoulder: wholly where the reach begins, nothing of it where it ends, so that the path
    begins at elbow and wrist as they rest. As its shoulder stays where it is: nothing where the reach
    begins, wholly where it ends, as a trunk goes along, so that it ends with the hand at the target.

    Args:
        body: Whose arm.
        geometry: What the reach is between.
        duration_s: From rest to rest [s].
        alpha: Weights of costs (n,).
        names: The costs (n,).
        onset_speed: Of the hand, where reaches are cut [m/s].

    Raises:
        DataError: the target is out of reach, or where the hand is already.
    """
    q_start = body.posture(geometry.start)
    q_end = body.posture_at(geometry.tip, q_start)
    why_not = ""
    phases = np.linspace(0.0, 1.0, _FINE)
    try:
        motion = _optimum(body, q_start, q_end, duration_s, alpha, names)
        angles = motion.angles(phases)
        values = body.positions(angles)
        fade = _remaining(values)
    except NotConverged as error:
        why_not = error.problem
        rise = minimum_jerk(phases)[:, None]
        ends = body.positions(np.stack([q_start, q_end]))
        values = ends[0] + rise * (ends[1] - ends[0])
        fade = 1.0 - rise
    misfit = float(np.abs(geometry.start - values[0]).max())
    if misfit > FURTHEST_M:
        raise DataError(
            f"no arm of these lengths rests like this: the nearest is {100.0 * misfit:.0f} cm off",
            expected=f"{100.0 * FURTHEST_M:.0f} cm or less",
            hint="is this the side of the arm, and where the person faces?",
        )
    values = (
        values
        + fade * (geometry.start - values[0])
        + (1.0 - fade) * _leant(body, values[-1], geometry)
    )
    return _cut(phases, values, duration_s, onset_speed, q_start, q_end, why_not)


def share_of(
    body: BodyArm,
    geometry: Geometry,
    between_s: float,
    alpha: Array,
    names: tuple[str, ...],
    onset_speed: float,
) -> float:
    """Share of the whole duration, from rest to rest, of a reach that takes a time where it is fast.

    The slower a reach, the later its hand passes the onset speed.

    Args:
        body: Whose arm.
        geometry: What the reach is between.
        between_s: From where the hand passes the onset speed to where it does so again [s].
        alpha: Weights of costs (n,).
        names: The costs (n,).
        onset_speed: Of the hand, where reaches are cut [m/s].

    Raises:
        DataError: as :func:`optimal_path`.
    """
    share = 1.0
    for _ in range(_ROUNDS):
        before = share
        path = optimal_path(body, geometry, between_s / share, alpha, names, onset_speed)
        share = path.share
        if abs(share - before) < _SAME_SHARE:
            break
    return share


def straight_path(
    body: BodyArm, geometry: Geometry, duration_s: float, onset_speed: float
) -> PriorPath:
    """A minimum-jerk line of elbow and wrist: what everybody would guess.

    Args:
        body: Whose arm.
        geometry: What the reach is between.
        duration_s: From rest to rest [s].
        onset_speed: Of the hand, where reaches are cut [m/s].

    Raises:
        DataError: the target is out of reach, or where the hand is already.
    """
    q_start = body.posture(geometry.start)
    q_end = body.posture_at(geometry.tip, q_start)
    phases = np.linspace(0.0, 1.0, _FINE)
    end = body.positions(q_end[None])[0]
    end = end + _leant(body, end, geometry)
    values = geometry.start + minimum_jerk(phases)[:, None] * (end - geometry.start)
    return _cut(phases, values, duration_s, onset_speed, q_start, q_end, "")


def _leant(body: BodyArm, end: Array, geometry: Geometry) -> Array:
    """How far elbow and wrist (6,) must go along for the hand to get to its target."""
    return np.tile(geometry.tip - body.tips(end[None])[0], 2)


def _optimum(
    body: BodyArm,
    q_start: Array,
    q_end: Array,
    duration_s: float,
    alpha: Array,
    names: tuple[str, ...],
) -> Motion:
    solver = solver_of(body.arm, body.limits)
    problem = ReachProblem.at_rest(q_start, q_end, duration_s)
    return solver.solve(problem, scaling_of(solver, problem).weights(alpha, names))


def _remaining(values: Array) -> Array:
    """Share of the wrist's way (N, 1) that is still to be gone."""
    steps = np.linalg.norm(np.diff(values[:, 3:], axis=0), axis=1)
    gone = np.concatenate([[0.0], np.cumsum(steps)])
    return np.asarray(1.0 - gone / max(float(gone[-1]), 1e-9))[:, None]


def _cut(
    phases: Array,
    values: Array,
    duration_s: float,
    onset_speed: float,
    q_start: Array,
    q_end: Array,
    why_not: str,
) -> PriorPath:
    """The part between where the hand passes the onset speed, as reaches are cut out of recordings."""
    way = float(np.linalg.norm(values[-1, 3:] - values[0, 3:]))
    if way < SHORTEST_M:
        raise DataError(
            f"the hand is {100.0 * way:.0f} cm from where it would end",
            expected=f"a reach of {100.0 * SHORTEST_M:.0f} cm or more",
        )
    speed = np.linalg.norm(np.gradient(values[:, 3:], phases, axis=0), axis=1) / duration_s
    fast = np.flatnonzero(speed >= onset_speed)
    first, last = (int(fast[0]), int(fast[-1])) if len(fast) > 1 else (0, len(phases) - 1)
    at = np.linspace(phases[first], phases[last], POINTS)
    cut = np.column_stack([np.interp(at, phases, column) for column in values.T])
    share = float(phases[last] - phases[first])
    return PriorPath(np.linspace(0.0, 1.0, POINTS), cut, share, q_start, q_end, why_not)
