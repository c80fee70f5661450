"""Algorithm 1: the parameters that a condition asks for, found by simulating the whole grid.

As the thesis has it: of all cells whose motion has no collision cost and at most 10 % of the largest
control cost, the one with the most time steps, and among those the one with the most roll-outs. Three
gaps are closed: the grid starts at the smallest usable values instead of zero, the largest control
cost is that over the grid, and where no cell passes (about half of the conditions) there is a
defined answer all the same.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hri_planner.adaptation.grid import SHAPE, Cell, cell_at
from hri_prediction.errors import DataError

FloatArray = NDArray[np.float64]

SMOOTH_SHARE = 0.1
"""Control costs above this share of the largest on the grid do not pass."""
FILTERS = "both filters"
LEAST_CONTROL = "least control cost without collision"
LEAST_COLLISION = "least collision cost"
RULES = (FILTERS, LEAST_CONTROL, LEAST_COLLISION)
"""What may have given a label, in the order in which they are tried."""


@dataclass(frozen=True)
class Label:
    """What a condition asks for.

    Attributes:
        cell: Parameters; on the grid.
        rule: One of :data:`RULES`.
    """

    cell: Cell
    rule: str


def label(collision: FloatArray, control: FloatArray) -> Label:
    """The label of one condition.

    Args:
        collision: Collision cost of the motion made with each cell, of :data:`.SHAPE`; 0 means none.
        control: Its control cost.

    Raises:
        DataError: when an array has another shape or holds NaN, infinity or negative costs.
    """
    for name, values in (("collision", collision), ("control", control)):
        if np.shape(values) != SHAPE:
            raise DataError(f"{name} costs of shape {np.shape(values)}", expected=f"{SHAPE}")
        if not np.all(np.isfinite(values)) or np.min(values) < 0.0:
            raise DataError(f"{name} costs that are not finite or negative")
    free = collision <= 0.0
    smooth = control <= SMOOTH_SHARE * control.max()
    passed = np.flatnonzero(free & smooth)
    if len(passed):
        # Cells are in the order of TS, then NT: the last has most time steps, then most roll-outs.
        return Label(cell_at(int(passed[-1])), FILTERS)
    if free.any():
        return Label(cell_at(int(np.argmin(np.where(free, control, np.inf)))), LEAST_CONTROL)
    return Label(cell_at(int(np.argmin(collision))), LEAST_COLLISION)
