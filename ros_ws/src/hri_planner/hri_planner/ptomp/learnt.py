"""What it costs to be near a person, as learnt from how people move beside each other, compiled.

The robot stands for one of the two people (agent 1): its upper arm, lower arm and hand for humerus,
forearm and hand, its shoulder, elbow, wrist and tool for their joints. The cost of a column is
Σ_k w_k exp(−d_k / L) over the 25 distances of :mod:`hri_prediction.ontology.features`, those between the
axes of segments and those between joints, to where each arm is expected. Distances whose weight is zero are
not computed.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hri_planner.ptomp.clearance import dot, nearest_on, padded_columns
from hri_planner.ptomp.layout import (
    ARM_AXIS,
    ARM_LENGTH,
    AXES,
    BASE,
    ELBOW,
    FAST,
    FREE,
    LEARNT,
    LENGTHS,
    P_LEARNT_STEEP,
    P_NEARNESS,
    P_PARALLEL,
    ROW,
    TIP,
    TOOL,
    WRIST,
)  # fmt: skip
from hri_prediction.compiled import njit

MOST = 12.0
"""Beyond so many lengths L a distance costs as at that: less than 1e-5 of the most."""


@njit
def _series(real: Any) -> Any:
    """Of exp(x), then the share of its argument that is taken, and the largest argument."""
    return (
        real(1.0), real(1.0), real(1.0 / 2.0), real(1.0 / 6.0), real(1.0 / 24.0), real(1.0 / 120.0),
        real(1.0 / 720.0), real(-1.0 / 64.0), real(MOST),
    )  # fmt: skip


@njit(fastmath=FAST)
def _nearness(squared: Any, steep: Any, series: Any) -> Any:
    """exp(−d / L) of a squared distance: series of a 64th of it, squared six times; error below 1e-7."""
    x = np.sqrt(squared) * steep
    x = (x if x < series[8] else series[8]) * series[7]
    y = series[5] + x * series[6]
    y = series[4] + x * y
    y = series[3] + x * y
    y = series[2] + x * y
    y = series[1] + x * y
    y = series[0] + x * y
    y = y * y
    y = y * y
    y = y * y
    y = y * y
    y = y * y
    return y * y


@njit(fastmath=FAST)
def _add_joints(padded: int, point: Any, other: Any, weight: Any, steep: Any, out: Any) -> None:
    """Add a joint of the robot (3 * ROW,) and one of a person (3 * ROW,) to the costs (ROW,)."""
    series = _series(out.dtype.type)
    for i in range(padded):
        x = point[i] - other[i]
        y = point[ROW + i] - other[ROW + i]
        z = point[2 * ROW + i] - other[2 * ROW + i]
        out[i] += weight * _nearness(x * x + y * y + z * z, steep, series)


@njit(fastmath=FAST)
def _add_segments(
    padded: int, start: Any, axis: Any, length: Any, limb: Any, along: Any, reach: Any, near_one: Any,
    weight: Any, steep: Any, out: Any,
) -> None:  # fmt: skip
    """Add a part of the robot and a limb of a person, by the distance of their axes.

    Args:
        padded: Number of columns, rounded up.
        start: Of the part (3 * ROW,).
        axis: Unit vector along it (3 * ROW,).
        length: Of it [m].
        limb: Start of the limb (3 * ROW,).
        along: Unit vector along it (3 * ROW,).
        reach: Length of it (ROW,) [m].
        near_one: A little more than 1, so that parallel axes divide by more than zero.
        weight: Of this distance.
        steep: One over the length L [1/m].
        out: Costs of the columns (ROW,).
    """
    real = out.dtype.type
    zero, series = real(0.0), _series(real)
    for i in range(padded):
        u = (axis[i], axis[ROW + i], axis[2 * ROW + i])
        v = (along[i], along[ROW + i], along[2 * ROW + i])
        r = (
            start[i] - limb[i], start[ROW + i] - limb[ROW + i], start[2 * ROW + i] - limb[2 * ROW + i],
        )  # fmt: skip
        squared, _ = nearest_on(
            r, u, v, dot(u, v), dot(u, r), dot(v, r), length, reach[i], near_one, zero
        )
        out[i] += weight * _nearness(squared, steep, series)


@njit(fastmath=FAST)
def _set_ends(padded: int, height: Any, arm: Any, work: Any) -> None:
    """Write the robot's shoulder and a person's hand tip, which are in no row."""
    base, tip = work[BASE * ROW : (BASE + 3) * ROW], work[TIP * ROW : (TIP + 3) * ROW]
    wrist, axis = arm[6 * ROW : 9 * ROW], arm[(ARM_AXIS + 6) * ROW : (ARM_AXIS + 9) * ROW]
    length = arm[(ARM_LENGTH + 2) * ROW :]
    zero = work.dtype.type(0.0)
    for i in range(padded):
        base[i], base[ROW + i], base[2 * ROW + i] = zero, zero, height
        tip[i] = wrist[i] + length[i] * axis[i]
        tip[ROW + i] = wrist[ROW + i] + length[i] * axis[ROW + i]
        tip[2 * ROW + i] = wrist[2 * ROW + i] + length[i] * axis[2 * ROW + i]


@njit
def fill_nearness(columns: int, body: Any, humans: Any, par: Any, work: Any) -> None:
    """Write the cost of nearness of every column, summed over arms, into its row of the workspace.

    Arguments as :func:`hri_planner.ptomp.clearance.distances`, which has filled ``work``.
    """
    real = work.dtype.type
    zero, padded = real(0.0), padded_columns(columns)
    near_one, steep = real(1.0) + par[P_PARALLEL], par[P_LEARNT_STEEP]
    out = work[LEARNT * ROW : (LEARNT + 1) * ROW]
    out[:] = zero
    places = (BASE, ELBOW, WRIST, TOOL)
    for index in range(humans.shape[0]):
        arm = humans[index]
        _set_ends(padded, body[LENGTHS], arm, work)
        for i in range(4):
            point = work[places[i] * ROW : (places[i] + 3) * ROW]
            for j in range(4):
                weight = par[P_NEARNESS + 9 + 4 * i + j]
                if weight > zero:
                    other = arm[3 * j * ROW : 3 * (j + 1) * ROW]
                    if j == 3:
                        other = work[TIP * ROW : (TIP + 3) * ROW]
                    _add_joints(padded, point, other, weight, steep, out)
                if i == 3 or j == 3:
                    continue
                weight = par[P_NEARNESS + 3 * i + j]
                if weight > zero:
                    _add_segments(
                        padded, point, work[(AXES + 3 * i) * ROW : (AXES + 3 * i + 3) * ROW],
                        body[LENGTHS + 1 + i], arm[3 * j * ROW : 3 * (j + 1) * ROW],
                        arm[(ARM_AXIS + 3 * j) * ROW : (ARM_AXIS + 3 * j + 3) * ROW],
                        arm[(ARM_LENGTH + j) * ROW : (ARM_LENGTH + j + 1) * ROW], near_one,
                        weight, steep, out,
                    )  # fmt: skip


@njit(fastmath=FAST)
def sum_nearness(columns: int, work: Any) -> Any:
    """The same, summed over the free columns."""
    costs, counts = work[LEARNT * ROW :], work[FREE * ROW :]
    total = work.dtype.type(0.0)
    for i in range(padded_columns(columns)):
        total += counts[i] * costs[i]
    return total
