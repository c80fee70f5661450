"""Why a person reaches along the mean path of a task: inverse optimal control of what was learnt."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hri_prediction.geometry.minimum_jerk import minimum_jerk
from hri_prediction.hybrid.body import BodyArm
from hri_prediction.hybrid.prior_path import solver_of
from hri_prediction.hybrid.weight_process import WeightData, bounded_variance
from hri_prediction.motor_control.arm_model import JointLimits
from hri_prediction.motor_control.ioc import explain
from hri_prediction.motor_control.observed import ObservedReach
from hri_prediction.motor_control.ocp import NotConverged
from hri_prediction.motor_control.problem import ReachProblem
from hri_prediction.motor_control.seen import observe
from hri_prediction.motor_control.uncertainty import certainty
from hri_prediction.prediction.library import TaskModel
from hri_prediction.tracks.track import ArmTrack

Array = NDArray[np.float64]

_POINTS = 101
_STRAYS = 3.0
"""A mean path strays from any optimum, as trunks and shoulders do, and evenly: so many samples of it say
something of their own."""
_OFF_SD = 2.0
"""Logarithms of ratios that explain a mean path are off by so much more than its samples tell, of simulated
people whose trunk goes along and whose lengths are not those that were measured."""


@dataclass(frozen=True, eq=False)
class Why:
    """What explains a mean path.

    Attributes:
        task: Name of the task.
        alpha: Weights of costs (n,), with the scale factors of the reach from rest to rest.
        sd: Their standard deviations (n,).
        before_m: Distance of the optimum of the weights that were expected to the path, by dynamic time
            warping and sample; infinite where there was none.
        after_m: Of those that were found.
        duration_s: From rest to rest, as it was reckoned with [s].
        data: These, as a process of weights learns from them.
    """

    task: str
    alpha: Array
    sd: Array
    before_m: float
    after_m: float
    duration_s: float
    data: WeightData


def mean_reach(model: TaskModel, body: BodyArm) -> ObservedReach:
    """The mean path of a task, as the arm model makes it.

    Raises:
        DataError: it is none that an arm can make.
    """
    phases = np.linspace(0.0, 1.0, _POINTS)
    path = model.promp.trajectory_mean(phases)
    points = np.zeros((_POINTS, 4, 3))
    points[:, 1], points[:, 2] = path[:, :3], path[:, 3:]
    points[:, 3] = points[:, 2]
    track = ArmTrack(phases * model.duration_mean_s, points, side=body.side, task=model.name)
    return observe(
        track,
        0.0,
        model.duration_mean_s,
        body.arm,
        facing_rad=body.facing_rad,
        limits=body.limits,
        trim=False,  # it is cut already, where the hand has the onset speed
        name=model.name,
    )


def as_whole(seen: ObservedReach, share: float, limits: JointLimits) -> ObservedReach:
    """The reach from rest to rest that a path is the middle of.

    A path that is cut where the hand is slow says next to nothing of its weights when what lies before and
    after is left out: that it begins and ends at rest is most of what it says. The little that an arm moves
    in between is as of a hand from rest to rest.

    Args:
        seen: From one crossing of the onset speed to the other.
        share: Of the whole duration that lies between these.
        limits: Of the joints.
    """
    before = 0.5 * (1.0 - share)
    moved = float(minimum_jerk(before))
    beyond = moved / (1.0 - 2.0 * moved) * (seen.angles[-1] - seen.angles[0])
    q_start, q_end = (
        np.clip(q, limits.lower, limits.upper)
        for q in (seen.angles[0] - beyond, seen.angles[-1] + beyond)
    )
    problem = ReachProblem.at_rest(q_start, q_end, seen.problem.duration / share)
    return replace(seen, problem=problem, phases=before + share * seen.phases)


def why(
    model: TaskModel, body: BodyArm, expected: Array, names: tuple[str, ...], share: float
) -> Why:
    """Explain the mean path of a task, beginning with the weights that were expected.

    Weights go in and come out with the scale factors of the reach from rest to rest, as all weights of the
    hybrid have them.

    Args:
        model: The task.
        body: Whose arm.
        expected: Weights (n,).
        names: Costs that may have a part in it (n,).
        share: Of the duration from rest to rest that the task takes.

    Raises:
        DataError: the mean path cannot be used.
        NotConverged: no optimum was found.
    """
    seen = mean_reach(model, body)
    observed = as_whole(seen, share, body.limits)
    solver = solver_of(body.arm, body.limits)
    found = explain(solver, observed, names, start=expected)
    sure = certainty(found, observed, correlated=_POINTS / _STRAYS)
    try:
        before = solver.solve(observed.problem, found.scaling.weights(expected, names))
        before_m = observed.distance(before.hand(observed.phases, body.arm))
    except NotConverged:
        before_m = math.inf
    data = WeightData.of(
        names,
        observed.problem.q_start[None],
        observed.problem.q_end[None],
        found.alpha[None],
        sure.covariance[None],
    )
    learnt = replace(data, variance=bounded_variance(data.variance + _OFF_SD**2))
    return Why(
        model.name,
        found.alpha,
        sure.sd,
        before_m,
        found.distance_m,
        observed.problem.duration,
        learnt,
    )
