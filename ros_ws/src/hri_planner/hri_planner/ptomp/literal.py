"""The thesis' own collision cost (eq. 6.10), to compare: it knows where contact is, not how deep.

K loc where the nearest pair of capsules is closer than a limit, else 0; loc is the distance of the nearest
point from the end effector along the robot's arm. It is zero at the hand and jumps at the limit, so it
tells an optimiser little about which way is out: the planner's default is the margin cost.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hri_planner.ptomp.clearance import padded_columns
from hri_planner.ptomp.layout import (
    ARM_AXIS,
    ARM_LENGTH,
    ARM_RISE,
    ARM_SIGMA,
    COLLISION,
    ELBOW,
    LENGTHS,
    P_KAPPA,
    P_MARGIN,
    RADII,
    ROW,
    TOOL,
    WRIST,
)
from hri_prediction.compiled import njit
from hri_prediction.geometry.segments import closest_parameters


@njit
def _part_ends(part: int, column: int, body: Any, work: Any, start: Any, end: Any) -> None:
    """End points of one part of the robot at a column."""
    ends = (ELBOW, WRIST, TOOL)
    for axis in range(3):
        end[axis] = work[(ends[part] + axis) * ROW + column]
        if part == 0:
            start[axis] = body[LENGTHS] if axis == 2 else 0.0
        else:
            start[axis] = work[(ends[part - 1] + axis) * ROW + column]


@njit
def literal_collisions(
    columns: int, body: Any, humans: Any, human_radii: Any, par: Any, work: Any
) -> None:
    """Put eq. 6.10 without its factor K in the place of the collision costs.

    The limit of the distance is the margin plus kappa standard deviations of the prediction. Slow: nothing
    is vectorised. Arguments as :func:`hri_planner.ptomp.clearance.distances`, which has filled ``work``.
    """
    a0, a1, b0, b1 = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    for column in range(padded_columns(columns)):
        nearest, cost = np.inf, 0.0
        for part in range(3):
            _part_ends(part, column, body, work, a0, a1)
            beyond = 0.0
            for later in range(part + 1, 3):
                beyond += body[LENGTHS + 1 + later]
            for arm in range(humans.shape[0]):
                rows = humans[arm]
                for limb in range(3):
                    length = rows[(ARM_LENGTH + limb) * ROW + column]
                    for axis in range(3):
                        b0[axis] = rows[(3 * limb + axis) * ROW + column]
                        along = rows[(ARM_AXIS + 3 * limb + axis) * ROW + column]
                        b1[axis] = b0[axis] + length * along
                    s, t, squared = closest_parameters(a0, a1, b0, b1)
                    gap = np.sqrt(squared) - body[RADII + part] - human_radii[arm, limb]
                    if gap < nearest:
                        nearest = gap
                        spread = rows[(ARM_SIGMA + limb) * ROW + column]
                        spread += t * length * rows[(ARM_RISE + limb) * ROW + column]
                        inside = gap <= par[P_MARGIN] + par[P_KAPPA] * spread
                        place = beyond + (1.0 - s) * body[LENGTHS + 1 + part]
                        cost = place if inside else 0.0
        work[COLLISION * ROW + column] = work.dtype.type(cost)
