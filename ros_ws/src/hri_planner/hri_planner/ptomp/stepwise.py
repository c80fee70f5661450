"""STOMP's update (Kalakrishnan et al. 2011): weights at each time step, smoothed by M; compiled.

With S(k, i) the cost of roll-out k at time step i,

    P(k, i) = exp(-h (S(k, i) - min_k S) / (max_k S - min_k S)) / sum over k,
    delta_i = sum over k of P(k, i) noise(k, i),   update = M delta,

where M is R^-1 with each column scaled so that its largest entry is 1 / N. Roll-outs and elites are
those of :mod:`hri_planner.ptomp.iteration`, so that planners differ in nothing else.
"""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hri_planner.ptomp.clearance import filled_columns, mark_columns
from hri_planner.ptomp.column_costs import column_costs
from hri_planner.ptomp.iteration import JOINTS, explore, keep_elite
from hri_planner.ptomp.kernel import trajectory_costs
from hri_planner.ptomp.layout import FIRST_FREE
from hri_prediction.compiled import njit

FloatArray = NDArray[np.float64]


@functools.lru_cache(maxsize=256)
def update_smoother(size: int) -> FloatArray:
    """M for updates of so many time steps (size, size); without any, no smoothing.

    R is the Toeplitz matrix (1, -4, 6, -4, 1) of :mod:`hri_planner.ptomp.smoothing`.
    """
    bends = np.zeros((size + 2, size))
    for row, value in enumerate((1.0, -2.0, 1.0)):
        bends[np.arange(size) + row, np.arange(size)] = value
    inverse = np.linalg.solve(bends.T @ bends, np.eye(size))
    smoother: FloatArray = inverse / (size * np.abs(inverse).max(axis=0, initial=0.0))
    smoother.setflags(write=False)
    return smoother


@njit
def _spread(costs: Any, column: int, known: Any) -> Any:
    """Smallest cost of a column among the trajectories that count, and the range of their costs."""
    low, high = np.inf, -np.inf
    for index in range(costs.shape[0]):
        if known[index] < np.inf:
            low, high = min(low, costs[index, column]), max(high, costs[index, column])
    return low, max(high - low, 1e-12)


@njit
def stepwise_update(
    incumbent: Any, first: int, last: int, sensitivity: float, trajectories: Any, totals: Any,
    costs: Any, smoother: Any, raw: Any, update: Any,
) -> None:  # fmt: skip
    """The update of an incumbent (7, ROW) at the columns first to last - 1.

    Args:
        incumbent: [rad].
        first: First column that may change.
        last: First column that may not.
        sensitivity: h.
        trajectories: Roll-outs and elites (n, 7, ROW) [rad].
        totals: Their total costs (n,); those of infinite cost are not there.
        costs: Their costs at each column (n, ROW).
        smoother: M (last - first, last - first), or (0, 0) for the update as it is.
        raw: Buffer (7, ROW): the update before smoothing.
        update: Result (7, ROW) [rad], zero elsewhere.
    """
    update[:] = update.dtype.type(0.0)
    raw[:] = raw.dtype.type(0.0)
    for column in range(first, last):
        low, width = _spread(costs, column, totals)
        total = 0.0
        for index in range(trajectories.shape[0]):
            if totals[index] < np.inf:
                weight = np.exp(-sensitivity * (costs[index, column] - low) / width)
                total += weight
                for joint in range(JOINTS):
                    noise = trajectories[index, joint, column] - incumbent[joint, column]
                    raw[joint, column] += weight * noise
        for joint in range(JOINTS):
            raw[joint, column] /= total
    if smoother.shape[0] == 0:
        for joint in range(JOINTS):
            update[joint, first:last] = raw[joint, first:last]
        return
    size = last - first
    for joint in range(JOINTS):
        for i in range(size):
            value = 0.0
            for k in range(size):
                value += smoother[i, k] * raw[joint, first + k]
            update[joint, first + i] = value


@njit
def iterate_stepwise(
    incumbent: Any, cost: float, columns: int, free_until: int, sd: float, sensitivity: float,
    normals: Any, place: int, band: Any, scale: Any, smoother: Any,
    body: Any, humans: Any, human_radii: Any, par: Any, work: Any,
    trajectories: Any, totals: Any, costs: Any, count: int, raw: Any,
    mean: Any, terms: Any,
) -> float:  # fmt: skip
    """One iteration; the incumbent (7, ROW) changes if the updated trajectory costs less than ``cost``.

    Args:
        incumbent: (7, ROW) [rad].
        cost: What an update must cost less than.
        columns: Columns in use.
        free_until: First column that stays as it is.
        sd: Noise level [rad].
        sensitivity: Sharpness of the weights.
        normals: Pool of standard normals.
        place: Where in it to begin.
        band: Factors of the smoothing of noise.
        scale: Its normalisation.
        smoother: See :func:`stepwise_update`.
        body: See :func:`hri_planner.ptomp.kernel.many_costs`, as all up to ``work``.
        humans: See body.
        human_radii: See body.
        par: See body.
        work: See body.
        trajectories: Buffer of ``count`` roll-outs, then elites (n, 7, ROW), kept between iterations.
        totals: Their costs (n,), infinite where empty.
        costs: Their costs at each column (n, ROW).
        count: Number of roll-outs.
        raw: Buffer (7, ROW).
        mean: Buffer (7, ROW).
        terms: Buffer (TERM_COUNT,).

    Returns:
        The incumbent's cost afterwards.
    """
    rollouts = trajectories[:count]
    explore(
        incumbent, columns, free_until, False, sd, normals, place, band, scale, rollouts
    )  # fmt: skip
    mark_columns(columns, work)
    filled = filled_columns(columns)
    for index in range(count):
        trajectory_costs(rollouts[index], columns, body, humans, human_radii, par, work, terms)
        totals[index] = terms.sum()
        column_costs(rollouts[index], columns, body, par, work, costs[index])
    stepwise_update(
        incumbent,
        FIRST_FREE,
        free_until,
        sensitivity,
        trajectories,
        totals,
        costs,
        smoother,
        raw,
        mean,
    )
    for joint in range(7):
        for i in range(filled):
            mean[joint, i] += incumbent[joint, i]
    for index in range(count):
        slot = keep_elite(
            rollouts[index], totals[index], trajectories[count:], totals[count:], filled
        )
        if slot >= 0:
            costs[count + slot] = costs[index]
    trajectory_costs(mean, columns, body, humans, human_radii, par, work, terms)
    after = terms.sum()
    if after < cost:
        incumbent[:, :filled] = mean[:, :filled]
        return after
    return cost
