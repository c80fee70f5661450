"""Why a person reaches along the mean path of a task: inverse optimal control of what was learnt."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hri_prediction.hybrid.body import BodyArm
from hri_prediction.hybrid.prior_path import solver_of
from hri_prediction.hybrid.weight_process import WeightData, of_whole
from hri_prediction.motor_control.costs import indices_of
from hri_prediction.motor_control.ioc import explain
from hri_prediction.motor_control.observed import ObservedReach
from hri_prediction.motor_control.ocp import NotConverged
from hri_prediction.motor_control.scaling import rescaled, scaling_of
from hri_prediction.motor_control.seen import KNOT_S, from_rest, observe
from hri_prediction.motor_control.uncertainty import certainty
from hri_prediction.prediction.library import TaskModel
from hri_prediction.tracks.track import ArmTrack

Array = NDArray[np.float64]

_POINTS = 101


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
        data: These, as a process of weights learns from them.
    """

    task: str
    alpha: Array
    sd: Array
    before_m: float
    after_m: float
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
        name=model.name,
    )


def why(
    model: TaskModel, body: BodyArm, expected: Array, names: tuple[str, ...], share: float
) -> Why:
    """Explain the mean path of a task, beginning with the weights that were expected.

    Weights go in and come out with the scale factors of the reach from rest to rest, as all weights of the
    hybrid have them: what is explained is a part of that, whose own factors are others.

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
    observed = mean_reach(model, body)
    solver = solver_of(body.arm, body.limits)
    chosen = indices_of(names)
    rest = scaling_of(solver, from_rest(observed.problem, share)).factors[chosen]
    own = scaling_of(solver, observed.problem).factors[chosen]
    start = rescaled(expected, rest, own)
    found = explain(solver, observed, names, start=start)
    step_s = observed.problem.duration / (len(observed.phases) - 1)
    sure = certainty(found, observed, correlated=max(KNOT_S / step_s, 1.0))
    try:
        before = solver.solve(observed.problem, found.scaling.weights(start, names))
        before_m = observed.distance(before.hand(observed.phases, body.arm))
    except NotConverged:
        before_m = math.inf
    alpha, sd = of_whole(found.alpha, sure.sd, own, rest)
    data = WeightData.of(
        names,
        observed.problem.q_start[None],
        observed.problem.q_end[None],
        alpha[None],
        sd[None],
    )
    return Why(model.name, alpha, sd, before_m, found.distance_m, data)
